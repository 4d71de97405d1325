"""Structure matrix and the wrench the cables must supply; docs/model.md, section 4."""

from __future__ import annotations

from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.balance import geometry as g
from sagline.kernels.jit import entry, formula


@formula
def structure_matrix(geometry: Array, matrix: Array) -> None:
    """Fill J (6, m): columns (u; r x u), u the unit vector from platform end to frame end."""
    for i in range(geometry.shape[1]):
        x = -geometry[g.COSINE, i] * geometry[g.AZIMUTH_X, i]
        y = -geometry[g.COSINE, i] * geometry[g.AZIMUTH_Y, i]
        z = -geometry[g.SINE, i]
        rx, ry, rz = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        matrix[0, i] = x
        matrix[1, i] = y
        matrix[2, i] = z
        matrix[3, i] = ry * z - rz * y
        matrix[4, i] = rz * x - rx * z
        matrix[5, i] = rx * y - ry * x


@formula
def needed_wrench(geometry: Array, body: Array, wrench: Array, work: Array, balance: Array) -> None:
    """Fill row NEEDED of balance with the wrench (6,) that the chord tensions must supply: J tau = needed.

    It balances the platform's weight (counted here, once), the given wrench (external plus inertial,
    about the center of mass) and the cables' pulls T_z - tau sin phi, which hang on the platform ends.
    """
    fz = body[tables.MASS] * body[tables.GRAVITY] - wrench[2]
    mx = -wrench[3]
    my = -wrench[4]
    for i in range(geometry.shape[1]):
        pull = work[tables.PULL, i]
        fz += pull
        mx += geometry[g.LEVER_Y, i] * pull
        my -= geometry[g.LEVER_X, i] * pull
    balance[tables.NEEDED, 0] = -wrench[0]
    balance[tables.NEEDED, 1] = -wrench[1]
    balance[tables.NEEDED, 2] = fz
    balance[tables.NEEDED, 3] = mx
    balance[tables.NEEDED, 4] = my
    balance[tables.NEEDED, 5] = -wrench[5]


@formula
def restrict_rows(freedom: Array, full: Array, restricted: Array) -> None:
    """Rows of the structure matrix along the platform's free motions: freedom (n, 6) times J (6, m)."""
    n = freedom.shape[0]
    for k in range(n):
        for i in range(full.shape[1]):
            if n == 6:  # every motion is free
                restricted[k, i] = full[k, i]
            else:
                total = 0.0
                for j in range(6):
                    total += freedom[k, j] * full[j, i]
                restricted[k, i] = total


@formula
def restrict_needed(freedom: Array, balance: Array) -> None:
    """Fill row RIGHT of balance with the needed wrench's components along the platform's free motions."""
    n = freedom.shape[0]
    for k in range(n):
        if n == 6:
            balance[tables.RIGHT, k] = balance[tables.NEEDED, k]
        else:
            total = 0.0
            for j in range(6):
                total += freedom[k, j] * balance[tables.NEEDED, j]
            balance[tables.RIGHT, k] = total


@entry
def structure_matrices(geometries: Array, matrices: Array) -> None:
    """Fill J (N, 6, m) of the geometry rows of N poses."""
    for p in range(geometries.shape[0]):
        structure_matrix(geometries[p], matrices[p])

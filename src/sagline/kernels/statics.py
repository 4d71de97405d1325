"""Structure matrix and the wrench the cables must supply; docs/model.md, section 4."""

from __future__ import annotations

from sagline.arrays import Array
from sagline.kernels import geometry as g
from sagline.kernels import tables
from sagline.kernels.jit import kernel


@kernel
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


@kernel
def needed_wrench(geometry: Array, body: Array, wrench: Array, pulls: Array, needed: Array) -> None:
    """Fill the wrench (6,) that the chord tensions must supply: J tau = needed.

    It balances the platform's weight (counted here, once), the given wrench (external plus inertial,
    about the center of mass) and the cables' pulls T_z - tau sin phi, which hang on the platform ends.
    """
    for k in range(6):
        needed[k] = -wrench[k]
    needed[2] += body[tables.MASS] * body[tables.GRAVITY]
    for i in range(geometry.shape[1]):
        needed[2] += pulls[i]
        needed[3] += geometry[g.LEVER_Y, i] * pulls[i]
        needed[4] -= geometry[g.LEVER_X, i] * pulls[i]


@kernel
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


@kernel
def restrict_vector(freedom: Array, full: Array, restricted: Array) -> None:
    """Components (n,) of a wrench (6,) along the platform's free motions."""
    n = freedom.shape[0]
    for k in range(n):
        if n == 6:
            restricted[k] = full[k]
        else:
            total = 0.0
            for j in range(6):
                total += freedom[k, j] * full[j]
            restricted[k] = total

"""Structure matrix and the wrench the cables must supply; docs/model.md, section 4."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.jit import entry, formula


@formula
def fill_structure_matrix(geometry: Array, matrix: Array) -> None:
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
def needed_wrench(geometry: Array, body: Array, wrench: Array, pull: Array, needed: Array) -> None:
    """Fill the wrench (6,) that the chord tensions must supply: J tau = needed.

    It balances the platform's weight (counted here, once), the given wrench (external plus inertial,
    about the center of mass) and the cables' pulls T_z - tau sin phi (m,), which hang on the platform ends.
    """
    fz = body[tables.MASS] * body[tables.GRAVITY] - wrench[2]
    mx = -wrench[3]
    my = -wrench[4]
    for i in range(geometry.shape[1]):
        fz += pull[i]
        mx += geometry[g.LEVER_Y, i] * pull[i]
        my -= geometry[g.LEVER_X, i] * pull[i]
    needed[0] = -wrench[0]
    needed[1] = -wrench[1]
    needed[2] = fz
    needed[3] = mx
    needed[4] = my
    needed[5] = -wrench[5]


@formula
def along_freedom(freedom: Array, full: Array, part: Array) -> None:
    """Fill the components (n,) of a wrench (6,) along the platform's free motions (n, 6)."""
    n = freedom.shape[0]
    for k in range(n):
        if n == 6:  # every motion is free
            part[k] = full[k]
        else:
            part[k] = 0.0
            for j in range(6):
                part[k] += freedom[k, j] * full[j]


@formula
def rows_along_freedom(freedom: Array, full: Array, part: Array) -> None:
    """Fill the rows (n, m) of a structure matrix (6, m) along the platform's free motions (n, 6)."""
    n = freedom.shape[0]
    for k in range(n):
        for i in range(full.shape[1]):
            if n == 6:
                part[k, i] = full[k, i]
            else:
                part[k, i] = 0.0
                for j in range(6):
                    part[k, i] += freedom[k, j] * full[j, i]


@entry
def structure_matrices(geometries: Array, matrices: Array) -> None:
    """Fill J of N poses, (N, 6, m), from their geometry rows, (N, GEOMETRY_ROWS, m)."""
    for p in range(geometries.shape[0]):
        fill_structure_matrix(geometries[p], matrices[p])

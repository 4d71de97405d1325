"""Structure matrix and needed wrench, also along the free motions of a platform; docs/model.md, section 4.

The rows `free` (n, 6) select the free motions. Each row has one nonzero entry, the unit of its motion.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.jit import entry, formula, glue, kernel


@glue
def translation_count(freedom: Array) -> int:
    """Number of free translations, which are listed before the free rotations."""
    count = 0
    for k in range(freedom.shape[0]):
        count += 0 if is_rotation(freedom, k) else 1
    return count


@formula
def is_rotation(freedom: Array, k: int) -> bool:
    """True if free motion `k` of the platform is a rotation. The translations are listed first."""
    return freedom[k, 3] * freedom[k, 3] + freedom[k, 4] * freedom[k, 4] + freedom[k, 5] * freedom[k, 5] > 0.5


@kernel
def symmetric_part(free: Array, full: Array, matrix: Array) -> None:
    """Fill `matrix` (n, n) with the symmetric part of free K free^T, where K is `full`."""
    matrix_along(free, full, matrix)
    for j in range(matrix.shape[0]):
        for k in range(j):
            mean = 0.5 * (matrix[j, k] + matrix[k, j])
            matrix[j, k] = mean
            matrix[k, j] = mean


@formula
def matrix_along(free: Array, full: Array, matrix: Array) -> None:
    """Fill `matrix` (n, n) with free K free^T, where K is `full`."""
    n = free.shape[0]
    for j in range(n):
        for k in range(n):
            if n == 6:
                matrix[j, k] = full[j, k] * free[j, j] * free[k, k]
                continue
            total = 0.0
            for a in range(6):
                for b in range(6):
                    total += free[j, a] * full[a, b] * free[k, b]
            matrix[j, k] = total


@kernel
def components_along(free: Array, full: Array, part: Array) -> float:
    """Fill the components `part` (n,) of the wrench `full` (6,) along the free motions. Returns their norm."""
    square = 0.0
    for j in range(free.shape[0]):
        total = 0.0
        for a in range(6):
            total += free[j, a] * full[a]
        part[j] = total
        square += total * total
    return math.sqrt(square)


@formula
def fill_motion_of_components(free: Array, part: Array, motion: Array) -> None:
    """Fill `motion` (6,) from its components `part` (n,) along the free motions."""
    for a in range(6):
        motion[a] = 0.0
    for j in range(free.shape[0]):
        for a in range(6):
            motion[a] += free[j, a] * part[j]


@formula
def norm(vector: Array) -> float:
    """Euclidean length of `vector`."""
    total = 0.0
    for k in range(vector.shape[0]):
        total += vector[k] * vector[k]
    return math.sqrt(total)


@formula
def fill_structure_matrix(geometry: Array, matrix: Array) -> None:
    """Fill J (6, m). Its columns are (u; r x u), where u is the unit vector from platform end to frame end."""
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
def needed_wrench(geometry: Array, body: Array, wrench: Array, sag_force: Array, needed: Array) -> None:
    """Fill the wrench (6,) that the chord tensions must supply: J tau = needed.

    This wrench balances three loads. The first is the platform's weight, which no other argument includes. The second
    is the given wrench, external plus inertial, about the center of mass. The third are the sag forces T_z - tau sin
    phi (m,) of the cables, which act at the platform ends.
    """
    fz = body[tables.MASS] * body[tables.GRAVITY] - wrench[2]
    mx = -wrench[3]
    my = -wrench[4]
    for i in range(geometry.shape[1]):
        fz += sag_force[i]
        mx += geometry[g.LEVER_Y, i] * sag_force[i]
        my -= geometry[g.LEVER_X, i] * sag_force[i]
    needed[0] = -wrench[0]
    needed[1] = -wrench[1]
    needed[2] = fz
    needed[3] = mx
    needed[4] = my
    needed[5] = -wrench[5]


@formula
def along_freedom(freedom: Array, full: Array, part: Array) -> None:
    """Fill the components `part` (n,) of the wrench `full` (6,) along the platform's free motions (n, 6)."""
    n = freedom.shape[0]
    for k in range(n):
        if n == 6:  # all motions are free
            part[k] = full[k]
        else:
            part[k] = 0.0
            for j in range(6):
                part[k] += freedom[k, j] * full[j]


@formula
def rows_along_freedom(freedom: Array, full: Array, part: Array) -> None:
    """Fill the rows `part` (n, m) of the structure matrix `full` (6, m) along the platform's free motions (n, 6)."""
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

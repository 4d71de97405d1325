"""Between the six motions of a body in space and the free ones of a platform, each in its own unit.

The rows `free` (n, 6) are the platform's freedom, each times the unit of its motion; of six each has one entry.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, glue, kernel


@glue
def translation_count(freedom: Array) -> int:
    """Number of free translations; they come before the free rotations."""
    count = 0
    for k in range(freedom.shape[0]):
        count += 0 if is_rotation(freedom, k) else 1
    return count


@formula
def is_rotation(freedom: Array, k: int) -> bool:
    """True if free motion k of the platform is a rotation; the translations come first."""
    return freedom[k, 3] * freedom[k, 3] + freedom[k, 4] * freedom[k, 4] + freedom[k, 5] * freedom[k, 5] > 0.5


@kernel
def symmetric_part(free: Array, full: Array, matrix: Array) -> None:
    """Fill the symmetric part of free K free^T (n, n)."""
    matrix_along(free, full, matrix)
    for j in range(matrix.shape[0]):
        for k in range(j):
            mean = 0.5 * (matrix[j, k] + matrix[k, j])
            matrix[j, k] = mean
            matrix[k, j] = mean


@formula
def matrix_along(free: Array, full: Array, matrix: Array) -> None:
    """Fill free K free^T (n, n)."""
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
    """Fill the components (n,) of a wrench (6,) along the free motions; returns their norm."""
    square = 0.0
    for j in range(free.shape[0]):
        total = 0.0
        for a in range(6):
            total += free[j, a] * full[a]
        part[j] = total
        square += total * total
    return math.sqrt(square)


@formula
def motion_along(free: Array, part: Array, motion: Array) -> None:
    """Fill the motion (6,) that components (n,) along the free motions stand for."""
    for a in range(6):
        motion[a] = 0.0
    for j in range(free.shape[0]):
        for a in range(6):
            motion[a] += free[j, a] * part[j]


@formula
def norm(vector: Array) -> float:
    """Euclidean length."""
    total = 0.0
    for k in range(vector.shape[0]):
        total += vector[k] * vector[k]
    return math.sqrt(total)

"""Between the six motions of a body in space and the free ones of a platform, each in its own unit."""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels.jit import formula, kernel


@formula
def turns(freedom: Array, k: int) -> bool:
    """Whether free motion k of the platform turns it; the others, which come first, are translations."""
    return freedom[k, 3] * freedom[k, 3] + freedom[k, 4] * freedom[k, 4] + freedom[k, 5] * freedom[k, 5] > 0.5


@kernel
def symmetric_part(freedom: Array, full: Array, scale: Array, matrix: Array) -> None:
    """Fill the symmetric part of freedom K freedom^T (n, n), rows and columns scaled."""
    rows_along(freedom, full, scale, matrix)
    for j in range(matrix.shape[0]):
        for k in range(j):
            mean = 0.5 * (matrix[j, k] + matrix[k, j])
            matrix[j, k] = mean
            matrix[k, j] = mean


@formula
def rows_along(freedom: Array, full: Array, scale: Array, matrix: Array) -> None:
    """Fill freedom K freedom^T (n, n) with rows and columns scaled."""
    n = freedom.shape[0]
    for j in range(n):
        for k in range(n):
            total = full[j, k]
            if n != 6:
                total = 0.0
                for a in range(6):
                    for b in range(6):
                        total += freedom[j, a] * full[a, b] * freedom[k, b]
            matrix[j, k] = total * scale[j] * scale[k]


@kernel
def components_along(freedom: Array, full: Array, scale: Array, part: Array) -> float:
    """Fill the scaled components (n,) of a wrench (6,) along the free motions; returns their norm."""
    square = 0.0
    for j in range(freedom.shape[0]):
        total = 0.0
        for a in range(6):
            total += freedom[j, a] * full[a]
        part[j] = total * scale[j]
        square += part[j] * part[j]
    return math.sqrt(square)


@formula
def spread(freedom: Array, part: Array, scale: Array, motion: Array) -> None:
    """Fill the motion (6,) that scaled components (n,) along the free motions stand for."""
    for a in range(6):
        motion[a] = 0.0
    for j in range(freedom.shape[0]):
        share = part[j] * scale[j]
        for a in range(6):
            motion[a] += freedom[j, a] * share


@formula
def norm(vector: Array) -> float:
    """Euclidean length."""
    total = 0.0
    for k in range(vector.shape[0]):
        total += vector[k] * vector[k]
    return math.sqrt(total)

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
def restricted(freedom: Array, full: Array, scale: Array, matrix: Array) -> None:
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
def make_symmetric(matrix: Array) -> None:
    """Replace a matrix by its symmetric part."""
    for j in range(matrix.shape[0]):
        for k in range(j):
            mean = 0.5 * (matrix[j, k] + matrix[k, j])
            matrix[j, k] = mean
            matrix[k, j] = mean


@kernel
def project(freedom: Array, full: Array, scale: Array, part: Array) -> None:
    """Fill the scaled components (n,) of a wrench (6,) along the free motions."""
    n = freedom.shape[0]
    for j in range(n):
        total = full[j]
        if n != 6:
            total = 0.0
            for a in range(6):
                total += freedom[j, a] * full[a]
        part[j] = total * scale[j]


@kernel
def spread(freedom: Array, part: Array, scale: Array, motion: Array) -> None:
    """Fill the motion (6,) that scaled components (n,) along the free motions stand for."""
    n = freedom.shape[0]
    for a in range(6):
        if n == 6:
            motion[a] = part[a] * scale[a]
        else:
            total = 0.0
            for j in range(n):
                total += freedom[j, a] * part[j] * scale[j]
            motion[a] = total


@kernel
def norm(vector: Array) -> float:
    """Euclidean length."""
    total = 0.0
    for k in range(vector.shape[0]):
        total += vector[k] * vector[k]
    return math.sqrt(total)

"""Small positive definite systems, by the Cholesky factor."""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels.jit import kernel


@kernel
def factor_positive(matrix: Array) -> bool:
    """Cholesky factor L of a symmetric matrix (r, r), in its lower triangle; False if it is not positive definite."""
    r = matrix.shape[0]
    for k in range(r):
        for j in range(k + 1):
            total = matrix[k, j]
            for i in range(j):
                total -= matrix[k, i] * matrix[j, i]
            if k > j:
                matrix[k, j] = total / matrix[j, j]
            elif total > 0.0:
                matrix[k, k] = math.sqrt(total)
            else:
                return False
    return True


@kernel
def solve_lower(factor: Array, vector: Array) -> None:
    """L x = vector, in place."""
    for k in range(vector.size):
        for j in range(k):
            vector[k] -= factor[k, j] * vector[j]
        vector[k] /= factor[k, k]


@kernel
def solve_upper(factor: Array, vector: Array) -> None:
    """L^T x = vector, in place."""
    for k in range(vector.size - 1, -1, -1):
        for j in range(k + 1, vector.size):
            vector[k] -= factor[j, k] * vector[j]
        vector[k] /= factor[k, k]

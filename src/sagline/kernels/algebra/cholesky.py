"""Small positive definite systems, by the Cholesky factor."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import kernel

LEAST_PIVOT = 1e-15  # of the diagonal element it is left of: smaller ones are rounding


@kernel
def factor_positive(matrix: Array, shift: float, factor: Array) -> bool:
    """Fill the lower triangle of the factor L of matrix + shift 1, (n, n); False if that is not positive definite.

    Of the matrix only the lower triangle counts; factor may be the matrix itself.
    """
    n = matrix.shape[0]
    for j in range(n):
        diagonal = matrix[j, j] + shift
        pivot = diagonal
        for k in range(j):
            pivot -= factor[j, k] * factor[j, k]
        if not pivot > LEAST_PIVOT * abs(diagonal):
            return False
        root = math.sqrt(pivot)
        inverse = 1.0 / root
        factor[j, j] = root
        for i in range(j + 1, n):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = total * inverse
    return True


@kernel
def solve_lower(factor: Array, vector: Array) -> None:
    """Replace a vector (n,) by x with L x = vector."""
    for k in range(vector.size):
        for j in range(k):
            vector[k] -= factor[k, j] * vector[j]
        vector[k] /= factor[k, k]


@kernel
def solve_upper(factor: Array, vector: Array) -> None:
    """Replace a vector (n,) by x with L^T x = vector."""
    for k in range(vector.size - 1, -1, -1):
        for j in range(k + 1, vector.size):
            vector[k] -= factor[j, k] * vector[j]
        vector[k] /= factor[k, k]

"""Small general systems, by Gauss elimination."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.jit import kernel


@kernel
def solve_general(matrix: Array, right: Array) -> bool:
    """Gauss elimination with partial pivoting; matrix is destroyed, right becomes the solution; False if singular."""
    n = matrix.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if not abs(matrix[best, k]) > 0.0:
            return False
        if best != k:
            for j in range(k, n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            right[k], right[best] = right[best], right[k]
        for i in range(k + 1, n):
            ratio = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= ratio * matrix[k, j]
            right[i] -= ratio * right[k]
    for r in range(n):
        i = n - 1 - r
        total = right[i]
        for j in range(i + 1, n):
            total -= matrix[i, j] * right[j]
        right[i] = total / matrix[i, i]
    return True

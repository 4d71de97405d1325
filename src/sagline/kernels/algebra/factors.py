"""Small dense systems: Cholesky factor, Gauss elimination, orthonormal frames, and Householder factors.

A matrix (n, m), n <= m, is factored as matrix.T = Q R with an orthogonal Q. The first n columns of Q give the
minimum-norm solutions. The other columns span the null space. In the short loops a single sum would have to wait for
each term. The loops therefore add several independent sums.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

LEAST_PIVOT = 1e-15  # relative to the original diagonal element; a smaller pivot is only a rounding error


@kernel
def factor_positive(matrix: Array, shift: float, factor: Array) -> bool:
    """Fill the lower triangle of the factor L of `matrix` + `shift` 1, (n, n). False if not positive definite.

    Only the lower triangle of `matrix` is used. `factor` may be the same array as `matrix`.
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
    """Replace `vector` (n,) by the solution x of L x = `vector`."""
    for k in range(vector.size):
        for j in range(k):
            vector[k] -= factor[k, j] * vector[j]
        vector[k] /= factor[k, k]


@kernel
def solve_upper(factor: Array, vector: Array) -> None:
    """Replace `vector` (n,) by the solution x of L^T x = `vector`."""
    for k in range(vector.size - 1, -1, -1):
        for j in range(k + 1, vector.size):
            vector[k] -= factor[j, k] * vector[j]
        vector[k] /= factor[k, k]


@kernel
def solve_general(matrix: Array, right: Array) -> bool:
    """Gauss elimination with partial pivoting. Destroys `matrix`; `right` becomes the solution. False if singular."""
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


@formula
def orthogonalize_row(frame: Array, count: int, triangle: Array) -> float:
    """Make row `count` of a frame (.., d) orthogonal to the rows before it, which are orthonormal.

    The subtracted components fill column `count` of the triangle above its diagonal. Returns the squared length of the
    new row.
    """
    d = frame.shape[1]
    for b in range(count):
        triangle[b, count] = 0.0
    for _ in range(2):
        for b in range(count):
            share = 0.0
            for k in range(d):
                share += frame[b, k] * frame[count, k]
            triangle[b, count] += share
            for k in range(d):
                frame[count, k] -= share * frame[b, k]
    square = 0.0
    for k in range(d):
        square += frame[count, k] * frame[count, k]
    return square


@formula
def normalize_row(frame: Array, count: int, triangle: Array, square: float) -> None:
    """Scale row `count` of the frame to unit length. `square` is the result of `orthogonalize_row`."""
    length = math.sqrt(square)
    triangle[count, count] = length
    for k in range(frame.shape[1]):
        frame[count, k] /= length


HEADS, FACTORS = 0, 1

RANK = 1e-9  # relative to its row of the matrix; a matrix with a smaller diagonal entry of R does not have full rank


@formula
def factorize(reduced: Array, diagonals: Array) -> bool:
    """QR factorization in place; returns True if the matrix (n, m) has full rank.

    On return, row k of reduced contains the part of column k of R above the diagonal, then the vector v of reflection
    k. In diagonals (2, n), row HEADS is the diagonal of R, and row FACTORS contains 2/|v|^2 of the reflections.
    """
    n, m = reduced.shape
    for k in range(n):
        before = 0.0
        for i in range(k):
            before += reduced[k, i] * reduced[k, i]
        square = 0.0
        for i in range(k, m):
            square += reduced[k, i] * reduced[k, i]
        if not square > RANK * RANK * (before + square):
            return False
        norm = math.sqrt(square)
        first = reduced[k, k]
        head = -math.copysign(norm, first)
        factor = 1.0 / (norm * (norm + abs(first)))
        diagonals[HEADS, k] = head
        diagonals[FACTORS, k] = factor
        reduced[k, k] = first - head
        for j in range(k + 1, n):
            total = 0.0
            for i in range(k, m):
                total += reduced[k, i] * reduced[j, i]
            total *= factor
            for i in range(k, m):
                reduced[j, i] -= total * reduced[k, i]
    return True


@formula
def orthogonal_factor(reduced: Array, diagonals: Array, q: Array) -> None:
    """Fill Q (m, m) from its reflections. Row m of `q` is a work row."""
    n, m = reduced.shape
    for i in range(m):
        for j in range(m):
            q[i, j] = 0.0
        q[i, i] = 1.0
    for k in range(n - 1, -1, -1):
        for j in range(m):
            q[m, j] = 0.0
        for i in range(k, m):
            for j in range(m):
                q[m, j] += reduced[k, i] * q[i, j]
        for i in range(k, m):
            share = diagonals[FACTORS, k] * reduced[k, i]
            for j in range(m):
                q[i, j] -= share * q[m, j]


@formula
def pseudo_inverse(reduced: Array, diagonals: Array, q: Array, inverse: Array) -> None:
    """Fill the transposed pseudo-inverse (n, m). The minimum-norm solution is right . inverse."""
    n, m = reduced.shape
    for k in range(n - 1, -1, -1):
        for i in range(m):
            inverse[k, i] = q[i, k]
        for j in range(k + 1, n):
            for i in range(m):
                inverse[k, i] -= reduced[j, k] * inverse[j, i]
        head = 1.0 / diagonals[HEADS, k]
        for i in range(m):
            inverse[k, i] *= head


@formula
def minimum_norm(inverse: Array, right: Array, solution: Array) -> None:
    """Fill the minimum-norm `solution` (m,) of the equations matrix . solution = `right` (n,)."""
    n, m = inverse.shape
    for i in range(m):
        solution[i] = 0.0
    for k in range(n):
        for i in range(m):
            solution[i] += right[k] * inverse[k, i]

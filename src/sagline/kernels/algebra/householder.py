"""Minimum-norm solution and null space of an underdetermined system, by Householder QR of its transpose.

For a matrix (n, m), n <= m, matrix.T = Q R: the first n columns of the orthogonal Q give the
minimum-norm solutions, the others span the null space. Sums that do not depend on each other run side by
side: the loops are small and would otherwise wait for themselves.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula

HEADS, FACTORS = 0, 1

RANK = 1e-9  # a diagonal entry of R below this share of its row says that rank is lost


@formula
def factorize(reduced: Array, diagonals: Array) -> bool:
    """QR in place; returns whether the matrix (n, m) has full rank.

    Row k of reduced then holds column k of R before its diagonal and the k-th reflection's vector from there
    on; row HEADS of diagonals (2, n) is the diagonal of R, row FACTORS the reflections' 2/|v|^2.
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
    """Fill Q (m, m) from its reflections; a row m of q is working space."""
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
    """Fill the transposed pseudo-inverse (n, m): the minimum-norm solution is right . inverse."""
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
    """Fill the shortest solution (m,) of matrix solution = right (n,)."""
    n, m = inverse.shape
    for i in range(m):
        solution[i] = 0.0
    for k in range(n):
        for i in range(m):
            solution[i] += right[k] * inverse[k, i]

"""Minimum-norm solution and null space of an underdetermined system, by Householder QR of its transpose."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array
from sagline.kernels.jit import kernel

RANK = 1e-9  # a diagonal entry below this share of the first says that rank is lost


@kernel
def factorize(matrix: Array, triangle: Array, basis: Array, order: Array) -> bool:
    """QR with row pivoting of matrix (n, m), n <= m: matrix[order].T = basis[:, :n] triangle.

    Fills triangle (n, n, upper), the orthogonal basis (m, m), whose last m - n columns span the null
    space, and order (n,). Returns whether the matrix has full rank.
    """
    n, m = matrix.shape
    work = np.empty((m, n))
    for k in range(n):
        order[k] = k
        for i in range(m):
            work[i, k] = matrix[k, i]
    for i in range(m):
        for j in range(m):
            basis[i, j] = 1.0 if i == j else 0.0
    vector = np.empty(m)
    for k in range(n):
        pivot(work, order, k)
        square = 0.0
        for i in range(k, m):
            square += work[i, k] * work[i, k]
        norm = math.sqrt(square)
        if norm <= RANK * abs(work[0, 0]) or norm == 0.0:
            return False
        head = -math.copysign(norm, work[k, k])
        for i in range(k, m):
            vector[i] = work[i, k]
        vector[k] -= head
        factor = 1.0 / (norm * (norm + abs(work[k, k])))  # 2/|v|^2
        reflect(work, vector, factor, k, k, n)
        # basis = H_1 H_2 ... : each reflection acts from the right
        for i in range(m):
            total = 0.0
            for j in range(k, m):
                total += basis[i, j] * vector[j]
            total *= factor
            for j in range(k, m):
                basis[i, j] -= total * vector[j]
    for k in range(n):
        for j in range(n):
            triangle[k, j] = work[k, j] if j >= k else 0.0
    return True


@kernel
def pivot(work: Array, order: Array, k: int) -> None:
    """Bring the remaining column of largest norm to place k."""
    m, n = work.shape
    best = k
    largest = -1.0
    for j in range(k, n):
        square = 0.0
        for i in range(k, m):
            square += work[i, j] * work[i, j]
        if square > 1.0000001 * largest:
            largest = square
            best = j
    if best != k:
        for i in range(m):
            work[i, k], work[i, best] = work[i, best], work[i, k]
        order[k], order[best] = order[best], order[k]


@kernel
def reflect(work: Array, vector: Array, factor: float, start: int, first: int, last: int) -> None:
    """Apply I - factor v v^T from the left to columns first..last-1; v is zero before start."""
    for j in range(first, last):
        total = 0.0
        for i in range(start, work.shape[0]):
            total += vector[i] * work[i, j]
        total *= factor
        for i in range(start, work.shape[0]):
            work[i, j] -= total * vector[i]


@kernel
def minimum_norm(triangle: Array, basis: Array, order: Array, right: Array, solution: Array) -> None:
    """Fill the shortest solution (m,) of matrix t = right."""
    n = triangle.shape[0]
    m = basis.shape[0]
    forward = np.empty(n)
    for k in range(n):
        total = right[order[k]]
        for j in range(k):
            total -= triangle[j, k] * forward[j]
        forward[k] = total / triangle[k, k]
    for i in range(m):
        total = 0.0
        for k in range(n):
            total += basis[i, k] * forward[k]
        solution[i] = total

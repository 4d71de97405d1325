"""Linear algebra of small dense systems (n <= 6), in place and without allocation."""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels.jit import kernel

SWEEPS = 30


@kernel
def cholesky(matrix: Array, shift: float, factor: Array) -> bool:
    """Fill the lower factor of matrix + shift 1; whether that is positive definite."""
    n = matrix.shape[0]
    for j in range(n):
        pivot = matrix[j, j] + shift
        for k in range(j):
            pivot -= factor[j, k] * factor[j, k]
        if not pivot > 1e-15 * (abs(matrix[j, j]) + shift):
            return False
        root = math.sqrt(pivot)
        factor[j, j] = root
        for i in range(j + 1, n):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = total / root
    return True


@kernel
def solve_lower(factor: Array, right: Array, solution: Array) -> None:
    """Forward substitution; solution may be right."""
    for i in range(factor.shape[0]):
        total = right[i]
        for k in range(i):
            total -= factor[i, k] * solution[k]
        solution[i] = total / factor[i, i]


@kernel
def solve_upper(factor: Array, right: Array, solution: Array) -> None:
    """Back substitution with the transpose of a lower factor; solution may be right."""
    n = factor.shape[0]
    for r in range(n):
        i = n - 1 - r
        total = right[i]
        for k in range(i + 1, n):
            total -= factor[k, i] * solution[k]
        solution[i] = total / factor[i, i]


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


@kernel
def tridiagonalize(matrix: Array, diagonal: Array, beside: Array, vector: Array, product: Array) -> None:
    """Householder: fill diagonal (n,) and beside (n,), last entry 0, of a similar matrix; matrix is destroyed."""
    n = matrix.shape[0]
    for k in range(n - 2):
        square = 0.0
        for i in range(k + 1, n):
            vector[i] = matrix[i, k]
            square += vector[i] * vector[i]
        rest = square - vector[k + 1] * vector[k + 1]
        if rest == 0.0:
            beside[k] = vector[k + 1]
            continue
        head = -math.copysign(math.sqrt(square), vector[k + 1])
        beside[k] = head
        vector[k + 1] -= head
        factor = 2.0 / (rest + vector[k + 1] * vector[k + 1])
        along = 0.0
        for i in range(k + 1, n):
            total = 0.0
            for j in range(k + 1, n):
                total += matrix[i, j] * vector[j]
            product[i] = factor * total
            along += product[i] * vector[i]
        for i in range(k + 1, n):
            product[i] -= 0.5 * factor * along * vector[i]
        for i in range(k + 1, n):
            for j in range(k + 1, n):
                matrix[i, j] -= vector[i] * product[j] + product[i] * vector[j]
    for k in range(n):
        diagonal[k] = matrix[k, k]
    if n > 1:
        beside[n - 2] = matrix[n - 1, n - 2]
    beside[n - 1] = 0.0


@kernel
def implicit_shift(diagonal: Array, beside: Array, first: int, last: int) -> None:
    """One QL step with Wilkinson's shift on rows first..last of a tridiagonal matrix (EISPACK's imtql1)."""
    g = 0.5 * (diagonal[first + 1] - diagonal[first]) / beside[first]
    r = math.sqrt(g * g + 1.0)
    g = diagonal[last] - diagonal[first] + beside[first] / (g + math.copysign(r, g))
    s = 1.0
    c = 1.0
    p = 0.0
    for k in range(last - first):
        i = last - 1 - k
        f = s * beside[i]
        b = c * beside[i]
        r = math.sqrt(f * f + g * g)
        beside[i + 1] = r
        if r == 0.0:
            diagonal[i + 1] -= p
            beside[last] = 0.0
            return
        s = f / r
        c = g / r
        g = diagonal[i + 1] - p
        r = (diagonal[i] - g) * s + 2.0 * c * b
        p = s * r
        diagonal[i + 1] = g + p
        g = c * r - b
    diagonal[first] -= p
    beside[first] = g
    beside[last] = 0.0


@kernel
def extreme_eigenvalues(matrix: Array, diagonal: Array, beside: Array, vector: Array, product: Array):  # type: ignore[no-untyped-def]
    """Smallest and largest eigenvalue of a symmetric matrix (n, n), which is destroyed; the rest is room, (n,) each."""
    n = matrix.shape[0]
    tridiagonalize(matrix, diagonal, beside, vector, product)
    for first in range(n):
        for _ in range(SWEEPS):
            last = first
            for k in range(first, n - 1):
                if abs(beside[k]) <= 1e-16 * (abs(diagonal[k]) + abs(diagonal[k + 1])):
                    break
                last = k + 1
            if last == first:
                break
            implicit_shift(diagonal, beside, first, last)
    low = diagonal[0]
    high = diagonal[0]
    for k in range(1, n):
        low = min(low, diagonal[k])
        high = max(high, diagonal[k])
    return low, high


@kernel
def trust_step(matrix: Array, gradient: Array, radius: float, factor: Array, work: Array, step: Array) -> float:
    """Fill the step that minimizes g.s + s.H s/2 within |s| <= radius; returns the shift mu it took.

    More and Sorensen: (H + mu 1) s = -g with the smallest mu that makes the matrix positive definite and the step
    short enough; 0 is a plain Newton step.
    """
    n = gradient.shape[0]
    square = 0.0
    for i in range(n):
        square += gradient[i] * gradient[i]
    frobenius = 0.0
    for i in range(n):
        for j in range(n):
            frobenius += matrix[i, j] * matrix[i, j]
    low = 0.0
    high = math.sqrt(square) / radius + math.sqrt(frobenius)
    shift = 0.0
    for _ in range(40):
        if not cholesky(matrix, shift, factor):
            low = max(low, shift)
            shift = max(math.sqrt(low * high), low + 0.001 * (high - low))
            continue
        solve_lower(factor, gradient, work)
        solve_upper(factor, work, step)
        norm2 = 0.0
        for i in range(n):
            step[i] = -step[i]
            norm2 += step[i] * step[i]
        norm = math.sqrt(norm2)
        if norm <= 1.1 * radius and (shift == 0.0 or norm >= 0.8 * radius or high - low <= 1e-6 * high):
            break
        if norm > radius:
            low = shift
        else:
            high = shift
        solve_lower(factor, step, work)
        bend = 0.0
        for i in range(n):
            bend += work[i] * work[i]
        new = shift + norm2 / bend * (norm - radius) / radius
        shift = new if low < new < high else max(math.sqrt(low * high), low + 0.1 * (high - low))
    return shift

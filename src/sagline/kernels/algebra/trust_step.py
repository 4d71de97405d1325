"""The step of a descent with a trust region."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.algebra.cholesky import factor_positive, solve_lower, solve_upper
from sagline.kernels.jit import kernel


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
        if not factor_positive(matrix, shift, factor):
            low = max(low, shift)
            shift = max(math.sqrt(low * high), low + 0.001 * (high - low))
            continue
        for i in range(n):
            step[i] = -gradient[i]
        solve_lower(factor, step)
        solve_upper(factor, step)
        norm2 = 0.0
        for i in range(n):
            norm2 += step[i] * step[i]
        length = math.sqrt(norm2)
        if length <= 1.1 * radius and (shift == 0.0 or length >= 0.8 * radius or high - low <= 1e-6 * high):
            break
        if length > radius:
            low = shift
        else:
            high = shift
        for i in range(n):
            work[i] = step[i]
        solve_lower(factor, work)
        bend = 0.0
        for i in range(n):
            bend += work[i] * work[i]
        new = shift + norm2 / bend * (length - radius) / radius
        shift = new if low < new < high else max(math.sqrt(low * high), low + 0.1 * (high - low))
    return shift

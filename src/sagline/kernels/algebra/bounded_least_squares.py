"""Least squares between limits, for more unknowns than equations as well."""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.algebra.gram_schmidt import keep, take_out
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block, counters

STEPS = 200
AT_LOW, AT_HIGH, FREE = 0, 1, 2


@glue
def solve_free(matrix: Array, right: Array, side: Indices, held: Array, memory: Memory, solution: Array) -> None:
    """Least squares in the free unknowns, the others as held (m,): fills the solution (m,)."""
    n, m = matrix.shape
    frame, at = block(memory.numbers, 0, n + 1, n)
    triangle, at = block(memory.numbers, at, n + 1, n + 1)
    residuals, at = block(memory.numbers, at, 1, n)
    residual = residuals[0]
    columns, _ = counters(memory, 0, n)
    count = 0
    for k in range(n):
        residual[k] = right[k]
    for i in range(m):
        solution[i] = held[i]
        if side[i] == FREE and count < n:
            for k in range(n):
                frame[count, k] = matrix[k, i]
            keep(frame, count, triangle, take_out(frame, count, triangle))
            columns[count] = i
            count += 1
        else:
            for k in range(n):
                residual[k] -= matrix[k, i] * held[i]
    for c in range(count - 1, -1, -1):
        total = 0.0
        for k in range(n):
            total += frame[c, k] * residual[k]
        for b in range(c + 1, count):
            total -= triangle[c, b] * solution[columns[b]]
        solution[columns[c]] = total / triangle[c, c]


@glue
def slopes(matrix: Array, right: Array, x: Array, residual: Array, gradient: Array) -> None:
    """Fill the residual right - matrix x (n,) and its components along the columns (m,)."""
    n, m = matrix.shape
    for k in range(n):
        residual[k] = right[k]
        for i in range(m):
            residual[k] -= matrix[k, i] * x[i]
    for i in range(m):
        gradient[i] = 0.0
        for k in range(n):
            gradient[i] += matrix[k, i] * residual[k]


@kernel
def bounded_least_squares(
    matrix: Array, right: Array, low: Array, high: Array, memory: Memory, x: Array, residual: Array
) -> bool:
    """Fill the x (m,) within its limits that comes nearest to matrix x = right, and the residual (n,).

    Returns:
        Whether it is found.

    Source:
        Stark & Parker 1995, "Bounded-variable least squares: an algorithm and applications": an active-set method.
    """
    n, m = matrix.shape
    vectors, at = block(memory.numbers, 0, 2, m)
    gradient, solution = vectors[0], vectors[1]
    side, after = counters(memory, 0, m)
    rest = Memory(memory.numbers[at:], memory.counters[after:])
    for i in range(m):
        x[i] = low[i]
        side[i] = AT_LOW
    barred = -1  # an unknown that would not move when freed: rounding; not to be chosen twice in a row
    scale = 0.0
    for k in range(n):
        scale = max(scale, abs(right[k]))
    for _ in range(STEPS):
        slopes(matrix, right, x, residual, gradient)
        chosen = -1
        steepest = 1e-13 * scale
        for i in range(m):
            length = 0.0
            for k in range(n):
                length += matrix[k, i] * matrix[k, i]
            uphill = gradient[i] if side[i] == AT_LOW else -gradient[i]
            if side[i] != FREE and i != barred and uphill > steepest * math.sqrt(length):
                steepest = uphill / math.sqrt(length)
                chosen = i
        if chosen < 0:
            return True
        side[chosen] = FREE
        barred = -1
        for _inner in range(m + 1):
            solve_free(matrix, right, side, x, rest, solution)
            step = 1.0
            blocking = -1
            for i in range(m):
                if side[i] == FREE and not low[i] <= solution[i] <= high[i]:
                    limit = low[i] if solution[i] < low[i] else high[i]
                    share = (limit - x[i]) / (solution[i] - x[i])
                    if share < step:
                        step = max(share, 0.0)
                        blocking = i
            for i in range(m):
                if side[i] == FREE:
                    x[i] += step * (solution[i] - x[i])
            if blocking < 0:
                break
            at_low = solution[blocking] < low[blocking]
            side[blocking] = AT_LOW if at_low else AT_HIGH
            x[blocking] = low[blocking] if at_low else high[blocking]
            if blocking == chosen and step == 0.0:
                barred = chosen
    return False

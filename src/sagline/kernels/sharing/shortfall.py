"""By how much no tensions will do: the nearest wrench that is feasible, by bounded least squares.

The tensions within their limits whose wrench comes nearest to the needed one leave a residual. Moments weigh
far more than forces, so what remains is the smallest change of the force that makes the pose feasible.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes
from sagline.kernels.algebra.gram_schmidt import keep, take_out
from sagline.kernels.jit import glue, kernel

MOMENT_WEIGHT = 1e5  # per typical lever arm; the moment's residual is this squared smaller than the force's
STEPS = 200
AT_LOW, AT_HIGH, FREE = 0, 1, 2


@glue
def solve_free(matrix: Array, right: Array, side: Codes, tensions: Array, solution: Array) -> None:
    """Least squares in the free tensions, the others held: fills solution (m,)."""
    n, m = matrix.shape
    frame = np.empty((n + 1, n))
    triangle = np.empty((n + 1, n + 1))
    columns = np.empty(n, dtype=np.int64)
    residual = right.copy()
    count = 0
    for i in range(m):
        solution[i] = tensions[i]
        if side[i] == FREE and count < n:
            for k in range(n):
                frame[count, k] = matrix[k, i]
            keep(frame, count, triangle, take_out(frame, count, triangle))
            columns[count] = i
            count += 1
        else:
            for k in range(n):
                residual[k] -= matrix[k, i] * tensions[i]
    for c in range(count - 1, -1, -1):
        total = 0.0
        for k in range(n):
            total += frame[c, k] * residual[k]
        for b in range(c + 1, count):
            total -= triangle[c, b] * solution[columns[b]]
        solution[columns[c]] = total / triangle[c, c]


@glue
def slopes(matrix: Array, right: Array, tensions: Array, residual: Array, gradient: Array) -> None:
    """Fill the residual right - matrix t (n,) and its components along the columns (m,)."""
    n, m = matrix.shape
    for k in range(n):
        residual[k] = right[k]
        for i in range(m):
            residual[k] -= matrix[k, i] * tensions[i]
    for i in range(m):
        gradient[i] = 0.0
        for k in range(n):
            gradient[i] += matrix[k, i] * residual[k]


@glue
def bounded_least_squares(
    matrix: Array, right: Array, low: Array, high: Array, tensions: Array, residual: Array
) -> bool:
    """Fill the t within its limits that comes nearest to matrix t = right, and the residual; False if it gave up.

    Source:
        Stark & Parker 1995, bounded-variable least squares: an active-set method.
    """
    n, m = matrix.shape
    side = np.zeros(m, dtype=np.int8)
    gradient = np.empty(m)
    solution = np.empty(m)
    tensions[:] = low
    barred = -1  # a cable that would not move when freed: rounding; not to be chosen twice in a row
    scale = 0.0
    for k in range(n):
        scale = max(scale, abs(right[k]))
    for _ in range(STEPS):
        slopes(matrix, right, tensions, residual, gradient)
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
            solve_free(matrix, right, side, tensions, solution)
            step = 1.0
            blocking = -1
            for i in range(m):
                if side[i] == FREE and not low[i] <= solution[i] <= high[i]:
                    limit = low[i] if solution[i] < low[i] else high[i]
                    share = (limit - tensions[i]) / (solution[i] - tensions[i])
                    if share < step:
                        step = max(share, 0.0)
                        blocking = i
            for i in range(m):
                if side[i] == FREE:
                    tensions[i] += step * (solution[i] - tensions[i])
            if blocking < 0:
                break
            at_low = solution[blocking] < low[blocking]
            side[blocking] = AT_LOW if at_low else AT_HIGH
            tensions[blocking] = low[blocking] if at_low else high[blocking]
            if blocking == chosen and step == 0.0:
                barred = chosen
    return False


@kernel
def wrench_shortfall(matrix: Array, needed: Array, low: Array, high: Array, translations: int) -> float:
    """Smallest change of the needed force [N] that limits allow; infinite where no force alone would do."""
    n, m = matrix.shape
    lever = 0.0
    for i in range(m):
        for k in range(translations, n):
            lever = max(lever, abs(matrix[k, i]))
    weight = MOMENT_WEIGHT / lever if lever > 0.0 else 1.0
    scaled = matrix.copy()
    right = needed.copy()
    for k in range(translations, n):
        right[k] *= weight
        for i in range(m):
            scaled[k, i] *= weight
    tensions = np.empty(m)
    residual = np.empty(n)
    if not bounded_least_squares(scaled, right, low, high, tensions, residual):
        return math.nan
    force = 0.0
    moment = 0.0
    for k in range(n):
        if k < translations:
            force += residual[k] * residual[k]
        else:
            moment += residual[k] * residual[k]
    return math.sqrt(force) if moment <= 1e-4 * force else math.inf

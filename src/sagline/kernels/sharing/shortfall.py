"""By how much no tensions will do: the nearest wrench that is feasible, by bounded least squares.

The tensions within their limits whose wrench comes nearest to the needed one leave a residual. Moments weigh
far more than forces, so what remains is the smallest change of the force that makes the pose feasible.
"""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels.algebra.bounded_least_squares import bounded_least_squares
from sagline.kernels.jit import kernel
from sagline.kernels.memory import Memory, block

MOMENT_WEIGHT = 1e5  # per typical lever arm; the moment's residual is this squared smaller than the force's


@kernel
def wrench_shortfall(matrix: Array, needed: Array, low: Array, high: Array, translations: int, memory: Memory) -> float:
    """Smallest change of the needed force [N] that limits allow; infinite where no force alone would do."""
    n, m = matrix.shape
    scaled, at = block(memory.numbers, 0, n, m)
    vectors, at = block(memory.numbers, at, 2, n)
    tensions, at = block(memory.numbers, at, 1, m)
    right, residual = vectors[0], vectors[1]
    lever = 0.0
    for i in range(m):
        for k in range(translations, n):
            lever = max(lever, abs(matrix[k, i]))
    weight = MOMENT_WEIGHT / lever if lever > 0.0 else 1.0
    for k in range(n):
        factor = 1.0 if k < translations else weight
        right[k] = needed[k] * factor
        for i in range(m):
            scaled[k, i] = matrix[k, i] * factor
    rest = Memory(memory.numbers[at:], memory.counters)
    if not bounded_least_squares(scaled, right, low, high, rest, tensions[0], residual):
        return math.nan
    force = 0.0
    moment = 0.0
    for k in range(n):
        if k < translations:
            force += residual[k] * residual[k]
        else:
            moment += residual[k] * residual[k]
    return math.sqrt(force) if moment <= 1e-4 * force else math.inf

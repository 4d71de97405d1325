"""Choosing among feasible tensions: the point of the feasible set nearest to a reference.

docs/model.md, section 5. With an orthonormal null-space basis N, the objective (55) of the article,
closest to given tensions, is the projection of N^T (t_ref - t0) onto the feasible set; the minimum
norm is the projection of 0. No iteration is needed for two redundant cables or fewer.
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.jit import kernel
from sagline.kernels.polygon import TOLERANCE, feasible_polygon, largest_tension, nearest_point


@kernel
def feasible_interval(start: Array, null: Array, low: Array, high: Array) -> tuple[float, float]:
    """Ends of the feasible interval of one redundant cable; the first exceeds the second where it is empty."""
    slack = TOLERANCE * largest_tension(start, low, high)
    first = -math.inf
    last = math.inf
    for i in range(start.shape[0]):
        row = null[i, 0]
        below = low[i] - start[i]
        above = high[i] - start[i]
        if abs(row) < TOLERANCE:
            if below > slack or above < -slack:
                return 1.0, 0.0
        elif row > 0.0:
            first = max(first, below / row)
            last = min(last, above / row)
        else:
            first = max(first, above / row)
            last = min(last, below / row)
    if first > last and first - last <= slack:
        first = last = 0.5 * (first + last)
    return first, last


@kernel
def within_limits(tensions: Array, low: Array, high: Array, slack: float) -> bool:
    """Whether every tension keeps its limits, up to a slack."""
    for i in range(tensions.shape[0]):
        if not low[i] - slack <= tensions[i] <= high[i] + slack:
            return False
    return True


@kernel
def nearest_tensions(
    start: Array,
    null: Array,
    low: Array,
    high: Array,
    reference: Array,
    corners: Array,
    labels: Indices,
    tensions: Array,
) -> bool:
    """Fill the feasible tensions (m,) nearest to a reference (r,) in the null space; False where there are none.

    Args:
        start: Minimum-norm tensions t0, (m,).
        null: Orthonormal null-space basis N, (m, r), r <= 2.
        low: Lower limits, (m,).
        high: Upper limits, (m,); may be infinite.
        reference: lambda_ref = N^T (t_ref - t0), (r,).
        corners: Working space of `feasible_polygon`.
        labels: Working space of `feasible_polygon`.
        tensions: Result.
    """
    m, r = null.shape
    for i in range(m):
        tensions[i] = start[i]
        for k in range(r):
            tensions[i] += null[i, k] * reference[k]
    if within_limits(tensions, low, high, 0.0):
        return True
    if r == 0:
        return within_limits(tensions, low, high, TOLERANCE * largest_tension(start, low, high))
    if r == 1:
        first, last = feasible_interval(start, null, low, high)
        if first > last:
            return False
        share = min(max(reference[0], first), last)
        for i in range(m):
            tensions[i] = start[i] + null[i, 0] * share
        return True
    count = feasible_polygon(start, null, low, high, corners, labels)
    if count == 0:
        return False
    x, y = nearest_point(corners, count, reference[0], reference[1])
    for i in range(m):
        tensions[i] = start[i] + null[i, 0] * x + null[i, 1] * y
    return True

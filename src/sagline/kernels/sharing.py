"""Choosing among feasible tensions: the point of the feasible set nearest to a reference.

docs/model.md, section 5. With an orthonormal null-space basis N, the objective (55) of the article,
closest to given tensions, is the projection of N^T (t_ref - t0) onto the feasible set; the minimum
norm is the projection of 0. No iteration is needed for two redundant cables or fewer.
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.jit import formula, kernel
from sagline.kernels.polygon import TOLERANCE, feasible_polygon, largest_tension, nearest_point
from sagline.kernels.tables import HIGH, LOW, SHARED, START


@kernel
def feasible_interval(work: Array, null: Array) -> tuple[float, float]:
    """Ends of the feasible interval of one redundant cable; the first exceeds the second where it is empty."""
    slack = TOLERANCE * largest_tension(work)
    first = -math.inf
    last = math.inf
    for i in range(work.shape[1]):
        row = null[0, i]
        below = work[LOW, i] - work[START, i]
        above = work[HIGH, i] - work[START, i]
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


@formula
def within_limits(work: Array, slack: float) -> bool:
    """Whether every shared tension keeps its limits, up to a slack."""
    for i in range(work.shape[1]):
        if not work[LOW, i] - slack <= work[SHARED, i] <= work[HIGH, i] + slack:
            return False
    return True


@formula
def share_nearest(work: Array, null: Array, reference: Array, corners: Array, labels: Indices) -> bool:
    """Fill the feasible tensions nearest to a reference in the null space; False where there are none.

    Args:
        work: Rows START (minimum-norm tensions t0), LOW and HIGH (may be infinite); SHARED is filled.
        null: Orthonormal null-space basis, one vector a row, (r, m), r <= 2.
        reference: lambda_ref = N^T (t_ref - t0), (r,).
        corners: Working space of `feasible_polygon`.
        labels: Working space of `feasible_polygon`.
    """
    r, m = null.shape
    for i in range(m):
        work[SHARED, i] = work[START, i]
    for k in range(r):
        for i in range(m):
            work[SHARED, i] += null[k, i] * reference[k]
    if within_limits(work, 0.0):
        return True
    if r == 0:
        return within_limits(work, TOLERANCE * largest_tension(work))
    return share_at_limits(work, null, reference, corners, labels)


@kernel
def share_at_limits(work: Array, null: Array, reference: Array, corners: Array, labels: Indices) -> bool:
    """The same where the reference itself is not feasible: its projection onto the interval or polygon."""
    r, m = null.shape
    if r == 1:
        first, last = feasible_interval(work, null)
        if first > last:
            return False
        share = min(max(reference[0], first), last)
        for i in range(m):
            work[SHARED, i] = work[START, i] + null[0, i] * share
        return True
    count = feasible_polygon(work, null, corners, labels)
    if count == 0:
        return False
    x, y = nearest_point(corners, count, reference[0], reference[1])
    for i in range(m):
        work[SHARED, i] = work[START, i] + null[0, i] * x + null[1, i] * y
    return True

"""The feasible set of one or two redundant cables as an interval or polygon, and tensions of a point in it."""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.jit import formula, kernel
from sagline.kernels.sharing.polygon import (
    TOLERANCE,
    box_radius,
    feasible_polygon,
    largest_tension,
)
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


@kernel
def feasible_corners(work: Array, null: Array, corners: Array, labels: Indices) -> int:
    """Corners of the feasible polygon, or for r = 1 the two ends of the interval on the first axis; 0 if empty.

    An end at infinity is as far out as the polygon's box, and labeled as such.
    """
    if null.shape[0] == 2:
        return feasible_polygon(work, null, corners, labels)
    first, last = feasible_interval(work, null)
    if first > last:
        return 0
    radius = box_radius(largest_tension(work), work)
    corners[0, 0] = max(first, -radius)
    corners[1, 0] = min(last, radius)
    corners[0, 1] = corners[1, 1] = 0.0
    labels[0] = 0 if first > -math.inf else 2 * work.shape[1]
    labels[1] = 0 if last < math.inf else 2 * work.shape[1]
    return 2


@formula
def within_limits(work: Array, slack: float) -> bool:
    """Whether every shared tension keeps its limits, up to a slack."""
    for i in range(work.shape[1]):
        if not work[LOW, i] - slack <= work[SHARED, i] <= work[HIGH, i] + slack:
            return False
    return True


@kernel
def set_point(work: Array, null: Array, point: Array) -> None:
    """Fill the shared tensions of a point in the null space."""
    for i in range(work.shape[1]):
        work[SHARED, i] = work[START, i]
    for k in range(point.size):
        for i in range(work.shape[1]):
            work[SHARED, i] += null[k, i] * point[k]

"""Limits as bounds: the points x (d,) of which START + x . rows stays between LOW and HIGH, bound by bound.

rows is (d, k), a column a bound; bounds is (3, k), and HIGH may be infinite. One side of a bound is named by a label:
2i the lower side of bound i, 2i + 1 the upper one. As a half-plane its normal points inward.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

START, LOW, HIGH = 0, 1, 2
STRIP_ROWS = 3

TOLERANCE = 1e-12  # of the largest number at hand: a side missed by less counts as kept


@formula
def largest_bound(bounds: Array) -> float:
    """The largest finite number at hand, by which tolerances are measured."""
    start = low = high = 0.0  # three, so that none waits for the others
    for i in range(bounds.shape[1]):
        start = max(start, abs(bounds[START, i]))
        low = max(low, abs(bounds[LOW, i]) if abs(bounds[LOW, i]) < math.inf else 0.0)
        high = max(high, abs(bounds[HIGH, i]) if bounds[HIGH, i] < math.inf else 0.0)
    return max(start, low, high)


@kernel
def box_radius(largest: float, bounds: Array) -> float:
    """Radius that holds all that the bounds have in common where they have two sides, else the near part of it."""
    for i in range(bounds.shape[1]):
        if bounds[HIGH, i] == math.inf:
            return 1e4 * largest
    return 2.0 * bounds.shape[1] * largest


@formula
def inward(label: int) -> float:
    """Sign by which a bound's column becomes the inward normal of one of its sides."""
    return 1.0 if label % 2 == 0 else -1.0


@formula
def side_of(bounds: Array, label: int) -> float:
    """The number that normal . x must reach."""
    i = label // 2
    return bounds[LOW, i] - bounds[START, i] if label % 2 == 0 else bounds[START, i] - bounds[HIGH, i]


@formula
def most_violated_bound(rows: Array, bounds: Array, point: Array, slack: float, first: bool) -> int:
    """Label of the side that a point misses most, by more than a slack (or the first one missed); -1 for none."""
    d, k = rows.shape
    worst = slack
    label = -1
    for i in range(k):
        value = bounds[START, i]
        for j in range(d):
            value += rows[j, i] * point[j]
        below = bounds[LOW, i] - value
        above = value - bounds[HIGH, i]
        if max(below, above) > worst and not (first and label >= 0):
            worst = max(below, above)
            label = 2 * i if below > above else 2 * i + 1
    return label

"""Bounds: a point x (d,) satisfies a bound if START + x . row lies between LOW and HIGH.

The array rows (d, k) has one column per bound. The array bounds (3, k) has the rows START, LOW and HIGH; HIGH may be
infinite. A label names one side of a bound: 2i is the lower side of bound i, and 2i + 1 is its upper side. The normal
of a side points inward.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

START, LOW, HIGH = 0, 1, 2
STRIP_ROWS = 3

TOLERANCE = 1e-12  # relative to the largest bound; a smaller violation of a bound is ignored


@formula
def largest_bound(bounds: Array) -> float:
    """Largest finite number in `bounds`, to which tolerances are relative."""
    start = low = high = 0.0  # three independent maxima, which the processor computes in parallel
    for i in range(bounds.shape[1]):
        start = max(start, abs(bounds[START, i]))
        low = max(low, abs(bounds[LOW, i]) if abs(bounds[LOW, i]) < math.inf else 0.0)
        high = max(high, abs(bounds[HIGH, i]) if bounds[HIGH, i] < math.inf else 0.0)
    return max(start, low, high)


@kernel
def box_radius(largest: float, bounds: Array) -> float:
    """Half width of a box that contains all points within two-sided bounds. For one-sided bounds: a large number."""
    for i in range(bounds.shape[1]):
        if bounds[HIGH, i] == math.inf:
            return 1e4 * largest
    return 2.0 * bounds.shape[1] * largest


@formula
def inward(label: int) -> float:
    """Factor (1 or -1) that converts the column of a bound to the inward normal of the side `label`."""
    return 1.0 if label % 2 == 0 else -1.0


@formula
def side_of(bounds: Array, label: int) -> float:
    """Lower limit that the side `label` sets to the product normal . x."""
    i = label // 2
    return bounds[LOW, i] - bounds[START, i] if label % 2 == 0 else bounds[START, i] - bounds[HIGH, i]


@formula
def most_violated_bound(rows: Array, bounds: Array, point: Array, slack: float, first: bool) -> int:
    """Label of the most violated side, or of the first violated side if `first`. -1 if no violation exceeds `slack`."""
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

"""Limits as strips: the points x (d,) of which START + x . rows stays between LOW and HIGH, strip by strip.

rows is (d, k), a column a strip; strips is (3, k), and HIGH may be infinite. One side of a strip is named by a label:
2i the lower side of strip i, 2i + 1 the upper one. As a half-plane its normal points inward.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

START, LOW, HIGH = 0, 1, 2
STRIP_ROWS = 3

TOLERANCE = 1e-12  # of the largest number at hand: a side missed by less counts as kept


@formula
def largest_number(strips: Array) -> float:
    """The largest finite number at hand, by which tolerances are measured."""
    start = low = high = 0.0  # three, so that none waits for the others
    for i in range(strips.shape[1]):
        start = max(start, abs(strips[START, i]))
        low = max(low, abs(strips[LOW, i]) if abs(strips[LOW, i]) < math.inf else 0.0)
        high = max(high, abs(strips[HIGH, i]) if strips[HIGH, i] < math.inf else 0.0)
    return max(start, low, high)


@kernel
def box_radius(largest: float, strips: Array) -> float:
    """Radius that holds all that the strips have in common where they have two sides, else the near part of it."""
    for i in range(strips.shape[1]):
        if strips[HIGH, i] == math.inf:
            return 1e4 * largest
    return 2.0 * strips.shape[1] * largest


@formula
def inward(label: int) -> float:
    """Sign by which a strip's column becomes the inward normal of one of its sides."""
    return 1.0 if label % 2 == 0 else -1.0


@formula
def side_of(strips: Array, label: int) -> float:
    """The number that normal . x must reach."""
    i = label // 2
    return strips[LOW, i] - strips[START, i] if label % 2 == 0 else strips[START, i] - strips[HIGH, i]


@formula
def most_missed(rows: Array, strips: Array, point: Array, slack: float, first: bool) -> int:
    """Label of the side that a point misses most, by more than a slack (or the first one missed); -1 for none."""
    d, k = rows.shape
    worst = slack
    label = -1
    for i in range(k):
        value = strips[START, i]
        for j in range(d):
            value += rows[j, i] * point[j]
        below = strips[LOW, i] - value
        above = value - strips[HIGH, i]
        if max(below, above) > worst and not (first and label >= 0):
            worst = max(below, above)
            label = 2 * i if below > above else 2 * i + 1
    return label

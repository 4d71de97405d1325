"""The polygon of feasible tensions in the null space of two redundant cables; docs/model.md, section 5.

Cable i allows low_i <= t0_i + N_i . lambda <= high_i: two half-planes. A polygon is kept as its corners,
counter-clockwise, each with the label of the side that leaves it: 2i for the lower limit of cable i,
2i + 1 for its upper limit, and from 2m on for the sides of the box that stands in for infinity.
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.jit import formula, kernel
from sagline.kernels.tables import HIGH, LOW, START

TOLERANCE = 1e-12  # of the largest tension at hand: a limit passed by less counts as met
FLAT = 1e-12  # a null-space row shorter than this does not move the cable's tension
SPARE_CORNERS = 6  # beyond two a cable: the box and the corner in the making


@kernel
def largest_tension(work: Array) -> float:
    """The largest finite number at hand [N], by which tolerances are measured."""
    largest = 0.0
    for i in range(work.shape[1]):
        largest = max(largest, abs(work[START, i]), abs(work[LOW, i]))
        if work[HIGH, i] < math.inf:
            largest = max(largest, abs(work[HIGH, i]))
    return largest


@kernel
def box_radius(largest: float, work: Array) -> float:
    """Radius [N] that holds the whole polygon where limits are finite, and the near part of it elsewhere."""
    for i in range(work.shape[1]):
        if work[HIGH, i] == math.inf:
            return 1e4 * largest
    return 2.0 * work.shape[1] * largest


@kernel
def cut(
    corners: Array, labels: Indices, count: int, gx: float, gy: float, offset: float, label: int, slack: float
) -> int:
    """Keep the part of the polygon where gx x + gy y + offset >= 0; returns the number of corners left.

    Works in place. A half-plane cuts a convex polygon at most twice, where it enters and where it leaves.
    """
    leaving = -1  # last corner inside before the first outside
    entering = -1  # first corner inside after the last outside
    inside_count = 0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        here = gx * corners[k, 0] + gy * corners[k, 1] + offset >= -slack
        there = gx * corners[following, 0] + gy * corners[following, 1] + offset >= -slack
        if here:
            inside_count += 1
        if here and not there:
            leaving = k
        if there and not here:
            entering = following
    if inside_count == count or inside_count == 0:
        return inside_count
    # the new side runs from the leaving crossing to the entering one
    after = leaving + 1 if leaving + 1 < count else 0
    before = entering - 1 if entering > 0 else count - 1
    d0 = gx * corners[leaving, 0] + gy * corners[leaving, 1] + offset
    d1 = gx * corners[after, 0] + gy * corners[after, 1] + offset
    share = min(max(d0 / (d0 - d1), 0.0), 1.0)
    ax = corners[leaving, 0] + share * (corners[after, 0] - corners[leaving, 0])
    ay = corners[leaving, 1] + share * (corners[after, 1] - corners[leaving, 1])
    d0 = gx * corners[entering, 0] + gy * corners[entering, 1] + offset
    d1 = gx * corners[before, 0] + gy * corners[before, 1] + offset
    share = min(max(d0 / (d0 - d1), 0.0), 1.0)
    bx = corners[entering, 0] + share * (corners[before, 0] - corners[entering, 0])
    by = corners[entering, 1] + share * (corners[before, 1] - corners[entering, 1])
    return splice(corners, labels, count, leaving, entering, inside_count, ax, ay, bx, by, label)


@kernel
def splice(
    corners: Array,
    labels: Indices,
    count: int,
    leaving: int,
    entering: int,
    kept: int,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    label: int,
) -> int:
    """Replace the corners outside by the two ends a, b of a new side; returns the new number of corners."""
    entering_label = labels[entering - 1 if entering > 0 else count - 1]
    if leaving < entering:  # the corners outside lie between the two: close or open the gap
        gap = entering - leaving - 1
        if gap == 1:
            for k in range(count, entering, -1):
                corners[k, 0], corners[k, 1], labels[k] = corners[k - 1, 0], corners[k - 1, 1], labels[k - 1]
        else:
            for k in range(entering, count):
                corners[k - gap + 2, 0] = corners[k, 0]
                corners[k - gap + 2, 1] = corners[k, 1]
                labels[k - gap + 2] = labels[k]
        place = leaving + 1
    else:  # the corners inside lie between the two: move them to the front
        for k in range(kept):
            corners[k, 0], corners[k, 1], labels[k] = (
                corners[entering + k, 0],
                corners[entering + k, 1],
                labels[entering + k],
            )
        place = kept
    corners[place, 0], corners[place, 1], labels[place] = ax, ay, label
    corners[place + 1, 0], corners[place + 1, 1], labels[place + 1] = bx, by, entering_label
    return kept + 2


@kernel
def feasible_polygon(work: Array, null: Array, corners: Array, labels: Indices) -> int:
    """Fill the corners (2m + SPARE_CORNERS, 2) and side labels of the feasible polygon; returns how many, 0 if empty.

    work: rows START (minimum-norm tensions t0), LOW and HIGH; null: orthonormal basis, one vector a row, (2, m).
    """
    m = work.shape[1]
    largest = largest_tension(work)
    radius = box_radius(largest, work)
    slack = TOLERANCE * largest
    for k in range(4):
        corners[k, 0] = radius if k == 0 or k == 3 else -radius
        corners[k, 1] = radius if k < 2 else -radius
        labels[k] = 2 * m + k
    count = 4
    for i in range(m):
        gx = null[0, i]
        gy = null[1, i]
        above = work[START, i] - work[LOW, i]
        below = work[HIGH, i] - work[START, i]
        if abs(gx) + abs(gy) < FLAT:
            if above < -slack or below < -slack:
                return 0
            continue
        count = cut(corners, labels, count, gx, gy, above, 2 * i, slack)
        if count > 0 and below < math.inf:
            count = cut(corners, labels, count, -gx, -gy, below, 2 * i + 1, slack)
        if count == 0:
            return 0
    return count


@formula
def nearest_on_side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> tuple[float, float]:
    """The point of the side from a to b that is nearest to a given one."""
    ex = bx - ax
    ey = by - ay
    square = ex * ex + ey * ey
    share = 0.0
    if square > 0.0:
        share = min(max(((x - ax) * ex + (y - ay) * ey) / square, 0.0), 1.0)
    return ax + share * ex, ay + share * ey


@kernel
def nearest_point(corners: Array, count: int, x: float, y: float) -> tuple[float, float]:
    """Projection of a point outside a convex polygon onto it."""
    best = math.inf
    best_x = x
    best_y = y
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        px, py = nearest_on_side(corners[k, 0], corners[k, 1], corners[following, 0], corners[following, 1], x, y)
        distance = (px - x) * (px - x) + (py - y) * (py - y)
        if distance < best:
            best = distance
            best_x = px
            best_y = py
    return best_x, best_y

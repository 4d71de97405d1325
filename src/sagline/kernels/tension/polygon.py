"""The polygon of feasible tensions in the null space of two redundant cables; docs/model.md, section 5.

The limits of cable i are the bound low_i <= t0_i + N_i . lambda <= high_i. A polygon is stored as its corners,
counter-clockwise. Each corner has the label of the side that starts at it. The label is 2i for the lower limit of cable
i and 2i + 1 for its upper limit. The sides of the box that replaces infinity have labels from 2m on.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes
from sagline.kernels.algebra.bounds import HIGH, LOW, START, TOLERANCE, box_radius, inward, largest_bound, side_of
from sagline.kernels.algebra.programs import Basis, new_basis
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters

FLAT = 1e-12  # a cable whose null-space row is shorter has a constant tension
SPARE_CORNERS = 6  # corners in addition to two per cable: corners of the box, and the corner to insert


@glue
def _cut_polygon(
    corners: Array, labels: Indices, count: int, x: float, y: float, side: float, label: int, slack: float
) -> int:
    """Keep the part of the polygon where (x, y) . corner >= `side`. Returns the number of remaining corners."""
    # The corners change in place. The border of a half-plane crosses the border of a convex polygon at most twice.
    leaving = -1  # last corner inside the half-plane, before the first corner outside
    entering = -1  # first corner inside the half-plane, after the last corner outside
    kept = 0
    before = x * corners[count - 1, 0] + y * corners[count - 1, 1] - side >= -slack
    for k in range(count):
        here = x * corners[k, 0] + y * corners[k, 1] - side >= -slack
        kept += 1 if here else 0
        if before and not here:
            leaving = k - 1 if k > 0 else count - 1
        if here and not before:
            entering = k
        before = here
    if kept == count or kept == 0:
        return kept
    # the new side connects the point where the polygon leaves the half-plane with the point where it enters
    ax, ay = _crossing(corners, leaving, leaving + 1 if leaving + 1 < count else 0, x, y, side)
    bx, by = _crossing(corners, entering, entering - 1 if entering > 0 else count - 1, x, y, side)
    last_label = labels[entering - 1 if entering > 0 else count - 1]
    place = _shift_corners(corners, labels, count, leaving, entering, kept)
    corners[place, 0], corners[place, 1], labels[place] = ax, ay, label
    corners[place + 1, 0], corners[place + 1, 1], labels[place + 1] = bx, by, last_label
    return kept + 2


@formula
def _crossing(corners: Array, inside: int, outside: int, x: float, y: float, side: float) -> tuple[float, float]:
    """Intersection of the line (x, y) . corner = `side` with the edge between the corners `inside` and `outside`."""
    px, py = corners[inside, 0], corners[inside, 1]
    qx, qy = corners[outside, 0], corners[outside, 1]
    depth = x * px + y * py - side
    share = min(max(depth / (depth - (x * qx + y * qy - side)), 0.0), 1.0)
    return px + share * (qx - px), py + share * (qy - py)


@kernel
def _shift_corners(corners: Array, labels: Indices, count: int, leaving: int, entering: int, kept: int) -> int:
    """Remove the corners outside the half-plane, and make space for the ends of a new side. Returns its first index."""
    if leaving >= entering:  # the corners inside lie between the two ends: move them to the front
        for k in range(kept):
            corners[k, 0], corners[k, 1] = corners[entering + k, 0], corners[entering + k, 1]
            labels[k] = labels[entering + k]
        return kept
    gap = entering - leaving - 1  # the corners outside lie between the two ends: close or open the gap
    if gap == 1:
        for k in range(count, entering, -1):
            corners[k, 0], corners[k, 1], labels[k] = corners[k - 1, 0], corners[k - 1, 1], labels[k - 1]
    else:
        for k in range(entering, count):
            corners[k - gap + 2, 0], corners[k - gap + 2, 1] = corners[k, 0], corners[k, 1]
            labels[k - gap + 2] = labels[k]
    return leaving + 1


@glue
def _widest_pair(null: Array) -> tuple[int, int, float]:
    """Two cables whose rows span a large parallelogram, and the signed area of the parallelogram."""
    # The first cable has the longest row. The second cable gives the largest area together with the first cable.
    m = null.shape[1]
    first = second = 0
    longest = 0.0
    for i in range(m):
        square = null[0, i] * null[0, i] + null[1, i] * null[1, i]
        if square > longest:
            longest, first = square, i
    area = 0.0
    for i in range(m):
        cross = null[0, first] * null[1, i] - null[1, first] * null[0, i]
        if abs(cross) > abs(area):
            area, second = cross, i
    return first, second, area


@glue
def _start_polygon(bounds: Array, null: Array, radius: float, corners: Array, labels: Indices) -> tuple[int, int]:
    """Fill the four corners of the intersection of two bounds. A box replaces an infinite limit."""
    # Returns the two bounds.
    m = null.shape[1]
    a, b, area = _widest_pair(null)
    for k in range(4):
        # the order is counter-clockwise if the area is positive; each corner is at one limit of a and one limit of b
        u = 2 * a + (0 if k == 0 or k == 3 else 1)
        v = 2 * b + (0 if k < 2 else 1)
        here = inward(u) * side_of(bounds, u) if bounds[HIGH, a] < math.inf or u == 2 * a else radius
        there = inward(v) * side_of(bounds, v) if bounds[HIGH, b] < math.inf or v == 2 * b else radius
        place = k if area > 0.0 else 3 - k
        corners[place, 0] = (here * null[1, b] - there * null[1, a]) / area
        corners[place, 1] = (there * null[0, a] - here * null[0, b]) / area
    for k in range(4):
        # order of the sides: low b, high a, high b, low a if counter-clockwise, otherwise reversed
        if area > 0.0:
            label = 2 * b if k == 0 else 2 * a + 1 if k == 1 else 2 * b + 1 if k == 2 else 2 * a
        else:
            label = 2 * b + 1 if k == 0 else 2 * a + 1 if k == 1 else 2 * b if k == 2 else 2 * a
        labels[k] = label if bounds[HIGH, label // 2] < math.inf or label % 2 == 0 else 2 * m + k
    return a, b


@kernel
def feasible_polygon(bounds: Array, null: Array, corners: Array, labels: Indices) -> int:
    """Fill corners (2m + SPARE_CORNERS, 2) and side labels of the feasible polygon. Returns the number of corners."""
    # `bounds`: minimum-norm tensions and limits (3, m). `null`: orthonormal basis, one vector per row, (2, m).
    m = null.shape[1]
    largest = largest_bound(bounds)
    slack = TOLERANCE * largest
    a, b = _start_polygon(bounds, null, box_radius(largest, bounds), corners, labels)
    count = 4
    for i in range(m):
        x, y = null[0, i], null[1, i]
        least = most = x * corners[0, 0] + y * corners[0, 1]
        for k in range(1, count):
            here = x * corners[k, 0] + y * corners[k, 1]
            least, most = min(least, here), max(most, here)
        below, above = bounds[LOW, i] - bounds[START, i], bounds[HIGH, i] - bounds[START, i]
        if least > above + slack or most < below - slack or below > above + slack:
            return 0
        # the initial polygon already satisfies this limit, except for rounding
        if abs(x) + abs(y) < FLAT or i == a or i == b:
            continue
        for upper in range(2):
            if least < below - slack if upper == 0 else most > above + slack:
                sign = inward(upper)
                label = 2 * i + upper
                count = _cut_polygon(corners, labels, count, sign * x, sign * y, side_of(bounds, label), label, slack)
                if count == 0:
                    return 0
    return count


@kernel
def polygon_again(bounds: Array, null: Array, corners: Array, labels: Indices, count: int) -> bool:
    """Fill the corners of the feasible polygon from its known sides. False if the polygon has other sides."""
    # The known sides are correct if they have the same order around the new polygon, and if no limit excludes a corner.
    m = null.shape[1]
    slack = TOLERANCE * largest_bound(bounds)
    for k in range(count):
        if labels[k] >= 2 * m:
            return False
    for k in range(count):
        u, v = labels[k - 1 if k > 0 else count - 1], labels[k]
        ux, uy = inward(u) * null[0, u // 2], inward(u) * null[1, u // 2]
        vx, vy = inward(v) * null[0, v // 2], inward(v) * null[1, v // 2]
        cross = ux * vy - uy * vx
        if not cross > FLAT:
            return False
        here, there = side_of(bounds, u), side_of(bounds, v)
        corners[k, 0] = (here * vy - there * uy) / cross
        corners[k, 1] = (there * ux - here * vx) / cross
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        label = labels[k]
        x, y = inward(label) * null[0, label // 2], inward(label) * null[1, label // 2]
        # the inside is to the left of the walk; the direction of the walk is the inward normal turned to the right
        way = y * (corners[following, 0] - corners[k, 0]) - x * (corners[following, 1] - corners[k, 1])
        if not way > 0.0:
            return False
    for i in range(m):
        below, above = bounds[LOW, i] - bounds[START, i], bounds[HIGH, i] - bounds[START, i]
        for k in range(count):
            here = null[0, i] * corners[k, 0] + null[1, i] * corners[k, 1]
            if here < below - slack or here > above + slack:
                return False
    return True


@formula
def nearest_on_side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> tuple[float, float]:
    """Point on the side between the corners a and b that is nearest to (x, y)."""
    ex = bx - ax
    ey = by - ay
    square = ex * ex + ey * ey
    share = 0.0
    if square > 0.0:
        share = min(max(((x - ax) * ex + (y - ay) * ey) / square, 0.0), 1.0)
    return ax + share * ex, ay + share * ey


@kernel
def nearest_corner_point(corners: Array, count: int, x: float, y: float) -> tuple[float, float]:
    """Nearest point of a convex polygon to the point (x, y) outside it."""
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


class WorkArrays(NamedTuple):
    """Work arrays that keep their content from one iteration to the next."""

    corners: Array  # corners of the feasible polygon, (2m + SPARE_CORNERS, 2)
    labels: Indices  # labels of its sides, (2m + SPARE_CORNERS,)
    known: Indices  # number of corners of the last polygon, (1,); 0 without a polygon
    basis: Basis  # basis of the linear program of the last iteration
    rest: Memory  # memory that does not keep its content


@glue
def new_work_arrays(method: int, memory: Memory, m: int, r: int) -> WorkArrays:
    """Work arrays for `m` cables and `r` redundant cables."""
    corner_count = 2 * m + SPARE_CORNERS
    corners, memory = block(memory, corner_count, 2)
    known, memory = counters(memory, 1)
    labels, memory = counters(memory, corner_count)
    basis, memory = new_basis(memory, r if method == codes.LOWEST_SUM else r + 1)
    return WorkArrays(corners, labels, known, basis, memory)


@glue
def reset_work_arrays(work: WorkArrays) -> None:
    """Discard the results of the previous pose."""
    work.known[0] = 0
    work.basis.labels[0] = -1

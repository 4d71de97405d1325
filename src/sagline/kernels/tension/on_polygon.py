"""Methods on the corners of the feasible polygon or interval: its centroid, and the polygon walk."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import HIGH, LOW, START, TOLERANCE, box_radius, largest_bound, most_violated_bound
from sagline.kernels.codes import (
    POLYGON_WALK,
    POSE_INFEASIBLE,
    POSE_NOT_CONVERGED,
    POSE_SOLVED,
    POSE_UNBOUNDED,
)
from sagline.kernels.jit import kernel
from sagline.kernels.tension.nearest import ReferencePoint
from sagline.kernels.tension.polygon import feasible_polygon, nearest_corner_point, nearest_on_side, polygon_again
from sagline.kernels.tension.walk import walk_polygon
from sagline.kernels.tension.work_arrays import WorkArrays

TIED = 1e-10  # of the largest tension: sums that differ by less are the same
WALK_SUM, WALK_NORM, WALK_CENTROID = 0.0, 1.0, 2.0  # the optimum of the polygon walk


@kernel
def distribute_on_polygon(
    method: int, parameter: float, bounds: Array, null: Array, near: ReferencePoint, room: WorkArrays
) -> int:
    """Fill the point (r,) of near by the centroid or the polygon walk; the last edges are tried first."""
    r, m = null.shape
    corners, labels, known = room.corners, room.labels, room.known
    count = known[0]
    if count == 0 or not polygon_again(bounds, null, corners, labels, count):
        if method == POLYGON_WALK and r == 2:
            count = walk_polygon(bounds, null, room.rest, corners, labels)
        else:
            count = feasible_corners(bounds, null, corners, labels)
    known[0] = count if r == 2 else 0
    if count <= 0:
        return POSE_INFEASIBLE if count == 0 else POSE_NOT_CONVERGED
    reference = near.reference
    x = reference[0]
    y = reference[1] if r == 2 else 0.0
    if method == POLYGON_WALK and parameter == WALK_SUM:
        x, y = lowest_corner(bounds, null, corners, count, x, y)
    elif method == POLYGON_WALK and parameter == WALK_NORM:
        if most_violated_bound(null, bounds, reference, 0.0, True) >= 0:
            x, y = nearest_corner_point(corners, count, x, y)
    else:
        for k in range(count):
            if labels[k] >= 2 * m:
                return POSE_UNBOUNDED
        x, y = centroid(corners, count)
    near.point[0] = x
    if r == 2:
        near.point[1] = y
    return POSE_SOLVED


@kernel
def feasible_interval(bounds: Array, null: Array) -> tuple[float, float]:
    """Ends of the feasible interval of one redundant cable; the first exceeds the second where it is empty."""
    slack = TOLERANCE * largest_bound(bounds)
    first = -math.inf
    last = math.inf
    for i in range(bounds.shape[1]):
        row = null[0, i]
        below = bounds[LOW, i] - bounds[START, i]
        above = bounds[HIGH, i] - bounds[START, i]
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
def feasible_corners(bounds: Array, null: Array, corners: Array, labels: Indices) -> int:
    """Corners of the feasible polygon, or for r = 1 the two ends of the interval on the first axis; 0 if empty.

    An end at infinity is as far out as the polygon's box, and labeled as such.
    """
    if null.shape[0] == 2:
        return feasible_polygon(bounds, null, corners, labels)
    first, last = feasible_interval(bounds, null)
    if first > last:
        return 0
    radius = box_radius(largest_bound(bounds), bounds)
    corners[0, 0] = max(first, -radius)
    corners[1, 0] = min(last, radius)
    corners[0, 1] = corners[1, 1] = 0.0
    labels[0] = 0 if first > -math.inf else 2 * bounds.shape[1]
    labels[1] = 0 if last < math.inf else 2 * bounds.shape[1]
    return 2


@kernel
def centroid(corners: Array, count: int) -> tuple[float, float]:
    """Centroid of a convex polygon; the middle of its corners where it has no area."""
    x0 = corners[0, 0]
    y0 = corners[0, 1]
    area = 0.0
    x = 0.0
    y = 0.0
    size = 0.0
    for k in range(1, count - 1):
        ax = corners[k, 0] - x0
        ay = corners[k, 1] - y0
        bx = corners[k + 1, 0] - x0
        by = corners[k + 1, 1] - y0
        cross = ax * by - ay * bx
        area += cross
        x += cross * (ax + bx)
        y += cross * (ay + by)
        size = max(size, ax * ax + ay * ay, bx * bx + by * by)
    if area > 1e-12 * size:
        return x0 + x / (3.0 * area), y0 + y / (3.0 * area)
    x = 0.0
    y = 0.0
    for k in range(count):
        x += corners[k, 0] / count
        y += corners[k, 1] / count
    return x, y


@kernel
def lowest_corner(
    bounds: Array, null: Array, corners: Array, count: int, goal_x: float, goal_y: float
) -> tuple[float, float]:
    """The point of least sum of tensions: a corner, or of a tied side the point nearest to a goal."""
    r, m = null.shape
    gx = 0.0
    gy = 0.0
    for i in range(m):
        gx += null[0, i]
        gy += null[1, i] if r == 2 else 0.0
    least = math.inf
    for k in range(count):
        least = min(least, gx * corners[k, 0] + gy * corners[k, 1])
    tie = least + TIED * largest_bound(bounds)
    best = math.inf
    best_x = best_y = 0.0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        if gx * corners[k, 0] + gy * corners[k, 1] <= tie:
            x, y = corners[k, 0], corners[k, 1]
            if gx * corners[following, 0] + gy * corners[following, 1] <= tie:
                x, y = nearest_on_side(x, y, corners[following, 0], corners[following, 1], goal_x, goal_y)
            distance = (x - goal_x) * (x - goal_x) + (y - goal_y) * (y - goal_y)
            if distance < best:
                best = distance
                best_x, best_y = x, y
    return best_x, best_y

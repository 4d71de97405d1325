"""Methods on the corners of the feasible polygon or interval: its centroid, and the polygon walk.

The limits of two cables form a parallelogram. The walk starts at a corner of this parallelogram and follows the border
of the included limits. When the walk meets the line of a violated limit, it continues along this line and includes the
limit. After a full turn without violated limits, the walk has visited all corners. If a limit is still violated after a
full turn, the polygon is empty.

Source:
    Gouttefarde, Lamaury, Reichert & Bruckmann 2015, "A versatile tension distribution algorithm for n-DOF parallel
    robots driven by n + 2 cables".
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes
from sagline.kernels.algebra.bounds import HIGH, LOW, START, TOLERANCE, box_radius, largest_bound, most_violated_bound
from sagline.kernels.jit import kernel
from sagline.kernels.memory import Memory, block, counters
from sagline.kernels.tension import polygon
from sagline.kernels.tension.nearest import ReferencePoint

PARALLEL = 1e-12


@kernel
def _limit_lines(bounds: Array, null: Array, lines: Array) -> None:
    """Fill rows (gx, gy, offset), (2m, 3). Rows 2i and 2i + 1 are the limits gx x + gy y + offset >= 0 of cable i."""
    for i in range(null.shape[1]):
        lines[2 * i, 0] = null[0, i]
        lines[2 * i, 1] = null[1, i]
        lines[2 * i, 2] = bounds[START, i] - bounds[LOW, i]
        lines[2 * i + 1, 0] = -null[0, i]
        lines[2 * i + 1, 1] = -null[1, i]
        lines[2 * i + 1, 2] = bounds[HIGH, i] - bounds[START, i]


@kernel
def _most_independent(null: Array) -> tuple[int, int]:
    """The two cables whose null-space rows span the largest parallelogram."""
    m = null.shape[1]
    best = 0.0
    a = 0
    b = 1
    for i in range(m):
        for j in range(i + 1, m):
            cross = abs(null[0, i] * null[1, j] - null[1, i] * null[0, j])
            if cross > best:
                best, a, b = cross, i, j
    return a, b


@kernel
def _walk_polygon(bounds: Array, null: Array, memory: Memory, corners: Array, labels: Indices) -> int:
    """Fill corners, counter-clockwise, and labels as in `feasible_polygon`. Returns the number of corners."""
    # The number is 0 if the polygon is empty, and -1 if the walk failed. All limits must be finite.
    m = null.shape[1]
    slack = TOLERANCE * largest_bound(bounds)
    lines, memory = block(memory, 2 * m, 3)
    _limit_lines(bounds, null, lines)
    met, memory = counters(memory, 2 * m)  # entry 1: the walk includes this limit
    a, b = _most_independent(null)
    line = 2 * a
    # start: the corner at which line a begins; the line runs counter-clockwise, with the inside on its left
    other = 2 * b
    cross = lines[line, 0] * lines[other, 1] - lines[line, 1] * lines[other, 0]
    if cross > 0.0:
        other += 1
        cross = -cross
    x = (-lines[line, 2] * lines[other, 1] + lines[other, 2] * lines[line, 1]) / cross
    y = (-lines[other, 2] * lines[line, 0] + lines[line, 2] * lines[other, 0]) / cross
    for k in range(2 * m):
        met[k] = 1 if lines[k, 0] * x + lines[k, 1] * y + lines[k, 2] >= -slack else 0
        if abs(lines[k, 0]) + abs(lines[k, 1]) < PARALLEL and lines[k, 2] < -slack:
            return 0
    for k in range(2):
        met[2 * a + k] = met[2 * b + k] = 1
    first_line = line
    count = 0
    for _ in range(16 * m * m):
        corners[count, 0], corners[count, 1], labels[count] = x, y, line
        count += 1
        way_x = lines[line, 1]  # the inside is to the left of the walk
        way_y = -lines[line, 0]
        nearest = math.inf
        turn = -1
        for k in range(2 * m):
            speed = lines[k, 0] * way_x + lines[k, 1] * way_y
            if k // 2 != line // 2 and abs(speed) > PARALLEL:
                distance = -(lines[k, 0] * x + lines[k, 1] * y + lines[k, 2]) / speed
                if met[k] == 1 and speed < 0.0 and max(distance, 0.0) < nearest:
                    nearest, turn = max(distance, 0.0), k
                elif met[k] == 0 and speed > 0.0 and distance <= nearest and distance > 0.0:
                    nearest, turn = distance, k
        if turn < 0:
            return -1
        x += nearest * way_x
        y += nearest * way_y
        if met[turn] == 1:
            line = turn
            if line == first_line:
                for k in range(2 * m):
                    if met[k] == 0:
                        return 0
                return count
            if count + 1 >= corners.shape[0]:
                return -1
        else:
            for k in range(2 * m):
                if lines[k, 0] * x + lines[k, 1] * y + lines[k, 2] >= -slack:
                    met[k] = 1
            met[turn] = 1
            # the walk leaves this border here; a full turn will end with it, as the last side
            first_line = line
            count = 0
    return -1


TIED = 1e-10  # sums that differ by less, relative to the largest tension, count as equal


@kernel
def distribute_on_polygon(
    method: int, parameter: float, bounds: Array, null: Array, near: ReferencePoint, work: polygon.WorkArrays
) -> int:
    """Fill the point (r,) of `near` by centroid or polygon walk. First, the sides of the last polygon are tried."""
    r, m = null.shape
    corners, labels, known = work.corners, work.labels, work.known
    count = known[0]
    if count == 0 or not polygon.polygon_again(bounds, null, corners, labels, count):
        if method == codes.POLYGON_WALK and r == 2:
            count = _walk_polygon(bounds, null, work.rest, corners, labels)
        else:
            count = feasible_corners(bounds, null, corners, labels)
    known[0] = count if r == 2 else 0
    if count <= 0:
        return codes.POSE_INFEASIBLE if count == 0 else codes.POSE_NOT_CONVERGED
    reference = near.reference
    x = reference[0]
    y = reference[1] if r == 2 else 0.0
    if method == codes.POLYGON_WALK and parameter == codes.WALK_SUM:
        x, y = _lowest_corner(bounds, null, corners, count, x, y)
    elif method == codes.POLYGON_WALK and parameter == codes.WALK_NORM:
        if most_violated_bound(null, bounds, reference, 0.0, True) >= 0:
            x, y = polygon.nearest_corner_point(corners, count, x, y)
    else:
        for k in range(count):
            if labels[k] >= 2 * m:
                return codes.POSE_UNBOUNDED
        x, y = centroid(corners, count)
    near.point[0] = x
    if r == 2:
        near.point[1] = y
    return codes.POSE_SOLVED


@kernel
def feasible_interval(bounds: Array, null: Array) -> tuple[float, float]:
    """Ends of the feasible interval for r = 1. If the interval is empty, the first end exceeds the second."""
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
    """Fill the corners of the feasible polygon, or for r = 1 the interval's ends. Returns their number, 0 if empty."""
    # The edge of the box around the polygon replaces an infinite end of the interval, with the label of the box.
    if null.shape[0] == 2:
        return polygon.feasible_polygon(bounds, null, corners, labels)
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
    """Centroid of a convex polygon, or the mean of its corners if its area is zero."""
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
def _lowest_corner(
    bounds: Array, null: Array, corners: Array, count: int, goal_x: float, goal_y: float
) -> tuple[float, float]:
    """Point with the least sum of tensions. If a whole side has the least sum, the point of it nearest to the goal."""
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
                x, y = polygon.nearest_on_side(x, y, corners[following, 0], corners[following, 1], goal_x, goal_y)
            distance = (x - goal_x) * (x - goal_x) + (y - goal_y) * (y - goal_y)
            if distance < best:
                best = distance
                best_x, best_y = x, y
    return best_x, best_y

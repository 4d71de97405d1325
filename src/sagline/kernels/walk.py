"""The feasible polygon by walking around it, for two redundant cables.

From a corner of two cables' parallelogram the walk follows the border of the limits met so far. Where it meets one
that is missed, the border turns into that limit, which then counts; a full turn with a limit still missed says that
there is no polygon, a full turn with none missed has passed all its corners.

Source:
    Gouttefarde, Lamaury, Reichert & Bruckmann 2015, "A versatile tension distribution algorithm for n-DOF parallel
    robots driven by n + 2 cables".
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.jit import kernel
from sagline.kernels.polygon import TOLERANCE, largest_tension
from sagline.kernels.tables import HIGH, LOW, START

PARALLEL = 1e-12


@kernel
def limit_line(work: Array, null: Array, line: int) -> tuple[float, float, float]:
    """Limit 2i or 2i + 1 as gx x + gy y + offset >= 0."""
    i = line // 2
    if line % 2 == 0:
        return null[0, i], null[1, i], work[START, i] - work[LOW, i]
    return -null[0, i], -null[1, i], work[HIGH, i] - work[START, i]


@kernel
def most_independent(null: Array) -> tuple[int, int]:
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
def walk_polygon(work: Array, null: Array, corners: Array, labels: Indices) -> int:
    """Fill corners, counter-clockwise, and labels as `feasible_polygon` does; returns how many.

    0 if the polygon is empty, -1 if the walk lost its way. All limits must be finite.
    """
    m = null.shape[1]
    slack = TOLERANCE * largest_tension(work)
    met = np.zeros(2 * m, dtype=np.bool_)
    a, b = most_independent(null)
    line = 2 * a
    gx, gy, offset = limit_line(work, null, line)
    hx, hy, shift = limit_line(work, null, 2 * b)
    # the parallelogram's corner from which line a runs counter-clockwise: inside on its left
    cross = gx * hy - gy * hx
    if cross > 0.0:
        hx, hy, shift = -hx, -hy, work[HIGH, b] - work[START, b]
        cross = -cross
    x = (-offset * hy + shift * gy) / cross
    y = (-shift * gx + offset * hx) / cross
    for k in range(2 * m):
        gx, gy, offset = limit_line(work, null, k)
        met[k] = gx * x + gy * y + offset >= -slack
        if abs(gx) + abs(gy) < PARALLEL and offset < -slack:
            return 0
    for k in range(2):
        met[2 * a + k] = met[2 * b + k] = True
    first_line = line
    count = 0
    for _ in range(16 * m * m):
        corners[count, 0], corners[count, 1], labels[count] = x, y, line
        count += 1
        gx, gy, offset = limit_line(work, null, line)
        way_x, way_y = gy, -gx  # inside, along (gx, gy), lies to the left of the way
        nearest = math.inf
        turn = -1
        for k in range(2 * m):
            hx, hy, shift = limit_line(work, null, k)
            speed = hx * way_x + hy * way_y
            here = hx * x + hy * y + shift
            if k // 2 != line // 2 and abs(speed) > PARALLEL:
                distance = -here / speed
                if met[k] and speed < 0.0 and max(distance, 0.0) < nearest:
                    nearest, turn = max(distance, 0.0), k
                elif not met[k] and speed > 0.0 and distance <= nearest and distance > 0.0:
                    nearest, turn = distance, k
        if turn < 0:
            return -1
        x += nearest * way_x
        y += nearest * way_y
        if met[turn]:
            line = turn
            if line == first_line:
                for k in range(2 * m):
                    if not met[k]:
                        return 0
                return count
            if count + 1 >= corners.shape[0]:
                return -1
        else:
            for k in range(2 * m):
                hx, hy, shift = limit_line(work, null, k)
                met[k] = met[k] or hx * x + hy * y + shift >= -slack
            met[turn] = True
            # its border ends here, where the walk goes on: it will be the last side to be passed
            first_line = line
            count = 0
    return -1

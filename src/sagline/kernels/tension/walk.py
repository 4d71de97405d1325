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

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import HIGH, LOW, START, TOLERANCE, largest_bound
from sagline.kernels.jit import kernel
from sagline.kernels.memory import Memory, block, counters

PARALLEL = 1e-12


@kernel
def _limit_lines(bounds: Array, null: Array, lines: Array) -> None:
    """Fill the limits 2i and 2i + 1 as rows gx, gy, offset of gx x + gy y + offset >= 0, (2m, 3)."""
    for i in range(null.shape[1]):
        lines[2 * i, 0] = null[0, i]
        lines[2 * i, 1] = null[1, i]
        lines[2 * i, 2] = bounds[START, i] - bounds[LOW, i]
        lines[2 * i + 1, 0] = -null[0, i]
        lines[2 * i + 1, 1] = -null[1, i]
        lines[2 * i + 1, 2] = bounds[HIGH, i] - bounds[START, i]


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
def walk_polygon(bounds: Array, null: Array, memory: Memory, corners: Array, labels: Indices) -> int:
    """Fill corners, counter-clockwise, and labels as `feasible_polygon` does; returns how many.

    0 if the polygon is empty, -1 if the walk lost its way. All limits must be finite.
    """
    m = null.shape[1]
    slack = TOLERANCE * largest_bound(bounds)
    lines, _ = block(memory.numbers, 0, 2 * m, 3)
    _limit_lines(bounds, null, lines)
    met, _ = counters(memory, 0, 2 * m)  # 1 for a limit that counts
    a, b = most_independent(null)
    line = 2 * a
    # the parallelogram's corner from which line a runs counter-clockwise: inside on its left
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
        way_x = lines[line, 1]  # inside lies to the left of the way
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
            # its border ends here, where the walk goes on: it will be the last side to be passed
            first_line = line
            count = 0
    return -1

"""Shapes for distances: catenaries, straight rods and boxes, each a row of numbers in world axes.

A rod is a cable without weight; a capsule is a rod with a radius, and a sphere is a capsule without length.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable.batch import catenary_point
from sagline.kernels.jit import kernel

# Columns of a row.
KIND = 0
PLACE = 1  # three: exit point of a cable, start of a rod, or center of a box [m]
RADIUS = 4  # half the diameter, which is subtracted from distances [m]
FIRST = 5  # first and last measured point of a cable or rod, as shares of its unstrained length
LAST = 6
LEVEL = 7  # two: horizontal unit vector toward the platform end
HORIZONTAL = 9  # T_x [N]                          | of a parabola: its span [m]
VERTICAL = 10  # T_z at the platform end [N]       |                its rise [m]
LENGTH = 11  # L [m]                               |                four times its drop in the middle [m]
WEIGHT = 12  # w [N/m]
STIFFNESS = 13  # EA [N]
SPAN, RISE, DROP = HORIZONTAL, VERTICAL, LENGTH
AXES = 5  # nine: nine numbers: matrix, row by row, whose columns are the directions of a box's edges
HALF = 14  # three: half the edges of a box [m]
COLUMNS = 17

# Kinds.
HANGING = 0.0
PARABOLA = 1.0
BOX = 2.0

FOLD = 1e-12  # largest distance from the turning point that counts as zero, relative to the length of the cable


@kernel
def point(row: Array, share: float) -> tuple[float, float, float]:
    """Point [m] of a cable or rod at `share` of its unstrained length."""
    if row[KIND] == HANGING:
        x, z = catenary_point(share, row[HORIZONTAL], row[VERTICAL], row[LENGTH], row[WEIGHT], row[STIFFNESS])
    else:
        x = share * row[SPAN]
        z = share * row[RISE] - row[DROP] * share * (1.0 - share)
    return row[PLACE] + row[LEVEL] * x, row[PLACE + 1] + row[LEVEL + 1] * x, row[PLACE + 2] + z


@kernel
def slopes(row: Array, share: float) -> tuple[float, float, float, float]:
    """First and second derivatives of (x, z) in the cable's plane with respect to the share of its length [m].

    With t the tension and T the force, the derivatives with respect to the unstrained length are r' = T (1/t + 1/EA)
    and r'' = (-T_x T_z w/t^3, w T_x^2/t^3 + w/EA).
    """
    if row[KIND] != HANGING:
        return row[SPAN], row[RISE] - row[DROP] * (1.0 - 2.0 * share), 0.0, 2.0 * row[DROP]
    length, weight, horizontal = row[LENGTH], row[WEIGHT], row[HORIZONTAL]
    vertical = row[VERTICAL] - weight * length * (1.0 - share)
    tension = math.sqrt(horizontal * horizontal + vertical * vertical)
    give = 1.0 / row[STIFFNESS]
    if tension == 0.0:  # turning point of a fold, where the direction is undefined
        return 0.0, 0.0, 0.0, weight * give * length * length
    inverse = 1.0 / tension
    bend = weight * horizontal * inverse * inverse * inverse * length * length
    along = length * (inverse + give)
    return along * horizontal, along * vertical, -bend * vertical, bend * horizontal + weight * give * length * length


@kernel
def level_point(row: Array) -> float:
    """Position of a catenary's horizontal tangent as a fraction of its length. It can be beyond an end of the cable."""
    if row[KIND] != HANGING:
        return -1.0
    return 1.0 - row[VERTICAL] / (row[WEIGHT] * row[LENGTH])


@kernel
def bulge(row: Array, first: float, last: float, chord2: float) -> float:
    """Largest distance of the points of a piece from its chord [m]; `square` is the squared chord.

    The result is the smaller of two upper bounds. The first is |r''| (s1 - s0)^2/8 with the least tension on the piece.
    The second follows from the length of the piece and the distance of its ends, and is also valid for folds.
    """
    width = last - first
    if row[KIND] != HANGING:
        return abs(row[DROP]) * width * width * 0.25
    weight, horizontal, give = row[WEIGHT], row[HORIZONTAL], 1.0 / row[STIFFNESS]
    part = row[LENGTH] * width
    v0 = row[VERTICAL] - weight * row[LENGTH] * (1.0 - first)
    v1 = v0 + weight * part
    slack = FOLD * weight * row[LENGTH]
    horizontal2 = horizontal * horizontal
    least2 = horizontal2 if v0 < -slack and v1 > slack else horizontal2 + min(v0 * v0, v1 * v1)
    most2 = horizontal2 + max(v0 * v0, v1 * v1)
    bend = 0.0
    if horizontal > 0.0:
        bend = weight * horizontal / least2
    elif v0 < -slack and v1 > slack:
        bend = math.inf
    by_curvature = 0.125 * part * part * (bend + weight * give)
    if by_curvature * by_curvature < 1e-4 * chord2:  # for a shallow piece the second bound is not smaller
        return by_curvature
    arc = part * (1.0 + math.sqrt(most2) * give)
    by_length = 0.5 * math.sqrt(max(arc * arc - chord2, 0.0))
    return min(by_curvature, by_length)


STEPS = 12  # Newton steps; the slope has at most six straight parts


@kernel
def between_segments(one: Array, other: Array) -> tuple[float, float, float, float]:
    """Squared distance [m^2] of segments (x0, y0, z0, x1, y1, z1), its lower bound, and their nearest shares."""
    ax, ay, az = one[3] - one[0], one[4] - one[1], one[5] - one[2]
    bx, by, bz = other[3] - other[0], other[4] - other[1], other[5] - other[2]
    rx, ry, rz = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    aa = ax * ax + ay * ay + az * az
    bb = bx * bx + by * by + bz * bz
    ab = ax * bx + ay * by + az * bz
    ar = ax * rx + ay * ry + az * rz
    br = bx * rx + by * ry + bz * rz
    determinant = aa * bb - ab * ab
    s = 0.0
    if determinant > 0.0:
        s = min(max((ab * br - ar * bb) / determinant, 0.0), 1.0)
    t = 0.0
    if bb > 0.0:
        t = (ab * s + br) / bb
    if t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((ab * t - ar) / aa, 0.0), 1.0) if aa > 0.0 else 0.0
    dx, dy, dz = rx + s * ax - t * bx, ry + s * ay - t * by, rz + s * az - t * bz
    square = dx * dx + dy * dy + dz * dz
    slope_s = 2.0 * (dx * ax + dy * ay + dz * az)
    slope_t = -2.0 * (dx * bx + dy * by + dz * bz)
    gap = max(slope_s * s, slope_s * (s - 1.0)) + max(slope_t * t, slope_t * (t - 1.0))
    return square, max(square - gap, 0.0), s, t


@kernel
def in_box_axes(box: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Convert the vector (x, y, z) to the axes of `box`."""
    return (
        box[AXES] * x + box[AXES + 3] * y + box[AXES + 6] * z,
        box[AXES + 1] * x + box[AXES + 4] * y + box[AXES + 7] * z,
        box[AXES + 2] * x + box[AXES + 5] * y + box[AXES + 8] * z,
    )


@kernel
def outside(coordinate: float, half: float) -> float:
    """Signed distance of `coordinate` from the nearer face of a box. 0 between the two faces."""
    return coordinate - min(max(coordinate, -half), half)


@kernel
def to_box(segment: Array, box: Array) -> tuple[float, float, float]:
    """Squared distance [m^2] between a segment and a box, its lower bound, and the share of the nearest point."""
    px, py, pz = in_box_axes(box, segment[0] - box[PLACE], segment[1] - box[PLACE + 1], segment[2] - box[PLACE + 2])
    dx, dy, dz = in_box_axes(box, segment[3] - segment[0], segment[4] - segment[1], segment[5] - segment[2])
    hx, hy, hz = box[HALF], box[HALF + 1], box[HALF + 2]
    low, high, t = 0.0, 1.0, 0.5
    ex = ey = ez = 0.0
    slope = 0.0
    for _ in range(STEPS):
        ex, ey, ez = outside(px + t * dx, hx), outside(py + t * dy, hy), outside(pz + t * dz, hz)
        slope = ex * dx + ey * dy + ez * dz
        if slope == 0.0 or (slope > 0.0 and t == 0.0) or (slope < 0.0 and t == 1.0):
            break
        if slope > 0.0:
            high = t
        else:
            low = t
        bend = 0.0
        if ex != 0.0:
            bend += dx * dx
        if ey != 0.0:
            bend += dy * dy
        if ez != 0.0:
            bend += dz * dz
        new = min(max(t - slope / bend, 0.0), 1.0) if bend > 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if new == t:
            break
        t = new
    ex, ey, ez = outside(px + t * dx, hx), outside(py + t * dy, hy), outside(pz + t * dz, hz)
    slope = 2.0 * (ex * dx + ey * dy + ez * dz)
    square = ex * ex + ey * ey + ez * ez
    gap = max(slope * t, slope * (t - 1.0))
    return square, max(square - gap, 0.0), t


@kernel
def nearest_in_box(box: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Point of `box` that is nearest to the point (x, y, z) [m]."""
    px, py, pz = in_box_axes(box, x - box[PLACE], y - box[PLACE + 1], z - box[PLACE + 2])
    ex, ey, ez = outside(px, box[HALF]), outside(py, box[HALF + 1]), outside(pz, box[HALF + 2])
    return (
        x - (box[AXES] * ex + box[AXES + 1] * ey + box[AXES + 2] * ez),
        y - (box[AXES + 3] * ex + box[AXES + 4] * ey + box[AXES + 5] * ez),
        z - (box[AXES + 6] * ex + box[AXES + 7] * ey + box[AXES + 8] * ez),
    )


@kernel
def _length(x: float, y: float, z: float) -> float:
    """Length of a vector."""
    return math.sqrt(x * x + y * y + z * z)

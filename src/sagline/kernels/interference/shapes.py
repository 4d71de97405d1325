"""Shapes for distances: catenaries, straight rods and boxes, each a row of numbers in world axes; their local minima.

A rod is a cable without weight; a capsule is a rod with a radius, and a sphere is a capsule without length. Newton's
method finds a local minimum of the distance from two given points, within the ends of the cables.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable.batch import catenary_point
from sagline.kernels.jit import kernel

# Columns of a row.
KIND = 0
PLACE = 1  # three: exit point of a cable, start of a rod, or center of a box [m]
RADIUS = 4  # radius, which is subtracted from distances [m]
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
    """First and second derivatives of (x, z) in the cable's plane with respect to the share of its length [m]."""
    # With t the tension and T the force, the derivatives with respect to the unstrained length are r' = T (1/t + 1/EA)
    # and r'' = (-T_x T_z w/t^3, w T_x^2/t^3 + w/EA).
    if row[KIND] != HANGING:
        return row[SPAN], row[RISE] - row[DROP] * (1.0 - 2.0 * share), 0.0, 2.0 * row[DROP]
    length, weight, horizontal = row[LENGTH], row[WEIGHT], row[HORIZONTAL]
    vertical = row[VERTICAL] - weight * length * (1.0 - share)
    tension = math.sqrt(horizontal * horizontal + vertical * vertical)
    give = 1.0 / row[STIFFNESS]
    if tension == 0.0:  # the turning point of a fold has no direction
        return 0.0, 0.0, 0.0, weight * give * length * length
    inverse = 1.0 / tension
    bend = weight * horizontal * inverse * inverse * inverse * length * length
    along = length * (inverse + give)
    return along * horizontal, along * vertical, -bend * vertical, bend * horizontal + weight * give * length * length


@kernel
def level_point(row: Array) -> float:
    """Position of a catenary's horizontal tangent as a fraction of its length; it may be beyond an end of the cable."""
    if row[KIND] != HANGING:
        return -1.0
    return 1.0 - row[VERTICAL] / (row[WEIGHT] * row[LENGTH])


@kernel
def bulge(row: Array, first: float, last: float, chord2: float) -> float:
    """Largest distance of the points of a piece from its chord [m]; `square` is the squared chord."""
    # The result is the smaller of two upper bounds. The first bound is |r''| (s1 - s0)^2/8 with the least tension on
    # the piece. The second bound follows from the length of the piece and the distance of its ends, also for folds.
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
    if by_curvature * by_curvature < 1e-4 * chord2:  # for a shallow piece, the second bound is never the smaller bound
        return by_curvature
    arc = part * (1.0 + math.sqrt(most2) * give)
    by_length = 0.5 * math.sqrt(max(arc * arc - chord2, 0.0))
    return min(by_curvature, by_length)


STEPS = 12  # Newton steps: at most six, because the slope has at most six straight parts


@kernel
def between_segments(one: Array, other: Array) -> tuple[float, float, float, float]:
    """Squared distance [m^2] of two segments (x0, y0, z0, x1, y1, z1), a lower bound, and nearest points as shares."""
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
def _in_box_axes(box: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Convert the vector (x, y, z) to the axes of `box`."""
    return (
        box[AXES] * x + box[AXES + 3] * y + box[AXES + 6] * z,
        box[AXES + 1] * x + box[AXES + 4] * y + box[AXES + 7] * z,
        box[AXES + 2] * x + box[AXES + 5] * y + box[AXES + 8] * z,
    )


@kernel
def outside(coordinate: float, half: float) -> float:
    """Signed distance of `coordinate` from the nearer of two faces at -`half` and `half`; 0 between the faces."""
    return coordinate - min(max(coordinate, -half), half)


@kernel
def to_box(segment: Array, box: Array) -> tuple[float, float, float]:
    """Squared distance [m^2] between a segment and a box, its lower bound, and the share of the nearest point."""
    px, py, pz = _in_box_axes(box, segment[0] - box[PLACE], segment[1] - box[PLACE + 1], segment[2] - box[PLACE + 2])
    dx, dy, dz = _in_box_axes(box, segment[3] - segment[0], segment[4] - segment[1], segment[5] - segment[2])
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
    px, py, pz = _in_box_axes(box, x - box[PLACE], y - box[PLACE + 1], z - box[PLACE + 2])
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


ITERATIONS = 30
HALVINGS = 6
# the search ends after a step below this share of the cable's length, because Newton's method squares the error
SMALL = 1e-8
FLAT = 1e-13  # a determinant below this share of the product of curvatures means parallel cables


@kernel
def square_between(one: Array, other: Array, s: float, t: float) -> float:
    """Squared distance [m^2] of the point `s` of cable `one` from the point `t` of cable `other`."""
    ax, ay, az = point(one, s)
    bx, by, bz = point(other, t)
    return (ax - bx) * (ax - bx) + (ay - by) * (ay - by) + (az - bz) * (az - bz)


@kernel
def _newton_step(one: Array, other: Array, s: float, t: float) -> tuple[float, float, float]:
    """Squared distance at the shares `s` and `t`, and both shares after a Newton step that stays in their ranges."""
    ax, ay, az = point(one, s)
    bx, by, bz = point(other, t)
    rx, ry, rz = ax - bx, ay - by, az - bz
    ux, uz, ux2, uz2 = slopes(one, s)
    vx, vz, vx2, vz2 = slopes(other, t)
    along = rx * one[LEVEL] + ry * one[LEVEL + 1]
    beside = rx * other[LEVEL] + ry * other[LEVEL + 1]
    gs = along * ux + rz * uz
    gt = -(beside * vx + rz * vz)
    uu, vv = ux * ux + uz * uz, vx * vx + vz * vz
    hss, htt = uu + along * ux2 + rz * uz2, vv - beside * vx2 - rz * vz2
    hst = -(ux * vx * (one[LEVEL] * other[LEVEL] + one[LEVEL + 1] * other[LEVEL + 1]) + uz * vz)
    s_free = not ((s <= one[FIRST] and gs > 0.0) or (s >= one[LAST] and gs < 0.0)) and uu > 0.0
    t_free = not ((t <= other[FIRST] and gt > 0.0) or (t >= other[LAST] and gt < 0.0)) and vv > 0.0
    ds, dt = 0.0, 0.0
    if s_free and t_free:
        determinant = hss * htt - hst * hst
        if not (hss > 0.0 and determinant > FLAT * uu * vv):  # far from the minimum, or parallel cables
            hss, htt = uu * (1.0 + 1e-9), vv * (1.0 + 1e-9)
            determinant = max(hss * htt - hst * hst, FLAT * uu * vv)
        ds = -(gs * htt - gt * hst) / determinant
        dt = -(gt * hss - gs * hst) / determinant
        # a share at the end of its range stays there; then only the other share changes
        new_s, new_t = min(max(s + ds, one[FIRST]), one[LAST]), min(max(t + dt, other[FIRST]), other[LAST])
        if new_s != s + ds and new_t == t + dt:
            new_t = min(max(t - (gt + hst * (new_s - s)) / htt, other[FIRST]), other[LAST])
        elif new_t != t + dt and new_s == s + ds:
            new_s = min(max(s - (gs + hst * (new_t - t)) / hss, one[FIRST]), one[LAST])
        return rx * rx + ry * ry + rz * rz, new_s, new_t
    if s_free:
        ds = -gs / (hss if hss > 0.1 * uu else uu)
    if t_free:
        dt = -gt / (htt if htt > 0.1 * vv else vv)
    new_s, new_t = min(max(s + ds, one[FIRST]), one[LAST]), min(max(t + dt, other[FIRST]), other[LAST])
    return rx * rx + ry * ry + rz * rz, new_s, new_t


@kernel
def nearest_of_curves(one: Array, other: Array, s: float, t: float) -> tuple[float, float, float]:
    """Local minimum [m^2] of the squared distance of two cables, and its shares; the search starts at `s` and `t`."""
    square, new_s, new_t = _newton_step(one, other, s, t)
    for _ in range(ITERATIONS):
        ds, dt = new_s - s, new_t - t
        done = abs(ds) <= SMALL and abs(dt) <= SMALL
        found, next_s, next_t = _newton_step(one, other, new_s, new_t)
        for _ in range(HALVINGS):
            if found <= square:
                break
            ds, dt = 0.25 * ds, 0.25 * dt
            found, next_s, next_t = _newton_step(one, other, s + ds, t + dt)
        if not found < square:
            return square, s, t
        s, t, square = s + ds, t + dt, found
        new_s, new_t = next_s, next_t
        if done:
            break
    return square, s, t


@kernel
def _box_step(curve: Array, box: Array, s: float) -> tuple[float, float]:
    """Squared distance [m^2] of the cable point `s` from a box, and the share after a Newton step, within its range."""
    x, y, z = point(curve, s)
    px, py, pz = _in_box_axes(box, x - box[PLACE], y - box[PLACE + 1], z - box[PLACE + 2])
    ex, ey, ez = outside(px, box[HALF]), outside(py, box[HALF + 1]), outside(pz, box[HALF + 2])
    dx, dz, dx2, dz2 = slopes(curve, s)
    ux, uy, uz = _in_box_axes(box, dx * curve[LEVEL], dx * curve[LEVEL + 1], dz)
    vx, vy, vz = _in_box_axes(box, dx2 * curve[LEVEL], dx2 * curve[LEVEL + 1], dz2)
    slope = ex * ux + ey * uy + ez * uz
    bend = 0.0
    if ex != 0.0:
        bend += ux * ux
    if ey != 0.0:
        bend += uy * uy
    if ez != 0.0:
        bend += uz * uz
    curved = bend + ex * vx + ey * vy + ez * vz
    if curved <= 1e-3 * bend:
        curved = bend
    step = -slope / curved if curved > 0.0 else 0.0
    return ex * ex + ey * ey + ez * ez, min(max(s + step, curve[FIRST]), curve[LAST])


@kernel
def nearest_to_box(curve: Array, box: Array, s: float) -> tuple[float, float]:
    """Local minimum [m^2] of the squared distance of a cable from a box, and its share; the search starts at `s`."""
    square, new = _box_step(curve, box, s)
    for _ in range(ITERATIONS):
        step = new - s
        done = abs(step) <= SMALL
        found, following = _box_step(curve, box, new)
        for _ in range(HALVINGS):
            if found <= square:
                break
            step = 0.25 * step
            found, following = _box_step(curve, box, s + step)
        if not found < square:
            return square, s
        s, square, new = s + step, found, following
        if done:
            break
    return square, s

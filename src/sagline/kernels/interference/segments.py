"""Nearest points of straight pieces, and of a straight piece and a box, with what the search may have missed.

Both minimize a convex function f of one or two shares in [0, 1]. Wherever the search ends, the least value is above
f - gap, gap = the most that the slope there promises within the range: rounding or parallel pieces cannot forge it.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.interference.shapes import AXES, HALF, PLACE
from sagline.kernels.jit import kernel

STEPS = 12  # Newton on a slope of at most six straight parts


@kernel
def between_segments(one: Array, other: Array) -> tuple[float, float, float, float]:
    """Squared distance of segments (x0, y0, z0, x1, y1, z1), a lower bound of it [m^2], and the shares where."""
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
def in_axes(box: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector in a box's axes."""
    return (
        box[AXES] * x + box[AXES + 3] * y + box[AXES + 6] * z,
        box[AXES + 1] * x + box[AXES + 4] * y + box[AXES + 7] * z,
        box[AXES + 2] * x + box[AXES + 5] * y + box[AXES + 8] * z,
    )


@kernel
def outside(coordinate: float, half: float) -> float:
    """Signed distance of a coordinate beyond a box's faces; 0 between them."""
    return coordinate - min(max(coordinate, -half), half)


@kernel
def to_box(segment: Array, box: Array) -> tuple[float, float, float]:
    """Squared distance of a segment from a box, a lower bound of it [m^2], and the share of the segment where."""
    px, py, pz = in_axes(box, segment[0] - box[PLACE], segment[1] - box[PLACE + 1], segment[2] - box[PLACE + 2])
    dx, dy, dz = in_axes(box, segment[3] - segment[0], segment[4] - segment[1], segment[5] - segment[2])
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
    """The point of a box that is nearest to a point [m]."""
    px, py, pz = in_axes(box, x - box[PLACE], y - box[PLACE + 1], z - box[PLACE + 2])
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

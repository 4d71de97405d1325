"""Local minimum of the distance, by Newton's method from two given points, within the ends of the cables."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.interference.shapes import FIRST, HALF, LAST, LEVEL, PLACE, in_box_axes, outside, point, slopes
from sagline.kernels.jit import kernel

STEPS = 30
HALVINGS = 6
# relative to the cable's length; the search ends after a smaller step, because Newton's method squares the error
SMALL = 1e-8
FLAT = 1e-13  # relative to the product of curvatures; a smaller determinant means parallel cables


@kernel
def square_between(one: Array, other: Array, s: float, t: float) -> float:
    """Squared distance of two points on cables [m^2]."""
    ax, ay, az = point(one, s)
    bx, by, bz = point(other, t)
    return (ax - bx) * (ax - bx) + (ay - by) * (ay - by) + (az - bz) * (az - bz)


@kernel
def _newton_step(one: Array, other: Array, s: float, t: float) -> tuple[float, float, float]:
    """Squared distance at two shares of the cable lengths, and the shares, within their ranges, after a Newton step."""
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
        # a share at a bound stays there; then only the other share changes
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
    """Local minimum of the squared distance of two cables [m^2] near two points, and the points of the minimum."""
    square, new_s, new_t = _newton_step(one, other, s, t)
    for _ in range(STEPS):
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
    """Squared distance of a cable point from a box [m^2], and the share (within its range) after a Newton step."""
    x, y, z = point(curve, s)
    px, py, pz = in_box_axes(box, x - box[PLACE], y - box[PLACE + 1], z - box[PLACE + 2])
    ex, ey, ez = outside(px, box[HALF]), outside(py, box[HALF + 1]), outside(pz, box[HALF + 2])
    dx, dz, dx2, dz2 = slopes(curve, s)
    ux, uy, uz = in_box_axes(box, dx * curve[LEVEL], dx * curve[LEVEL + 1], dz)
    vx, vy, vz = in_box_axes(box, dx2 * curve[LEVEL], dx2 * curve[LEVEL + 1], dz2)
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
    """Local minimum of the squared distance of a cable from a box [m^2] near a point, and the point of the minimum."""
    square, new = _box_step(curve, box, s)
    for _ in range(STEPS):
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

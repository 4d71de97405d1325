"""A cable over a pulley that swivels about an axis of any direction; docs/model.md, section 10.

The cable enters the pulley at the frame anchor A along the unit vector n of the swivel axis. The unit vector e_r points
from A to the center of the pulley, and e_s = n x e_r. The cable leaves at P = A + v e_r + R sin psi n, with v = R (1 -
cos psi). The force F at P alone determines P: F has no component along the radius of the pulley, and the moment v F.e_s
about the axis balances the weight of the cable on the pulley, k e_s.z. Without this moment the force would not be the
gradient of the energy. F is the force at the platform end minus the weight of the free span.

Newton's method finds the force at the platform end. Its matrix C, the motion of the platform end per newton, follows
from the equations of the exit point by the implicit function theorem. The free span lies in the vertical plane of the
force, which becomes the plane of the cable in the rows. The chord in the rows becomes that of the free span.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import angle, atanhc_excess
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.models import catenary_end, from_length, slack_series
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Material, Model
from sagline.kernels.jit import entry, formula, kernel

Vector = tuple[float, float, float]

ROUNDS = 60  # largest number of Newton steps for one cable; a taut cable needs three
CLOSED = 3e-15  # error of the platform end that counts as zero, relative to the cable's length
MISSED = 1e-12  # largest accepted error of the platform end, relative to the cable's length
NEARBY = 0.1  # largest predicted relative change of a force from which the last solution is the start
SHORTENINGS = 30  # of one Newton step
STILL = 1e-10  # change of the free length, relative to the length, after which its error is far below 1e-13
SMALL_TURN = 1e-7  # [rad], change of the swivel angle after which the next change is a rounding error
LENGTHS = 12  # passes for the free length
SHORTEST = 1e-3  # shortest free length, relative to the whole length
TINY = 1e-300


class Swivel(NamedTuple):
    """Swivel axis (unit vector n), pulley, dead length and material of one cable."""

    x: float
    y: float
    z: float
    radius: float  # R [m]
    dead: float  # dead length [m]
    rise: float  # height of the anchor above the drum [m]
    weight: float  # w [N/m]
    stiffness: float  # EA [N]


class Exit(NamedTuple):
    """Exit point of a cable, and the unstrained cable between exit point and drum."""

    rx: float  # e_r, from the axis to the center of the pulley
    ry: float
    rz: float
    sx: float  # e_s = n x e_r
    sy: float
    sz: float
    sine: float  # of psi
    cosine: float
    wrap: float  # psi [rad]
    wrapped: float  # unstrained length on the pulley [m]
    dead: float  # unstrained dead length [m]


@formula
def swivel_at(cables: Array, i: int, gravity: float) -> Swivel:
    """Swivel axis, pulley and material of cable `i` of a cable_table with swivel axes."""
    pulley = pulley_at(cables, i)
    return Swivel(
        cables[i, tables.AXIS_X],
        cables[i, tables.AXIS_Y],
        cables[i, tables.AXIS_Z],
        pulley.radius,
        pulley.dead,
        pulley.rise,
        cables[i, tables.DENSITY] * gravity,
        cables[i, tables.STIFFNESS],
    )


@formula
def _height(swivel: Swivel, rz: float, sine: float, cosine: float, wrap: float) -> tuple[float, float]:
    """Height of P above A in units of R (zeta), and the integral I of the height above P along the pulley."""
    zeta = (1.0 - cosine) * rz + sine * swivel.z
    return zeta, wrap * zeta - (wrap - sine) * rz - (1.0 - cosine) * swivel.z


@formula
def _strains(swivel: Swivel, tension: float, zeta: float) -> tuple[float, float, float]:
    """Stretch E at the exit point, at the entry of the pulley, and at the drum."""
    leaving = 1.0 + tension / swivel.stiffness
    weighs = swivel.weight / swivel.stiffness
    entering = math.sqrt(leaving * leaving - 2.0 * weighs * swivel.radius * zeta)
    return leaving, entering, math.sqrt(entering * entering - 2.0 * weighs * swivel.rise)


@kernel
def exit_of(swivel: Swivel, x: float, y: float, z: float) -> Exit:
    """Exit point of a cable whose force at the exit point is (`x`, `y`, `z`), toward the platform end [N]."""
    nx, ny, nz = swivel.x, swivel.y, swivel.z
    radius = swivel.radius
    along = x * nx + y * ny + z * nz
    rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
    across = math.sqrt(rx * rx + ry * ry + rz * rz)
    tension = math.sqrt(across * across + along * along)
    if not across > 0.0:  # along the axis: any direction normal to the axis
        rx, ry, rz = (1.0 - nx * nx, -nx * ny, -nx * nz) if abs(nx) < 0.8 else (-nx * ny, 1.0 - ny * ny, -ny * nz)
    inverse = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
    rx, ry, rz = rx * inverse, ry * inverse, rz * inverse
    strained = 1.0 + tension / swivel.stiffness
    weight = swivel.weight * radius * radius / strained
    wrap = angle(across, along)
    outward, length = across, tension + TINY
    for _ in range(3 if radius > 0.0 and weight > 0.0 and nx * nx + ny * ny > 0.0 else 0):
        sx, sy, sz = ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx
        moment = weight * (wrap - outward / length)  # k
        arm = radius * (1.0 - along / length)  # v
        slope = arm * outward - moment * rz
        turned = 0.0
        if slope > 0.0:
            turned = (arm * (x * sx + y * sy + z * sz) - moment * sz) / slope
            turned = min(max(turned, -0.5), 0.5)
            rx, ry, rz = rx + turned * sx, ry + turned * sy, rz + turned * sz
            inverse = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
            rx, ry, rz = rx * inverse, ry * inverse, rz * inverse
        outward = x * rx + y * ry + z * rz
        length = math.sqrt(outward * outward + along * along) + TINY
        wrap = angle(max(outward, 0.0), along)
        if slope > 0.0 and abs(turned) < SMALL_TURN:
            break
    sine, cosine = outward / length, along / length
    zeta, integral = _height(swivel, rz, sine, cosine, wrap)
    strained, entering, drawn = _strains(swivel, tension, zeta)
    beta = swivel.weight * radius / swivel.stiffness
    return Exit(
        rx,
        ry,
        rz,
        ny * rz - nz * ry,
        nz * rx - nx * rz,
        nx * ry - ny * rx,
        sine,
        cosine,
        wrap,
        radius * (wrap + beta * integral / (strained * strained)) / strained,
        2.0 * swivel.dead / (entering + drawn),
    )


@formula
def point_of(swivel: Swivel, at: Exit) -> Vector:
    """Position of the exit point relative to the anchor [m]."""
    v, along = swivel.radius * (1.0 - at.cosine), swivel.radius * at.sine
    return v * at.rx + along * swivel.x, v * at.ry + along * swivel.y, v * at.rz + along * swivel.z


@formula
def free_compliance(
    horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> tuple[float, float, float, float]:
    """Compliance [m/N] of the free span: dx/dT_x, dx/dT_z = dz/dT_x, dz/dT_z, and x/T_x normal to the plane."""
    vertical_a = vertical - weight * length
    square = horizontal * horizontal
    tension_a = math.sqrt(square + vertical_a * vertical_a)
    tension_b = math.sqrt(square + vertical * vertical)
    total = tension_a + tension_b
    product = tension_a * tension_b + TINY
    u = weight * length / total
    excess = atanhc_excess(u) if u <= 0.5 else slack_series(horizontal, vertical_a, vertical, tension_a, tension_b) - 1
    c = horizontal * (vertical_a + vertical) / product
    level = (square - vertical_a * vertical) / product
    q = 1.0 + level
    p = 1.0 - level
    if level >= 0.0:
        p = c * c / q
    else:
        q = c * c / p
    stretch, turn = 1.0 / stiffness, 1.0 / total
    return (
        length * (stretch + turn * (2.0 * excess + p)),
        -length * c * turn,
        length * (stretch + turn * q),
        length * (stretch + 2.0 * turn * (1.0 + excess)),
    )


@formula
def _inverse_of_three(a: Vector, b: Vector, c: Vector) -> tuple[Vector, Vector, Vector]:
    """Rows of the inverse of the 3 x 3 matrix with the rows `a`, `b` and `c`."""
    x, y, z = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    inverse = 1.0 / (a[0] * x + a[1] * y + a[2] * z)
    return (
        (inverse * x, inverse * (a[2] * c[1] - a[1] * c[2]), inverse * (a[1] * b[2] - a[2] * b[1])),
        (inverse * y, inverse * (a[0] * c[2] - a[2] * c[0]), inverse * (a[2] * b[0] - a[0] * b[2])),
        (inverse * z, inverse * (a[1] * c[0] - a[0] * c[1]), inverse * (a[0] * b[1] - a[1] * b[0])),
    )


@formula
def _add_product(rows: Array, i: int, one: Vector, other: Vector) -> None:
    """Add the symmetric part of `one` times `other` to the six numbers of cable `i`."""
    rows[g.W_XX, i] += one[0] * other[0]
    rows[g.W_XY, i] += 0.5 * (one[0] * other[1] + one[1] * other[0])
    rows[g.W_XZ, i] += 0.5 * (one[0] * other[2] + one[2] * other[0])
    rows[g.W_YY, i] += one[1] * other[1]
    rows[g.W_YZ, i] += 0.5 * (one[1] * other[2] + one[2] * other[1])
    rows[g.W_ZZ, i] += one[2] * other[2]


@formula
def _equations_by_unknowns(swivel: Swivel, at: Exit, force: Vector) -> tuple[Vector, Vector, Vector]:
    """Derivatives of the three equations of the exit by psi, by the swivel angle and by the free length.

    The equations: F.e_rho = 0, v F.e_s - k e_s.z = 0, and the sum of all lengths. `force`: F at the exit point [N].
    """
    x, y, z = force
    w, radius, rz, sz, nz = swivel.weight, swivel.radius, at.rz, at.sz, swivel.z
    along = x * swivel.x + y * swivel.y + z * swivel.z
    outward = x * at.rx + y * at.ry + z * at.rz
    sideways = x * at.sx + y * at.sy + z * at.sz
    tension = math.sqrt(x * x + y * y + z * z)
    zeta, _integral = _height(swivel, rz, at.sine, at.cosine, at.wrap)
    e, entering, drawn = _strains(swivel, tension, zeta)
    beta, v = w * radius / swivel.stiffness, radius * (1.0 - at.cosine)
    k = w * radius * radius * (at.wrap - at.sine) / e
    bends = _by_stretch(swivel, entering, drawn)
    up = at.sine * rz + at.cosine * nz  # t.z
    cube = e * e * e
    lag = at.wrap * (1.0 - at.cosine) - (at.wrap - at.sine)
    turning = -v * outward + k * rz
    return (
        (outward * at.sine + along * at.cosine, -at.cosine * sideways, -w * (at.sine * nz - at.cosine * rz)),
        (
            radius * at.sine * sideways - w * radius * v / e * sz,
            turning if abs(turning) > TINY else -1.0,  # an eyelet, or a cable along its axis: any swivel angle
            -w * sz * (v + k / (e * swivel.stiffness) * z / tension),
        ),
        (
            radius / e + radius * beta * at.wrap * up / cube - 2.0 * beta * bends * up,
            sz * beta * (radius * lag / cube - 2.0 * bends * (1.0 - at.cosine)),
            1.0 - w * _length_by_tension(swivel, at, tension) * z / tension,
        ),
    )


@formula
def _by_stretch(swivel: Swivel, entering: float, drawn: float) -> float:
    """Lambda [m]: the dead length's derivative is 2 lambda E per change of the stretch E at the exit point."""
    total = entering + drawn
    return -swivel.dead / (total * total) * (1.0 / entering + 1.0 / drawn)


@formula
def _length_by_tension(swivel: Swivel, at: Exit, tension: float) -> float:
    """Derivative of the unstrained length between exit point and drum by the tension at the exit point [m/N]."""
    radius = swivel.radius
    zeta, integral = _height(swivel, at.rz, at.sine, at.cosine, at.wrap)
    e, entering, drawn = _strains(swivel, tension, zeta)
    square = e * e
    falls = 3.0 * radius * swivel.weight * radius / swivel.stiffness * integral / (square * square)
    return (2.0 * _by_stretch(swivel, entering, drawn) * e - radius * at.wrap / square - falls) / swivel.stiffness


@kernel
def fill_compliance(swivel: Swivel, at: Exit, end: Vector, free: float, rows: Array, i: int) -> None:
    """Fill the compliance C and dB/dL of cable `i`, world axes. `end`: force at the platform end [N]."""
    x, y, z = end[0], end[1], end[2] - swivel.weight * free
    tension = math.sqrt(x * x + y * y + z * z)
    a, b, c = _inverse_of_three(*_equations_by_unknowns(swivel, at, (x, y, z)))
    e, v = 1.0 + tension / swivel.stiffness, swivel.radius * (1.0 - at.cosine)
    ux, uy, uz = x / tension, y / tension, z / tension  # F/T
    # derivatives of the three equations by F: e_rho, `second` and `third`
    moment = swivel.weight * swivel.radius * swivel.radius * (at.wrap - at.sine) / (e * e * swivel.stiffness) * at.sz
    by_tension = _length_by_tension(swivel, at, tension)
    px, py, pz = (
        at.sine * swivel.x - at.cosine * at.rx,
        at.sine * swivel.y - at.cosine * at.ry,
        at.sine * swivel.z - at.cosine * at.rz,
    )
    qx, qy, qz = v * at.sx + moment * ux, v * at.sy + moment * uy, v * at.sz + moment * uz
    turn = (
        -(a[0] * px + a[1] * qx + a[2] * by_tension * ux),
        -(a[0] * py + a[1] * qy + a[2] * by_tension * uy),
        -(a[0] * pz + a[1] * qz + a[2] * by_tension * uz),
    )
    swing = (
        -(b[0] * px + b[1] * qx + b[2] * by_tension * ux),
        -(b[0] * py + b[1] * qy + b[2] * by_tension * uy),
        -(b[0] * pz + b[1] * qz + b[2] * by_tension * uz),
    )
    grow = (
        -(c[0] * px + c[1] * qx + c[2] * by_tension * ux),
        -(c[0] * py + c[1] * qy + c[2] * by_tension * uy),
        -(c[0] * pz + c[1] * qz + c[2] * by_tension * uz),
    )
    radius = swivel.radius
    tx, ty, tz = (
        radius * (at.sine * at.rx + at.cosine * swivel.x),
        radius * (at.sine * at.ry + at.cosine * swivel.y),
        radius * (at.sine * at.rz + at.cosine * swivel.z),
    )
    for k in range(6):
        rows[g.W_XX + k, i] = 0.0
    _add_product(rows, i, (tx, ty, tz), turn)
    _add_product(rows, i, (v * at.sx, v * at.sy, v * at.sz), swing)
    _add_product(rows, i, (e * ux, e * uy, e * uz), grow)
    rows[g.LONGER_X, i] = tx * a[2] + v * at.sx * b[2] + e * ux * c[2]
    rows[g.LONGER_Y, i] = ty * a[2] + v * at.sy * b[2] + e * uy * c[2]
    rows[g.LONGER_Z, i] = tz * a[2] + v * at.sz * b[2] + e * uz * c[2]
    _add_free_span(swivel, end, free, rows, i)


@formula
def _add_free_span(swivel: Swivel, end: Vector, free: float, rows: Array, i: int) -> None:
    """Add the compliance of the free span to that of cable `i`."""
    horizontal = math.sqrt(end[0] * end[0] + end[1] * end[1])
    c, s = (end[0] / horizontal, end[1] / horizontal) if horizontal > 0.0 else (1.0, 0.0)
    xx, xz, zz, across = free_compliance(horizontal, end[2], free, swivel.weight, swivel.stiffness)
    rows[g.W_XX, i] += xx * c * c + across * s * s
    rows[g.W_XY, i] += (xx - across) * c * s
    rows[g.W_XZ, i] += xz * c
    rows[g.W_YY, i] += xx * s * s + across * c * c
    rows[g.W_YZ, i] += xz * s
    rows[g.W_ZZ, i] += zz


@kernel
def fill_stiffness(rows: Array, i: int) -> None:
    """Replace the compliance of cable `i` by the stiffness K [N/m], and dB/dL by dT/dL = -K dB/dL [N/m]."""
    xx, xy, xz = rows[g.W_XX, i], rows[g.W_XY, i], rows[g.W_XZ, i]
    yy, yz, zz = rows[g.W_YY, i], rows[g.W_YZ, i], rows[g.W_ZZ, i]
    a, b, c = _inverse_of_three((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    rows[g.W_XX, i], rows[g.W_XY, i], rows[g.W_XZ, i] = a
    rows[g.W_YY, i], rows[g.W_YZ, i], rows[g.W_ZZ, i] = b[1], b[2], c[2]
    x, y, z = rows[g.LONGER_X, i], rows[g.LONGER_Y, i], rows[g.LONGER_Z, i]
    rows[g.LONGER_X, i] = -(a[0] * x + a[1] * y + a[2] * z)
    rows[g.LONGER_Y, i] = -(b[0] * x + b[1] * y + b[2] * z)
    rows[g.LONGER_Z, i] = -(c[0] * x + c[1] * y + c[2] * z)


@kernel
def _end_of(swivel: Swivel, length: float, free: float, force: Vector) -> tuple[float, float, float, float]:
    """Position of the platform end [m] relative to the anchor, and the free length [m], at a force on the end.

    `length`: unstrained length off the drum [m]. `free`: guess of the free length [m].
    """
    x, y, z = force
    at = exit_of(swivel, x, y, z - swivel.weight * free)
    for _ in range(LENGTHS):
        new = max(length - (at.wrapped + at.dead), SHORTEST * length)
        change = abs(new - free)
        free = new
        if change <= STILL * length:
            break
        at = exit_of(swivel, x, y, z - swivel.weight * free)
    px, py, pz = point_of(swivel, at)
    horizontal = math.sqrt(x * x + y * y)
    span, rise = catenary_end(horizontal, z, free, swivel.weight, swivel.stiffness)
    share = span / horizontal if horizontal > 0.0 else 0.0
    return px + share * x, py + share * y, pz + rise, free


@kernel
def _force_at(
    swivel: Swivel, end: Vector, length: float, start: tuple[float, float, float, float], rows: Array, i: int
) -> tuple[float, float, float, float, float]:
    """Force at the platform end, free length, and the remaining error of the end relative to the length.

    `end`: platform end relative to the anchor. `start`: guess of force [N] and free length [m]. Damped Newton steps.
    """
    x, y, z, free = start
    bx, by, bz, free = _end_of(swivel, length, free, (x, y, z))
    ex, ey, ez = end[0] - bx, end[1] - by, end[2] - bz
    miss = math.sqrt(ex * ex + ey * ey + ez * ez) / length
    for _ in range(ROUNDS):
        if miss <= CLOSED:
            break
        at = exit_of(swivel, x, y, z - swivel.weight * free)
        fill_compliance(swivel, at, (x, y, z), free, rows, i)
        fill_stiffness(rows, i)
        dx = _product(rows, i, g.W_XX, g.W_XY, g.W_XZ, (ex, ey, ez))
        dy = _product(rows, i, g.W_XY, g.W_YY, g.W_YZ, (ex, ey, ez))
        dz = _product(rows, i, g.W_XZ, g.W_YZ, g.W_ZZ, (ex, ey, ez))
        full = dx * ex + dy * ey + dz * ez  # the end comes nearer along the step, as B is the gradient of a convex W
        share, taken, before = 1.0, free, miss
        for _ in range(SHORTENINGS):
            bx, by, bz, taken = _end_of(swivel, length, free, (x + share * dx, y + share * dy, z + share * dz))
            ex, ey, ez = end[0] - bx, end[1] - by, end[2] - bz
            miss = math.sqrt(ex * ex + ey * ey + ez * ez) / length
            rest = dx * ex + dy * ey + dz * ez
            if rest >= -0.5 * full or miss <= MISSED:
                break
            share *= max(full / (full - rest), 0.1)
        x, y, z, free = x + share * dx, y + share * dy, z + share * dz, taken
        if miss <= MISSED and miss >= 0.01 * before:
            break
    return x, y, z, free, miss


@kernel
def solve_swivel(model: Model, cables: Array, rows: Array, i: int) -> None:
    """Fill force, plane, free span and exit of cable `i` from its tangent and its length.

    The rows contain the tangent from the pulley to the platform end, which is replaced by the chord of the free span.
    """
    gravity = model.gravity if model.code == codes.CATENARY else 0.0
    swivel = swivel_at(cables, i, gravity)
    length = rows[g.LENGTH, i]
    span, rise = rows[g.SPAN, i], rows[g.RISE, i]
    cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    straight = Swivel(swivel.x, swivel.y, swivel.z, swivel.radius, 0.0, 0.0, 0.0, swivel.stiffness)
    at = exit_of(straight, span * cx, span * cy, rise)
    px, py, pz = point_of(straight, at)
    end = (px + span * cx, py + span * cy, pz + rise)
    behind = swivel.radius * at.wrap + swivel.dead
    free = length
    miss, status = math.inf, codes.CABLE_SOLVED
    x, y, z = 0.0, 0.0, 0.0
    if swivel.weight > 0.0 and not math.isnan(rows[g.PARAMETER, i]):
        x, y, z = _predicted(end, length, rows, i)
        before = abs(rows[g.FORCE_X, i]) + abs(rows[g.FORCE_Y, i]) + abs(rows[g.FORCE_Z, i])
        change = abs(x - rows[g.FORCE_X, i]) + abs(y - rows[g.FORCE_Y, i]) + abs(z - rows[g.FORCE_Z, i])
        if change <= NEARBY * before:
            last = rows[g.FREE_LENGTH, i] + (length - rows[g.PARAMETER, i])
            x, y, z, free, miss = _force_at(swivel, end, length, (x, y, z, last), rows, i)
    if not miss <= MISSED:
        free = max(length - behind, SHORTEST * length)
        soft = Material(cables[i, tables.DENSITY], swivel.stiffness / (1.0 + behind / free))
        force, status = from_length(Model(model.code, 0.0, 0.0, gravity), span, rise, soft, free)
        x, y, z = force.horizontal * cx, force.horizontal * cy, force.vertical
        miss = 0.0
        if force.tension > 0.0 or swivel.weight > 0.0:
            x, y, z, free, miss = _force_at(swivel, end, length, (x, y, z, free), rows, i)
    rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i] = x, y, z
    rows[g.END_AT_X, i], rows[g.END_AT_Y, i], rows[g.END_AT_Z, i] = end
    rows[g.PARAMETER, i] = length if miss <= MISSED else math.nan
    rows[g.STATUS, i] = status if miss <= MISSED else codes.CABLE_NOT_CONVERGED
    _fill_rows(swivel, end, free, rows, i)


@formula
def _predicted(end: Vector, length: float, rows: Array, i: int) -> Vector:
    """First-order prediction of the force [N] at a new platform end and length, from the last force and stiffness."""
    x, y, z = end[0] - rows[g.END_AT_X, i], end[1] - rows[g.END_AT_Y, i], end[2] - rows[g.END_AT_Z, i]
    more = length - rows[g.PARAMETER, i]
    return (
        rows[g.FORCE_X, i] + _product(rows, i, g.W_XX, g.W_XY, g.W_XZ, (x, y, z)) + rows[g.LONGER_X, i] * more,
        rows[g.FORCE_Y, i] + _product(rows, i, g.W_XY, g.W_YY, g.W_YZ, (x, y, z)) + rows[g.LONGER_Y, i] * more,
        rows[g.FORCE_Z, i] + _product(rows, i, g.W_XZ, g.W_YZ, g.W_ZZ, (x, y, z)) + rows[g.LONGER_Z, i] * more,
    )


@formula
def _product(rows: Array, i: int, a: int, b: int, c: int, vector: Vector) -> float:
    """Product of three rows of cable `i` and a vector."""
    return rows[a, i] * vector[0] + rows[b, i] * vector[1] + rows[c, i] * vector[2]


@formula
def _fill_rows(swivel: Swivel, end: Vector, free: float, rows: Array, i: int) -> None:
    """Fill plane, free span, exit and force of cable `i` from its force in world axes. `end`: from the anchor [m]."""
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
    down = z - swivel.weight * free
    leaving, horizontal = math.sqrt(x * x + y * y + down * down), math.sqrt(x * x + y * y)
    cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    # a slack cable without weight leaves its pulley along the tangent
    at = exit_of(swivel, x, y, down)
    if leaving == 0.0:
        at = exit_of(swivel, rows[g.SPAN, i] * cx, rows[g.SPAN, i] * cy, rows[g.RISE, i])
        rows[g.FREE_LENGTH, i] = rows[g.LENGTH, i] - (at.wrapped + at.dead)
    if horizontal > 0.0:
        cx, cy = x / horizontal, y / horizontal
    px, py, pz = point_of(swivel, at)
    span, rise = cx * (end[0] - px) + cy * (end[1] - py), end[2] - pz
    chord = math.sqrt(span * span + rise * rise)
    tension = 0.0
    if leaving > 0.0:
        tension = chord / free_compliance(horizontal, z, free, swivel.weight, swivel.stiffness)[3]
    rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i] = cx, cy
    rows[g.SPAN, i], rows[g.RISE, i], rows[g.CHORD, i] = span, rise, chord
    rows[g.SINE, i], rows[g.COSINE, i] = rise / chord, span / chord
    rows[g.FREE_SPAN, i], rows[g.FREE_RISE, i], rows[g.FREE_LENGTH, i] = span, rise, free
    rows[g.HORIZONTAL, i], rows[g.VERTICAL, i], rows[g.TENSION, i] = horizontal, z, tension
    rows[g.WRAP, i], rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i] = at.wrap, at.sine, at.cosine
    rows[g.LEAVING, i], rows[g.WRAPPED, i] = leaving, at.wrapped


@kernel
def stiffness_of_swivel(model: Model, cables: Array, rows: Array, i: int) -> None:
    """Fill stiffness and dT/dL of cable `i` in world axes, after `solve_swivel`. Zero for a cable without force."""
    for k in range(6):
        rows[g.W_XX + k, i] = 0.0
    rows[g.LONGER_X, i] = rows[g.LONGER_Y, i] = rows[g.LONGER_Z, i] = 0.0
    if rows[g.LEAVING, i] > 0.0:
        swivel = swivel_at(cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
        free = rows[g.FREE_LENGTH, i]
        x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
        fill_compliance(swivel, exit_of(swivel, x, y, z - swivel.weight * free), (x, y, z), free, rows, i)
        fill_stiffness(rows, i)


@formula
def rise_of_exit(swivel: Swivel, x: float, y: float, z: float) -> Vector:
    """Derivative of the height of the exit point by the force (`x`, `y`, `z`) at the exit point [m/N]."""
    nx, ny, nz = swivel.x, swivel.y, swivel.z
    along = x * nx + y * ny + z * nz
    rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
    across = math.sqrt(rx * rx + ry * ry + rz * rz)
    inverse, share = 1.0 / max(across, TINY), 1.0 / max(math.sqrt(across * across + along * along), TINY)
    rx, ry, rz = rx * inverse, ry * inverse, rz * inverse
    sine, cosine = across * share, along * share
    sx, sy, sz = ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx
    turn = -swivel.radius * share * (sine * rz + cosine * nz)
    # v/|F_p| = R tan(psi/2)/T is regular for a cable along its axis
    swing = swivel.radius * share * math.tan(0.5 * math.atan2(across, along)) * sz
    return (
        turn * (sine * nx - cosine * rx) + swing * sx,
        turn * (sine * ny - cosine * ry) + swing * sy,
        turn * (sine * nz - cosine * rz) + swing * sz,
    )


DATA_STEP = 1e-4  # relative step of the differences by cable data


@kernel
def force_slopes_of_swivel(model: Model, cables: Array, rows: Array, i: int, slopes: Array) -> None:
    """Fill dT/dL and the derivatives of the force of cable `i` by density, EA, R and dead length, (DATA, m, 3).

    The motion of the platform end at a fixed force is a central difference; its relative error is about 1e-8.
    """
    s = swivel_at(cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    gravity = s.weight / cables[i, tables.DENSITY] if s.weight > 0.0 else 0.0
    length, free = rows[g.LENGTH, i], rows[g.FREE_LENGTH, i]
    force = (rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i])
    slopes[0, i, 0], slopes[0, i, 1], slopes[0, i, 2] = rows[g.LONGER_X, i], rows[g.LONGER_Y, i], rows[g.LONGER_Z, i]
    for k in range(1, 5):
        slopes[k, i] = 0.0
        step = DATA_STEP * (s.weight if k == 1 else s.stiffness if k == 2 else s.radius if k == 3 else length)
        if step == 0.0 or rows[g.LEAVING, i] == 0.0:
            continue
        w, ea = step if k == 1 else 0.0, step if k == 2 else 0.0
        r, d = step if k == 3 else 0.0, step if k == 4 else 0.0
        more = Swivel(s.x, s.y, s.z, s.radius + r, s.dead + d, s.rise, s.weight + w, s.stiffness + ea)
        less = Swivel(s.x, s.y, s.z, s.radius - r, s.dead - d, s.rise, s.weight - w, s.stiffness - ea)
        ax, ay, az, _free = _end_of(more, length, free, force)
        bx, by, bz, _free = _end_of(less, length, free, force)
        per = -0.5 / step * (gravity if k == 1 else 1.0)
        x, y, z = per * (ax - bx), per * (ay - by), per * (az - bz)
        slopes[k, i, 0] = _product(rows, i, g.W_XX, g.W_XY, g.W_XZ, (x, y, z))
        slopes[k, i, 1] = _product(rows, i, g.W_XY, g.W_YY, g.W_YZ, (x, y, z))
        slopes[k, i, 2] = _product(rows, i, g.W_XZ, g.W_YZ, g.W_ZZ, (x, y, z))


@kernel
def energy_of_swivel(model: Model, cables: Array, rows: Array, i: int) -> float:
    """Energy [J] of the cable between exit point and drum, plus energy to lift the free span to the exit point."""
    swivel = swivel_at(cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    free, radius = rows[g.FREE_LENGTH, i], swivel.radius
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i] - swivel.weight * free
    tension = math.sqrt(x * x + y * y + z * z)
    at = exit_of(swivel, x, y, z)
    zeta, integral = _height(swivel, at.rz, at.sine, at.cosine, at.wrap)
    strained, entering, drawn = _strains(swivel, tension, zeta)
    whole = tension + 0.5 * tension * tension / swivel.stiffness - swivel.weight * radius * zeta  # H
    # strains at the entry and at the drum, without cancellation
    strain, weighs = tension / swivel.stiffness, 2.0 * swivel.weight / swivel.stiffness
    gained = strain * (2.0 + strain) - weighs * radius * zeta
    first, last = gained / (1.0 + entering), (gained - weighs * swivel.rise) / (1.0 + drawn)
    total = first + last
    on_run = total + total + total + 2.0 * (first * first + first * last + last * last)
    return (
        swivel.weight * free * radius * zeta
        + radius * (tension * at.wrap - swivel.weight * radius * integral / strained)
        + swivel.stiffness * swivel.dead * on_run / (3.0 * (2.0 + total))
        - whole * (at.wrapped + at.dead)
    )


@entry
def exits_of_forces(robots: Array, gravity: Array, forces: Array, exits: Array) -> None:
    """Exit points of cables with swivel axes.

    Args:
        robots: cable_table with swivel axes, (1 or N, m, SWIVEL_COLUMNS).
        gravity: Gravity for the weight of the cables [m/s^2], (1 or N,); 0 for cables without weight.
        forces: Forces at the exit points, toward the platform ends [N], (N, m, 3).
        exits: Filled with the exit points in world axes [m], the wrap angle [rad], the unstrained length on the pulley
            and the unstrained dead length [m], (N, m, 6).
    """
    for p in range(forces.shape[0]):
        cables = robots[min(p, robots.shape[0] - 1)]
        for i in range(cables.shape[0]):
            swivel = swivel_at(cables, i, gravity[min(p, gravity.shape[0] - 1)])
            at = exit_of(swivel, forces[p, i, 0], forces[p, i, 1], forces[p, i, 2])
            x, y, z = point_of(swivel, at)
            exits[p, i, 0] = cables[i, tables.FRAME_X] + x
            exits[p, i, 1] = cables[i, tables.FRAME_Y] + y
            exits[p, i, 2] = cables[i, tables.FRAME_Z] + z
            exits[p, i, 3], exits[p, i, 4], exits[p, i, 5] = at.wrap, at.wrapped, at.dead

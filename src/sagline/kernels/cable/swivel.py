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
from sagline.kernels.algebra.functions import (
    EXCESS_LIMIT,
    angle,
    atanhc_excess,
    atanhc_excess_polynomial,
    cosh_polynomial,
    sinhc_polynomial,
)
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.models import (
    CLOSE,
    ORDINARY,
    SMALL_HALLEY_STEP,
    catenary_by_weight,
    catenary_end,
    catenary_from_length,
    from_length,
    halley_step,
    relative_excess,
    slack_series,
)
from sagline.kernels.cable.pulley import is_aboard, pulley_at
from sagline.kernels.cable.terms import Material, Model, PlaneVector
from sagline.kernels.jit import entry, formula, glue, independent, kernel

Vector = tuple[float, float, float]

PASSES = 12  # largest number of passes of the equivalent cable; a taut cable needs two
ROUNDS = 60  # largest number of Newton steps for one cable
NEAR = 1e-13  # error of the platform end that a correction of the force removes, relative to the length
CLOSED = 3e-15  # error of the platform end that counts as zero, relative to the cable's length
MISSED = 1e-12  # largest accepted error of the platform end, relative to the cable's length
SHORTENINGS = 30  # of one Newton step
STILL = 1e-10  # change of the free length, relative to the length, after which its error is far below 1e-13
LENGTHS = 12  # passes for the free length
SHORTEST = 1e-3  # shortest free length, relative to the whole length
TINY = 1e-30  # also a single-precision number
DATA = 5  # numbers of a cable by which the derivatives are computed
SLOPES = DATA + 3  # rows of `slopes_of_swivel`


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
def _swivel_about(cables: Array, i: int, gravity: float, x: float, y: float, z: float, rise: float) -> Swivel:
    """Pulley and material of cable `i` of a cable_table, with the swivel axis (`x`, `y`, `z`)."""
    pulley, weight = pulley_at(cables, i), cables[i, tables.DENSITY] * gravity
    return Swivel(x, y, z, pulley.radius, pulley.dead, rise, weight, cables[i, tables.STIFFNESS])


@formula
def swivel_at(cables: Array, i: int, gravity: float) -> Swivel:
    """Swivel axis, pulley and material of cable `i` of a cable_table with swivel axes; for a pulley at the frame."""
    x, y, z = cables[i, tables.AXIS_X], cables[i, tables.AXIS_Y], cables[i, tables.AXIS_Z]
    return _swivel_about(cables, i, gravity, x, y, z, pulley_at(cables, i).rise)


@formula
def swivel_in(rows: Array, cables: Array, i: int, gravity: float) -> Swivel:
    """`swivel_at` after `cable_geometry`, also for a pulley on the platform."""
    x, y, z = rows[g.AXIS_X, i], rows[g.AXIS_Y, i], rows[g.AXIS_Z, i]
    return _swivel_about(cables, i, gravity, x, y, z, rows[g.DRUM_RISE, i])


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


@formula
def _exit_of(swivel: Swivel, x: float, y: float, z: float) -> Exit:
    """Exit point of a cable whose force at the exit point is (`x`, `y`, `z`), toward the platform end [N]."""
    # Without weight on the pulley, e_r is in the plane of force and axis. The weight turns it by the angle whose
    # tangent is -k e_s.z/(v F.e_r - k e_r.z), with e_r and e_s of this plane. The wrap angle changes by the square of
    # this angle.
    nx, ny, nz = swivel.x, swivel.y, swivel.z
    along = x * nx + y * ny + z * nz
    rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
    square = rx * rx + ry * ry + rz * rz
    across = math.sqrt(square)
    tension = math.sqrt(square + along * along)
    inverse = 1.0 / (across + TINY)  # for a force along the axis, e_r is zero
    rx, ry, rz = rx * inverse, ry * inverse, rz * inverse
    sx, sy, sz = ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx
    inverse = 1.0 / (tension + TINY)
    first, straight_sine, straight_cosine = angle(across + TINY, along), across * inverse, along * inverse
    # numerator and denominator times EA + T
    moment = swivel.weight * swivel.radius * swivel.stiffness * (first - straight_sine)
    slope = (1.0 - straight_cosine) * across * (swivel.stiffness + tension) - moment * rz
    turn = -moment * sz / slope if slope > 0.0 else 0.0
    turn = min(max(turn, -0.5), 0.5)
    square = 1.0 + turn * turn
    root, size = math.sqrt(square), math.sqrt(across * across + along * along * square) + TINY
    inverse = 1.0 / (root * size)
    c, sine, cosine = size * inverse, across * root * inverse, along * square * inverse
    s = turn * c
    less = straight_sine * cosine - straight_cosine * sine  # sine of the decrease of the wrap angle
    square = less * less
    wrap = first - less * (1.0 + square * (1.0 / 6.0 + square * 0.075))
    rx, ry, rz = c * rx + s * sx, c * ry + s * sy, c * rz + s * sz
    sx, sy, sz = ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx
    wrapped, dead = lengths_behind(swivel, rz, (sine, cosine), wrap, tension)
    return Exit(rx, ry, rz, sx, sy, sz, sine, cosine, wrap, wrapped, dead)


@formula
def lengths_behind(
    swivel: Swivel, rz: float, turn: tuple[float, float], wrap: float, tension: float
) -> tuple[float, float]:
    """Unstrained lengths on the pulley and between pulley and drum [m]. `turn`: sine and cosine of psi."""
    zeta, integral = _height(swivel, rz, turn[0], turn[1], wrap)
    strained, entering, drawn = _strains(swivel, tension, zeta)
    inverse = 1.0 / strained
    beta = swivel.weight * swivel.radius / swivel.stiffness
    wrapped = swivel.radius * (wrap + beta * integral * inverse * inverse) * inverse
    return wrapped, 2.0 * swivel.dead / (entering + drawn)


@formula
def _point_of(swivel: Swivel, at: Exit) -> Vector:
    """Position of the exit point relative to the anchor [m]."""
    v, along = swivel.radius * (1.0 - at.cosine), swivel.radius * at.sine
    return v * at.rx + along * swivel.x, v * at.ry + along * swivel.y, v * at.rz + along * swivel.z


@formula
def exit_in(rows: Array, cables: Array, i: int) -> Vector:
    """Position of the exit point relative to the anchor [m], after `solve_swivels`."""
    out, along = 1.0 - rows[g.WRAP_COSINE, i], rows[g.WRAP_SINE, i]
    x = out * rows[g.CENTER_X, i] + along * rows[g.AXIS_X, i]
    y = out * rows[g.CENTER_Y, i] + along * rows[g.AXIS_Y, i]
    z = out * rows[g.CENTER_Z, i] + along * rows[g.AXIS_Z, i]
    radius = pulley_at(cables, i).radius
    return radius * x, radius * y, radius * z


@formula
def _free_compliance(
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
def _combined(p: float, a: Vector, q: float, b: Vector, r: float, c: Vector) -> Vector:
    """The vector p a + q b + r c."""
    return p * a[0] + q * b[0] + r * c[0], p * a[1] + q * b[1] + r * c[1], p * a[2] + q * b[2] + r * c[2]


@formula
def _inverse_of_symmetric(
    xx: float, xy: float, xz: float, yy: float, yz: float, zz: float
) -> tuple[float, float, float, float, float, float]:
    """Inverse of a symmetric matrix (3, 3), with the entries in the order of the arguments."""
    i00, i01, i02 = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    inverse = 1.0 / (xx * i00 + xy * i01 + xz * i02)
    i11, i12, i22 = inverse * (xx * zz - xz * xz), inverse * (xy * xz - xx * yz), inverse * (xx * yy - xy * xy)
    return inverse * i00, inverse * i01, inverse * i02, i11, i12, i22


class _Equations(NamedTuple):
    """Equations for psi, the swivel angle and the free length."""

    # F.e_rho = 0, (v F.e_s - k e_s.z)/R = 0, and the sum of all lengths. F is the force at the exit point, v = R (1 -
    # cos psi), and k e_s.z the moment of the weight on the pulley. The matrix `i` times `inverse` is the inverse of the
    # derivatives of the equations by these unknowns.
    i00: float
    i01: float
    i02: float
    i10: float
    i11: float
    i12: float
    i20: float
    i21: float
    i22: float
    inverse: float
    ux: float  # F/T
    uy: float
    uz: float
    by_tension: float  # derivative of the unstrained length between exit point and drum by T [m/N]
    moment: float  # derivative of k e_s.z/R by T, with the opposite sign
    bends: float  # derivative of the dead length by the square of the stretch [m]
    strained: float
    entering: float
    drawn: float
    zeta: float
    integral: float


@formula
def _equations(swivel: Swivel, at: Exit, x: float, y: float, z: float) -> _Equations:
    """Equations of an exit point with the force (`x`, `y`, `z`) [N]."""
    w, radius, rz, sz, nz = swivel.weight, swivel.radius, at.rz, at.sz, swivel.z
    sine, cosine, wrap = at.sine, at.cosine, at.wrap
    tension = math.sqrt(x * x + y * y + z * z)
    zeta, integral = _height(swivel, rz, sine, cosine, wrap)
    e, entering, drawn = _strains(swivel, tension, zeta)
    soft, inverse = 1.0 / swivel.stiffness, 1.0 / e
    beta, v = w * radius * soft, 1.0 - cosine
    total = 1.0 / (entering + drawn)
    bends = -swivel.dead * total * total * (entering + drawn) / (entering * drawn)
    square, cube = inverse * inverse, inverse * inverse * inverse
    by_tension = (2.0 * bends * e - radius * wrap * square - 3.0 * radius * beta * integral * cube * inverse) * soft
    up = sine * rz + cosine * nz  # t.z
    slip = wrap - sine
    k = w * radius * slip * inverse
    moment = k * inverse * soft * sz
    unit = 1.0 / tension
    ux, uy, uz = x * unit, y * unit, z * unit
    along = x * swivel.x + y * swivel.y + z * nz
    outward = x * at.rx + y * at.ry + z * rz
    sideways = x * at.sx + y * at.sy + z * at.sz
    turning = -v * outward + k * rz
    # derivatives of the equations by the unknowns, row by row
    a0, a1, a2 = outward * sine + along * cosine, -cosine * sideways, -w * (sine * nz - cosine * rz)
    b0 = sine * sideways - w * radius * v * inverse * sz
    b1 = turning if abs(turning) > TINY else -1.0  # a cable along its axis: any swivel angle
    b2 = -w * (sz * v + moment * uz)
    c0 = radius * inverse + radius * beta * wrap * up * cube - 2.0 * beta * bends * up
    c1 = sz * beta * (radius * (wrap * v - slip) * cube - 2.0 * bends * v)
    c2 = 1.0 - w * by_tension * uz
    i00, i01, i02 = b1 * c2 - b2 * c1, a2 * c1 - a1 * c2, a1 * b2 - a2 * b1
    i10, i11, i12 = b2 * c0 - b0 * c2, a0 * c2 - a2 * c0, a2 * b0 - a0 * b2
    i20, i21, i22 = b0 * c1 - b1 * c0, a1 * c0 - a0 * c1, a0 * b1 - a1 * b0
    inverse = 1.0 / (a0 * i00 + a1 * i10 + a2 * i20)
    return _Equations(
        i00, i01, i02, i10, i11, i12, i20, i21, i22, inverse, ux, uy, uz, by_tension, moment, bends, e, entering, drawn,
        zeta, integral,
    )  # fmt: skip


@formula
def _motion_by(swivel: Swivel, at: Exit, q: _Equations, right: Vector) -> tuple[Vector, Vector]:
    """Motion of the platform end [m] by a change of the right sides of the equations, at a fixed force on the end."""
    # The second result contains the changes of psi [rad], of the swivel angle [rad] and of the free length [m].
    one, two, three = right
    psi = q.inverse * (q.i00 * one + q.i01 * two + q.i02 * three)
    sigma = q.inverse * (q.i10 * one + q.i11 * two + q.i12 * three)
    free = q.inverse * (q.i20 * one + q.i21 * two + q.i22 * three)
    turn, swing, grow = swivel.radius * psi, swivel.radius * (1.0 - at.cosine) * sigma, q.strained * free
    tx, ty = at.sine * at.rx + at.cosine * swivel.x, at.sine * at.ry + at.cosine * swivel.y
    tangent = tx, ty, at.sine * at.rz + at.cosine * swivel.z
    end = _combined(turn, tangent, swing, (at.sx, at.sy, at.sz), grow, (q.ux, q.uy, q.uz))
    return end, (psi, sigma, free)


@formula
def _forces_on(swivel: Swivel, at: Exit, q: _Equations) -> tuple[Vector, Vector, Vector]:
    """Derivatives of the right sides of the equations by the force at the exit point, world axes."""
    v, m, s = 1.0 - at.cosine, q.moment, q.by_tension
    return (
        (at.cosine * at.rx - at.sine * swivel.x, -v * at.sx - m * q.ux, -s * q.ux),
        (at.cosine * at.ry - at.sine * swivel.y, -v * at.sy - m * q.uy, -s * q.uy),
        (at.cosine * at.rz - at.sine * swivel.z, -v * at.sz - m * q.uz, -s * q.uz),
    )


@kernel
def _fill_stiffness(swivel: Swivel, at: Exit, end: Vector, free: float, rows: Array, i: int) -> None:
    """Fill stiffness K [N/m] and dT/dL = -K dB/dL [N/m] of cable `i`. `end`: force at the platform end [N]."""
    x, y, z = end[0], end[1], end[2] - swivel.weight * free
    q = _equations(swivel, at, x, y, z)
    by_x, by_y, by_z = _forces_on(swivel, at, q)
    (mxx, mxy, mxz), _ = _motion_by(swivel, at, q, by_x)
    (myx, myy, myz), _ = _motion_by(swivel, at, q, by_y)
    (mzx, mzy, mzz), _ = _motion_by(swivel, at, q, by_z)
    (cx, cy, cz), _ = _motion_by(swivel, at, q, (0.0, 0.0, 1.0))
    # the compliance, with the free span
    horizontal = math.sqrt(x * x + y * y)
    c, s = (x / horizontal, y / horizontal) if horizontal > 0.0 else (1.0, 0.0)
    free_xx, free_xz, free_zz, across = _free_compliance(horizontal, end[2], free, swivel.weight, swivel.stiffness)
    xx = mxx + (free_xx * c * c + across * s * s)
    yy = myy + (free_xx * s * s + across * c * c)
    zz = mzz + free_zz
    xy = 0.5 * (mxy + myx) + (free_xx - across) * c * s
    xz = 0.5 * (mxz + mzx) + free_xz * c
    yz = 0.5 * (myz + mzy) + free_xz * s
    i00, i01, i02, i11, i12, i22 = _inverse_of_symmetric(xx, xy, xz, yy, yz, zz)
    rows[g.W_XX, i], rows[g.W_XY, i], rows[g.W_XZ, i] = i00, i01, i02
    rows[g.W_YY, i], rows[g.W_YZ, i], rows[g.W_ZZ, i] = i11, i12, i22
    rows[g.LONGER_X, i] = -(i00 * cx + i01 * cy + i02 * cz)
    rows[g.LONGER_Y, i] = -(i01 * cx + i11 * cy + i12 * cz)
    rows[g.LONGER_Z, i] = -(i02 * cx + i12 * cy + i22 * cz)


@kernel
def _end_of(swivel: Swivel, length: float, free: float, force: Vector) -> tuple[float, float, float, float]:
    """Position of the platform end [m] relative to the anchor, and the free length [m], at a force on the end."""
    # `length`: unstrained length off the drum [m]. `free`: guess of the free length [m].
    x, y, z = force
    at = _exit_of(swivel, x, y, z - swivel.weight * free)
    for _ in range(LENGTHS):
        new = max(length - (at.wrapped + at.dead), SHORTEST * length)
        change = abs(new - free)
        free = new
        if change <= STILL * length:
            break
        at = _exit_of(swivel, x, y, z - swivel.weight * free)
    px, py, pz = _point_of(swivel, at)
    horizontal = math.sqrt(x * x + y * y)
    span, rise = catenary_end(horizontal, z, free, swivel.weight, swivel.stiffness)
    share = span / horizontal if horizontal > 0.0 else 0.0
    return px + share * x, py + share * y, pz + rise, free


@kernel
def _force_at(
    swivel: Swivel, end: Vector, length: float, start: tuple[float, float, float, float], rows: Array, i: int
) -> tuple[float, float, float, float, float]:
    """Force at the platform end, free length, and the remaining error of the end relative to the length."""
    # `end`: platform end relative to the anchor. `start`: guess of force [N] and free length [m]. Damped Newton steps.
    x, y, z, free = start
    bx, by, bz, free = _end_of(swivel, length, free, (x, y, z))
    ex, ey, ez = end[0] - bx, end[1] - by, end[2] - bz
    miss = math.sqrt(ex * ex + ey * ey + ez * ez) / length
    for _ in range(ROUNDS):
        if miss <= CLOSED:
            break
        at = _exit_of(swivel, x, y, z - swivel.weight * free)
        _fill_stiffness(swivel, at, (x, y, z), free, rows, i)
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


@formula
def _equivalent(swivel: Swivel, rows: Array, i: int) -> tuple[Vector, float, float]:
    """Chord (x, y, z), length and EA of the equivalent cable `i`, which has no pulley."""
    length, behind = rows[g.LENGTH, i], rows[g.TO_DRUM, i]
    asked = max(length - behind, SHORTEST * length)
    x = rows[g.SPAN, i] * rows[g.AZIMUTH_X, i] + rows[g.AWAY_X, i]
    y = rows[g.SPAN, i] * rows[g.AZIMUTH_Y, i] + rows[g.AWAY_Y, i]
    z = rows[g.RISE, i] + (behind * (0.5 * swivel.weight) * asked / swivel.stiffness + rows[g.AWAY_Z, i])
    return (x, y, z), asked, swivel.stiffness / (1.0 + behind / asked)


@formula
def _fill_equivalent_force(swivel: Swivel, rows: Array, i: int) -> None:
    """Fill the force at the exit point of the equivalent cable `i`, which has no pulley, and its parameter h."""
    (x, y, z), asked, soft = _equivalent(swivel, rows, i)
    half = 0.5 * swivel.weight
    square = x * x + y * y
    span = math.sqrt(square)
    kappa, excess = half * asked / soft, relative_excess(span, z, asked)
    inverse = 1.0 / asked
    xi2, zeta2 = square * inverse * inverse, z * z * inverse * inverse
    first = halley_step(rows[g.PARAMETER, i], xi2, zeta2, kappa, excess)
    h = halley_step(first, xi2, zeta2, kappa, excess)
    near = abs(first - rows[g.PARAMETER, i]) <= CLOSE * (first + kappa) and 0.0 < h < ORDINARY
    near = near and abs(h - first) <= SMALL_HALLEY_STEP * (h + kappa)
    share, y2 = half / (h + kappa), h * h
    tangent = h * sinhc_polynomial(y2) / cosh_polynomial(y2)
    rows[g.PARAMETER, i] = h if near else math.nan
    rows[g.FORCE_X, i], rows[g.FORCE_Y, i] = share * x, share * y
    rows[g.FORCE_Z, i] = half * (z / (tangent + kappa) - asked)


@kernel
def _fill_any_equivalent_force(swivel: Swivel, rows: Array, i: int) -> None:
    """`_fill_equivalent_force` for any sag, without a previous parameter."""
    (x, y, z), asked, soft = _equivalent(swivel, rows, i)
    span, half = math.sqrt(x * x + y * y), 0.5 * swivel.weight
    force, _status = catenary_from_length(span, z, asked, swivel.weight, soft)
    chord = math.sqrt(span * span + z * z)
    rows[g.PARAMETER, i] = half * (chord / force.tension - asked / soft) if force.tension > 0.0 else math.nan
    share = force.horizontal / span if span > 0.0 else 0.0
    rows[g.FORCE_X, i], rows[g.FORCE_Y, i] = share * x, share * y
    rows[g.FORCE_Z, i] = force.vertical - swivel.weight * asked


@formula
def _correct(swivel: Swivel, rows: Array, i: int) -> None:
    """Correct the equivalent cable `i` by the error of the platform end; its force as well if the error is small."""
    at = _stored(swivel, rows, i)
    length, free = rows[g.LENGTH, i], rows[g.FREE_LENGTH, i]
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
    tension = math.sqrt(x * x + y * y + z * z)
    z += swivel.weight * free
    turn = 2.0 / (tension + math.sqrt(x * x + y * y + z * z) + TINY)
    give = free * (1.0 / swivel.stiffness + turn * rows[g.SERIES, i])
    lift = free * (1.0 / swivel.stiffness + turn)
    px, py, pz = _point_of(swivel, at)
    ux, uy, uz = rows[g.END_AT_X, i] - px, rows[g.END_AT_Y, i] - py, rows[g.END_AT_Z, i] - pz
    ex, ey, ez = ux - give * x, uy - give * y, uz - lift * (z - 0.5 * swivel.weight * free)
    miss, before = math.sqrt(ex * ex + ey * ey + ez * ez) / length, rows[g.MISS, i]
    # stiffness of the equivalent cable along its chord, minus that normal to it; the pulley is softer sideways
    inverse = 1.0 / math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux * inverse, uy * inverse, uz * inverse
    normal = 1.0 / give
    sag = 0.5 * swivel.weight * give * free * inverse
    along = (free + rows[g.TO_DRUM, i]) / swivel.stiffness + give * sag * sag * (ux * ux + uy * uy) * (1.0 / 3.0)
    along = 1.0 / along - normal
    soft = swivel.radius * at.sine / ((1.0 + at.cosine) * tension)
    tilt = ux * at.sx + uy * at.sy + uz * at.sz
    load = normal * (ex * at.sx + ey * at.sy + ez * at.sz) + along * tilt * (ex * ux + ey * uy + ez * uz)
    share = soft * load / (1.0 + soft * (normal + along * tilt * tilt))
    ex, ey, ez = ex - share * at.sx, ey - share * at.sy, ez - share * at.sz
    if not miss <= NEAR:
        rows[g.AWAY_X, i] += ex
        rows[g.AWAY_Y, i] += ey
        rows[g.AWAY_Z, i] += ez
    pull = along * (ex * ux + ey * uy + ez * uz)
    rows[g.FORCE_X, i] = x + normal * ex + pull * ux
    rows[g.FORCE_Y, i] = y + normal * ey + pull * uy
    rows[g.FORCE_Z, i] = z + normal * ez + pull * uz
    rows[g.TENSION, i] = normal  # becomes the chord tension with the chord
    # error after this correction, as the errors of successive passes have a constant ratio; infinite if this is large
    ratio = miss / before if before < math.inf else 1.0
    left = miss * ratio if miss < 0.5 * before and free > 0.0 else math.inf
    rows[g.LEFT, i] = 0.0 if miss <= NEAR else left
    rows[g.MISS, i] = miss


@glue
def solve_swivels(model: Model, cables: Array, rows: Array) -> None:
    """Fill forces, planes, free spans and exits of all cables from their tangents and lengths."""
    # The rows contain the tangents from the pulleys to the platform ends. The chords of the free spans replace them.
    # Cables for which the passes do not converge are solved one by one, by damped Newton steps.
    m, gravity = cables.shape[0], model.gravity if model.code == codes.CATENARY else 0.0
    for i in independent(m):
        _fill_tangent(swivel_in(rows, cables, i, gravity), rows, i)
    for _ in range(PASSES if gravity > 0.0 else 0):
        for i in independent(m):
            _fill_equivalent_force(swivel_in(rows, cables, i, gravity), rows, i)
        for i in range(m):
            if math.isnan(rows[g.PARAMETER, i]):
                _fill_any_equivalent_force(swivel_in(rows, cables, i, gravity), rows, i)
        for i in independent(m):
            swivel = swivel_in(rows, cables, i, gravity)
            at = _exit_of(swivel, rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i])
            _store(at, rows[g.LENGTH, i] - (at.wrapped + at.dead), rows, i)
        for i in independent(m):
            _fill_series(swivel_in(rows, cables, i, gravity), rows, i)
        for i in range(m):
            if math.isnan(rows[g.SERIES, i]):
                _fill_any_series(swivel_in(rows, cables, i, gravity), rows, i)
        for i in independent(m):
            _correct(swivel_in(rows, cables, i, gravity), rows, i)
        left = 0.0
        for i in range(m):
            left = max(left, rows[g.LEFT, i])
        if left <= CLOSED:
            break
    for i in range(m):
        if not rows[g.LEFT, i] <= MISSED:
            _solve_by_newton(model, cables, rows, i)
    for i in independent(m):
        _fill_chord(swivel_in(rows, cables, i, gravity), rows, i)


@glue
def fill_from_results(model: Model, cables: Array, results: Array, p: int, rows: Array) -> None:
    """Fill lengths, forces and exits of all cables at pose `p` of a plan, after `cable_geometry`."""
    for i in range(cables.shape[0]):
        swivel = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
        azimuth, horizontal = results[tables.AZIMUTH, p, i], results[tables.HORIZONTAL, p, i]
        cosine, sine, z = math.cos(azimuth), math.sin(azimuth), results[tables.VERTICAL, p, i]
        rows[g.LENGTH, i] = results[tables.LENGTH, p, i]
        free = rows[g.LENGTH, i] - (results[tables.WRAPPED, p, i] + results[tables.DEAD, p, i])
        if is_aboard(cables, i):  # the rows are from the pulley on the platform to the frame anchor
            cosine, sine, z = -cosine, -sine, swivel.weight * free - z
        x, y = horizontal * cosine, horizontal * sine
        down = z - swivel.weight * free
        _store(_exit_of(swivel, x, y, down), free, rows, i)
        rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i] = x, y, z
        rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i] = cosine, sine
        rows[g.HORIZONTAL, i], rows[g.VERTICAL, i] = horizontal, z
        rows[g.LEAVING, i] = math.sqrt(x * x + y * y + down * down)


@formula
def _fill_tangent(swivel: Swivel, rows: Array, i: int) -> None:
    """Fill the platform end relative to the anchor, and the length between tangent and drum, of cable `i`."""
    x, y, z = rows[g.SPAN, i] * rows[g.AZIMUTH_X, i], rows[g.SPAN, i] * rows[g.AZIMUTH_Y, i], rows[g.RISE, i]
    chord, nx, ny, nz = rows[g.CHORD, i], swivel.x, swivel.y, swivel.z
    along = x * nx + y * ny + z * nz
    rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
    across = math.sqrt(rx * rx + ry * ry + rz * rz)
    inverse = swivel.radius / chord
    out, up = inverse * (chord - along) / (across + TINY), inverse * across
    rows[g.END_AT_X, i], rows[g.END_AT_Y, i] = x + out * rx + up * nx, y + out * ry + up * ny
    rows[g.END_AT_Z, i] = z + out * rz + up * nz
    rows[g.TO_DRUM, i] = swivel.dead + swivel.radius * angle(across + TINY, along)
    rows[g.LEFT, i] = rows[g.MISS, i] = math.inf
    if math.isnan(rows[g.PARAMETER, i]) or math.isnan(rows[g.AWAY_X, i] + rows[g.AWAY_Y, i] + rows[g.AWAY_Z, i]):
        rows[g.AWAY_X, i] = rows[g.AWAY_Y, i] = rows[g.AWAY_Z, i] = 0.0


@kernel
def _solve_by_newton(model: Model, cables: Array, rows: Array, i: int) -> None:
    """Fill force and exit of cable `i` by damped Newton steps from the straight cable, and its status."""
    gravity = model.gravity if model.code == codes.CATENARY else 0.0
    swivel = swivel_in(rows, cables, i, gravity)
    length, behind, end = (
        rows[g.LENGTH, i],
        rows[g.TO_DRUM, i],
        (rows[g.END_AT_X, i], rows[g.END_AT_Y, i], rows[g.END_AT_Z, i]),
    )
    cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    free = max(length - behind, SHORTEST * length)
    soft = Material(cables[i, tables.DENSITY], swivel.stiffness / (1.0 + behind / free))
    force, _status = from_length(Model(model.code, 0.0, 0.0, gravity), rows[g.SPAN, i], rows[g.RISE, i], soft, free)
    x, y, z = force.horizontal * cx, force.horizontal * cy, force.vertical
    miss, taut = 0.0, force.tension > 0.0 or swivel.weight > 0.0
    if taut:
        x, y, z, free, miss = _force_at(swivel, end, length, (x, y, z, free), rows, i)
    at = _exit_of(swivel, x, y, z - swivel.weight * free)
    if not taut:  # a slack cable without weight leaves its pulley along the tangent
        at = _exit_of(swivel, rows[g.SPAN, i] * cx, rows[g.SPAN, i] * cy, rows[g.RISE, i])
        free = length - (at.wrapped + at.dead)
    rows[g.PARAMETER, i] = math.nan
    _store(at, free, rows, i)
    give = _free_compliance(math.sqrt(x * x + y * y), z, free, swivel.weight, swivel.stiffness)[3] if taut else math.inf
    rows[g.TENSION, i] = 1.0 / give  # becomes the chord tension with the chord
    rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i] = x, y, z
    rows[g.LEFT, i] = miss


@formula
def _fill_series(swivel: Swivel, rows: Array, i: int) -> None:
    """Fill atanh(u)/u of the free span of cable `i`, whose force at the exit point is stored; NaN if u is large."""
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
    weight = swivel.weight * rows[g.FREE_LENGTH, i]
    square, above = x * x + y * y, z + weight
    u = weight / (math.sqrt(square + z * z) + math.sqrt(square + above * above) + TINY)
    excess = atanhc_excess_polynomial(u * u)
    rows[g.SERIES, i] = 1.0 + excess if u * u <= EXCESS_LIMIT else math.nan


@kernel
def _fill_any_series(swivel: Swivel, rows: Array, i: int) -> None:
    """`_fill_series` for any u."""
    horizontal = math.hypot(rows[g.FORCE_X, i], rows[g.FORCE_Y, i])
    vertical_a, weight = rows[g.FORCE_Z, i], swivel.weight * rows[g.FREE_LENGTH, i]
    vertical = vertical_a + weight
    tension_a, tension_b = math.hypot(horizontal, vertical_a), math.hypot(horizontal, vertical)
    u = weight / (tension_a + tension_b)
    sags = u > 0.5
    series = slack_series(horizontal, vertical_a, vertical, tension_a, tension_b) if sags else 1.0 + atanhc_excess(u)
    rows[g.SERIES, i] = series


@formula
def _store(at: Exit, free: float, rows: Array, i: int) -> None:
    """Store the exit of cable `i`, and its free length [m]."""
    rows[g.CENTER_X, i], rows[g.CENTER_Y, i], rows[g.CENTER_Z, i] = at.rx, at.ry, at.rz
    rows[g.WRAP, i], rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i] = at.wrap, at.sine, at.cosine
    rows[g.WRAPPED, i], rows[g.FREE_LENGTH, i] = at.wrapped, free


@formula
def _stored(swivel: Swivel, rows: Array, i: int) -> Exit:
    """Exit of cable `i`, from `_store`."""
    rx, ry, rz = rows[g.CENTER_X, i], rows[g.CENTER_Y, i], rows[g.CENTER_Z, i]
    nx, ny, nz = swivel.x, swivel.y, swivel.z
    wrapped = rows[g.WRAPPED, i]
    dead = rows[g.LENGTH, i] - rows[g.FREE_LENGTH, i] - wrapped
    return Exit(
        rx, ry, rz, ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx,
        rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i], rows[g.WRAP, i], wrapped, dead,
    )  # fmt: skip


@formula
def _product(rows: Array, i: int, a: int, b: int, c: int, vector: Vector) -> float:
    """Product of three rows of cable `i` and a vector."""
    return rows[a, i] * vector[0] + rows[b, i] * vector[1] + rows[c, i] * vector[2]


@formula
def _fill_chord(swivel: Swivel, rows: Array, i: int) -> None:
    """Fill plane, free span and tensions of cable `i` from its exit and its force, and its status."""
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
    down = z - swivel.weight * rows[g.FREE_LENGTH, i]
    square = x * x + y * y
    horizontal = math.sqrt(square)
    cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    if horizontal > 0.0:
        inverse = 1.0 / horizontal
        cx, cy = x * inverse, y * inverse
    px, py, pz = _point_of(swivel, _stored(swivel, rows, i))
    span, rise = cx * (rows[g.END_AT_X, i] - px) + cy * (rows[g.END_AT_Y, i] - py), rows[g.END_AT_Z, i] - pz
    chord = math.sqrt(span * span + rise * rise)
    inverse = 1.0 / chord
    rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i] = cx, cy
    rows[g.SPAN, i], rows[g.RISE, i], rows[g.CHORD, i] = span, rise, chord
    rows[g.SINE, i], rows[g.COSINE, i] = rise * inverse, span * inverse
    rows[g.FREE_SPAN, i], rows[g.FREE_RISE, i] = span, rise
    rows[g.HORIZONTAL, i], rows[g.VERTICAL, i] = horizontal, z
    rows[g.TENSION, i] *= chord
    rows[g.LEAVING, i] = math.sqrt(square + down * down)
    rows[g.STATUS, i] = codes.CABLE_SOLVED if rows[g.LEFT, i] <= MISSED else codes.CABLE_NOT_CONVERGED


@kernel
def stiffness_of_swivel(model: Model, cables: Array, rows: Array, i: int) -> None:
    """Fill stiffness and dT/dL of cable `i` in world axes, after `solve_swivel`. Zero for a cable without force."""
    if rows[g.LEAVING, i] > 0.0:
        swivel = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
        force = (rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i])
        _fill_stiffness(swivel, _stored(swivel, rows, i), force, rows[g.FREE_LENGTH, i], rows, i)
    else:
        for k in range(6):
            rows[g.W_XX + k, i] = 0.0
        rows[g.LONGER_X, i] = rows[g.LONGER_Y, i] = rows[g.LONGER_Z, i] = 0.0


class _Terms(NamedTuple):
    """Derivatives of a cable at a fixed force on the platform end, exit point and free length."""

    right: Vector  # right sides of the equations
    heavier: float  # of the weight w
    end: Vector  # of the platform end
    strain: float  # of the stretch at the exit point
    entering: float  # half the derivative of the square of the stretch at the entry, at a constant stretch at the exit
    drawn: float  # half the further derivative of the square of the stretch at the drum
    moment: Vector  # of the first moment of the cable behind the exit point about the anchor, of `_first_moments`


@formula
def _terms_of_data(
    s: Swivel, at: Exit, q: _Equations, k: int, density: float, force: Vector, free: float, turning: bool
) -> _Terms:
    """Derivatives by the data `k` of a cable. `turning`: True for a pulley on the platform."""
    # density: linear density [kg/m]; force: force at the platform end [N]
    w, soft, (x, y, end), none = s.weight, 1.0 / s.stiffness, force, (0.0, 0.0, 0.0)
    e, v, sz, total = q.strained, 1.0 - at.cosine, at.sz, 1.0 / (q.entering + q.drawn)
    beta, slip, late = w * s.radius * soft, (at.wrap - at.sine) / e, s.dead * total * total / q.drawn
    if k == 0:
        return _Terms((0.0, 0.0, 1.0), 0.0, none, 0.0, 0.0, 0.0, (s.dead * s.x, s.dead * s.y, s.dead * s.z))
    if k == 1:  # a heavier cable also decreases the force at the exit point
        gravity = w / density if w > 0.0 else 0.0
        one, two, three = _forces_on(s, at, q)[2]
        part = q.integral * s.radius * soft / (e * e * e) - 2.0 * q.bends * soft * q.zeta
        part = s.radius * part + 2.0 * late * soft * s.rise
        a, b, c = -free * one, s.radius * slip * sz - free * two, -part - free * three
        level = math.sqrt(x * x + y * y)
        by_weight = catenary_by_weight(level, end, free, w, s.stiffness) if w > 0.0 else PlaneVector(0.0, 0.0)
        share = gravity * by_weight.x / level if level > 0.0 else 0.0
        moved = share * x, share * y, gravity * by_weight.z
        right, entry = (gravity * a, gravity * b, gravity * c), -gravity * s.radius * soft * q.zeta
        return _Terms(right, gravity, moved, 0.0, entry, -gravity * soft * s.rise, none)
    if k == 2:
        less = (e - 1.0) * soft  # minus the derivative of the stretch at the exit point
        part = less * (at.wrap / (e * e) + 3.0 * beta * q.integral / (e * e * e * e))
        part = s.radius * (part - beta * soft * q.integral / (e * e * e))
        part += 2.0 * q.bends * (beta * soft * q.zeta - e * less) - 2.0 * late * w * s.rise * soft * soft
        moved = -free * soft * soft * x, -free * soft * soft * y, -free * soft * soft * (end - 0.5 * w * free)
        right, drum = (0.0, w * s.radius * slip * sz * less / e, -part), w * s.rise * soft * soft
        return _Terms(right, 0.0, moved, -less, beta * soft * q.zeta, drum, none)
    if k == 3:
        c = -(at.wrap + 2.0 * beta * q.integral / (e * e)) / e + 2.0 * q.bends * w * soft * q.zeta
        moved = v * at.rx + at.sine * s.x, v * at.ry + at.sine * s.y, v * at.rz + at.sine * s.z
        own, along = 2.0 * s.radius * slip, 2.0 * s.radius * v / e
        more = own * at.rx + along * s.x, own * at.ry + along * s.y, own * at.rz + along * s.z
        return _Terms((0.0, w * slip * sz, c), 0.0, moved, 0.0, -w * soft * q.zeta, 0.0, more)
    fall = w * soft * s.z if turning else 0.0  # the drum moves along the axis
    along = 0.0
    if turning:
        along = free + at.wrapped + at.dead - 4.0 / 3.0 * s.dead * (2.0 * q.entering + q.drawn) * total * total
    right = 0.0, 0.0, -2.0 * total - 2.0 * late * fall
    return _Terms(right, 0.0, none, 0.0, 0.0, -fall, (along * s.x, along * s.y, along * s.z))


@kernel
def slopes_of_swivel(model: Model, cables: Array, rows: Array, i: int, slopes: Array) -> None:
    """Fill `slopes` (SLOPES, 5) of cable `i`, after `stiffness_of_swivel`; zero for a cable without force."""
    # The first rows are derivatives by length, density, EA, pulley radius and dead length: of the force on the platform
    # end, which is at rest, and of the tension at the exit point [N] and the swivel angle [rad], at a fixed force on
    # the platform end. The last three rows are derivatives of the tension and the angle by this force, world axes. With
    # the pulley on the platform, the platform end is the frame anchor.
    slopes[:] = 0.0
    if not rows[g.LEAVING, i] > 0.0:
        return
    s = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    at, free = _stored(s, rows, i), rows[g.FREE_LENGTH, i]
    force = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
    q = _equations(s, at, force[0], force[1], force[2] - s.weight * free)
    by_x, by_y, by_z = _forces_on(s, at, q)
    for k in range(SLOPES):
        right, heavier, (dx, dy, dz) = by_z, 0.0, (0.0, 0.0, 0.0)
        if k < DATA:
            terms = _terms_of_data(s, at, q, k, cables[i, tables.DENSITY], force, free, is_aboard(cables, i))
            right, heavier, (dx, dy, dz) = terms.right, terms.heavier, terms.end
        elif k == DATA:
            right = by_x
        elif k == DATA + 1:
            right = by_y
        (ex, ey, ez), (_psi, sigma, grown) = _motion_by(s, at, q, right)
        slopes[k, 3], slopes[k, 4] = -q.uz * (s.weight * grown + free * heavier), sigma
        if k < DATA:
            away = (-ex - dx, -ey - dy, -ez - dz)
            slopes[k, 0] = _product(rows, i, g.W_XX, g.W_XY, g.W_XZ, away)
            slopes[k, 1] = _product(rows, i, g.W_XY, g.W_YY, g.W_YZ, away)
            slopes[k, 2] = _product(rows, i, g.W_XZ, g.W_YZ, g.W_ZZ, away)
    slopes[5, 3] += q.ux
    slopes[6, 3] += q.uy
    slopes[7, 3] += q.uz


@formula
def _cross(a: Vector, b: Vector) -> Vector:
    """The vector a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@formula
def _first_moment(s: Swivel, at: Exit, strains: Vector, length: float) -> Vector:
    """First moment [m^2] about the anchor of the cable behind the exit point, minus that of `length` at the drum."""
    # strains: stretch at the exit point, at the entry of the pulley, and at the drum
    strained, entering, drawn = strains
    on, total = s.radius * s.radius / strained, entering + drawn
    along = on * (1.0 - at.cosine) + s.dead * (length - 2.0 / 3.0 * s.dead * (entering + total) / (total * total))
    return _combined(on * (at.wrap - at.sine), (at.rx, at.ry, at.rz), along, (s.x, s.y, s.z), 0.0, (s.x, s.y, s.z))


@formula
def first_moment_behind(s: Swivel, at: Exit, force: Vector, length: float) -> Vector:
    """`_first_moment` at the `force` at the exit point [N]."""
    tension = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    zeta, _integral = _height(s, at.rz, at.sine, at.cosine, at.wrap)
    return _first_moment(s, at, _strains(s, tension, zeta), length)


@kernel
def moment_on_platform(model: Model, cables: Array, rows: Array, i: int) -> Vector:
    """Moment [N m] about the anchor of a pulley on the platform: force at the exit point, and weights behind it."""
    s = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    at, (x, y, z) = _stored(s, rows, i), (rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i])
    force = x, y, z - s.weight * rows[g.FREE_LENGTH, i]
    turned, first = _cross(_point_of(s, at), force), first_moment_behind(s, at, force, rows[g.LENGTH, i])
    return turned[0] - s.weight * first[1], turned[1] + s.weight * first[0], turned[2]


@formula
def _end_and_moment(
    s: Swivel, at: Exit, q: _Equations, force: Vector, free: float, length: float, terms: _Terms
) -> tuple[Vector, Vector]:
    """Derivatives of the frame end relative to the anchor and of the moment about it, at a fixed force on this end."""
    # A pulley on the platform; `force` is the force at the exit point. The motion of the end is without terms.end.
    end, (psi, sigma, grown) = _motion_by(s, at, q, terms.right)
    e, v, soft, total = q.strained, 1.0 - at.cosine, 1.0 / s.stiffness, q.entering + q.drawn
    lighter = s.weight * grown + free * terms.heavier
    strain = terms.strain - soft * q.uz * lighter
    raised = (at.sine * at.rz + at.cosine * s.z) * psi + v * at.sz * sigma
    entering = (e * strain - s.weight * s.radius * soft * raised + terms.entering) / q.entering
    drawn = (q.entering * entering + terms.drawn) / q.drawn
    on, slip = s.radius * s.radius / e, at.wrap - at.sine
    along = on * (at.sine * psi - v * strain / e)
    cubed = 2.0 / 3.0 * s.dead * s.dead / (total * total * total)
    along += cubed * (2.0 * q.entering * entering + (3.0 * q.entering + q.drawn) * drawn)
    outward, sideways = on * (v * psi - slip * strain / e), on * slip * sigma
    first = _first_moment(s, at, (e, q.entering, q.drawn), length)
    px, py, _pz = _point_of(s, at)
    mx = s.weight * (outward * at.rx + sideways * at.sx + along * s.x + terms.moment[0])
    my = s.weight * (outward * at.ry + sideways * at.sy + along * s.y + terms.moment[1])
    mx, my = mx + terms.heavier * first[0] + lighter * px, my + terms.heavier * first[1] + lighter * py
    grow = e * grown
    tx, ty, tz = _cross((end[0] - grow * q.ux, end[1] - grow * q.uy, end[2] - grow * q.uz), force)
    return end, (tx - my, ty + mx, tz)


@formula
def _terms_of_turn(s: Swivel, at: Exit, q: _Equations, force: Vector, length: float, axis: Vector) -> _Terms:
    """Derivatives by a rotation of the platform about the unit vector `axis`, at a fixed frame end and anchor."""
    w, soft, sine, v, (nx, ny, nz) = s.weight, 1.0 / s.stiffness, at.sine, 1.0 - at.cosine, (s.x, s.y, s.z)
    beta, slip, cube = w * s.radius * soft, at.wrap - sine, q.strained * q.strained * q.strained
    late = s.dead / (q.drawn * (q.entering + q.drawn) * (q.entering + q.drawn))
    radial = at.cosine * at.rx - sine * nx, at.cosine * at.ry - sine * ny, at.cosine * at.rz - sine * nz
    _rx, _ry, raised = _cross(axis, (at.rx, at.ry, at.rz))
    _nx, _ny, lifted = _cross(axis, (nx, ny, nz))
    cx, cy, cz = _cross(axis, radial)
    sx, sy, sz = _cross(axis, (at.sx, at.sy, at.sz))
    x, y, z = force
    one = x * cx + y * cy + z * cz
    two = w * s.radius * slip / q.strained * sz - v * (x * sx + y * sy + z * sz)
    three = (s.radius * (at.wrap * v - slip) / cube - 2.0 * q.bends * v) * beta * raised
    three += (s.radius * (at.wrap * sine - v) / cube - 2.0 * q.bends * sine) * beta * lifted
    drum = -w * soft * s.dead * lifted
    first = _cross(axis, _first_moment(s, at, (q.strained, q.entering, q.drawn), length))
    entry = -beta * (v * raised + sine * lifted)
    end = _cross(axis, _point_of(s, at))
    return _Terms((one, two, 2.0 * late * drum - three), 0.0, end, 0.0, entry, drum, first)


@kernel
def turn_of_swivel(model: Model, cables: Array, rows: Array, i: int, axis: Vector) -> tuple[Vector, Vector]:
    """`_end_and_moment` of cable `i` by a rotation of the platform about `axis`, with its pulley on the platform."""
    s = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    at, free, length = _stored(s, rows, i), rows[g.FREE_LENGTH, i], rows[g.LENGTH, i]
    force = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i] - s.weight * free
    q = _equations(s, at, force[0], force[1], force[2])
    terms = _terms_of_turn(s, at, q, force, length, axis)
    end, moment = _end_and_moment(s, at, q, force, free, length, terms)
    direct = _cross(terms.end, force)
    return (
        (end[0] + terms.end[0], end[1] + terms.end[1], end[2] + terms.end[2]),
        (moment[0] + direct[0], moment[1] + direct[1], moment[2] + direct[2]),
    )


@kernel
def moments_of_swivel(model: Model, cables: Array, rows: Array, i: int, slopes: Array) -> None:
    """Fill `slopes` (DATA + 3, 3) of cable `i` with its pulley on the platform; zero for a cable without force."""
    # Derivatives of the moment about the anchor by the data, and of the frame end relative to the anchor by rotations
    # of the platform, at a fixed force on the frame end.
    slopes[:] = 0.0
    if not rows[g.LEAVING, i] > 0.0:
        return
    s = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    at, free, length = _stored(s, rows, i), rows[g.FREE_LENGTH, i], rows[g.LENGTH, i]
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
    force = x, y, z - s.weight * free
    q = _equations(s, at, force[0], force[1], force[2])
    for k in range(DATA):
        terms = _terms_of_data(s, at, q, k, cables[i, tables.DENSITY], (x, y, z), free, True)
        _end, (mx, my, mz) = _end_and_moment(s, at, q, force, free, length, terms)
        if k == 3:  # the exit point moves with the radius
            direct = _cross(terms.end, force)
            mx, my, mz = mx + direct[0], my + direct[1], mz + direct[2]
        slopes[k, 0], slopes[k, 1], slopes[k, 2] = mx, my, mz
    for k in range(3):
        axis = 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0
        end, _moment = turn_of_swivel(model, cables, rows, i, axis)
        slopes[DATA + k, 0], slopes[DATA + k, 1], slopes[DATA + k, 2] = end


@kernel
def energy_of_swivel(model: Model, cables: Array, rows: Array, i: int) -> float:
    """Energy [J] of the cable between exit point and drum, plus energy to lift the free span to the exit point."""
    swivel = swivel_in(rows, cables, i, model.gravity if model.code == codes.CATENARY else 0.0)
    free, radius = rows[g.FREE_LENGTH, i], swivel.radius
    x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i] - swivel.weight * free
    tension = math.sqrt(x * x + y * y + z * z)
    at = _stored(swivel, rows, i)
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
        + (swivel.weight * rows[g.LENGTH, i] * swivel.rise if is_aboard(cables, i) else 0.0)
    )


@formula
def next_exit(swivel: Swivel, robot: Array, i: int, force: Vector, eyelets: Array, chord: float) -> tuple[Vector, Exit]:
    """Next exit point of cable `i` in world axes [m], from the `force` at the present exit point, a row of `eyelets`.

    A motion of the present exit point turns the force, which moves the exit point of the force back by the share R/D
    tan(psi/2) normal to the plane of the pulley. The step is shorter by this share. `chord`: D of the free span [m].
    """
    at = _exit_of(swivel, force[0], force[1], force[2])
    x, y, z = _point_of(swivel, at)
    x += robot[i, tables.FRAME_X] - eyelets[i, tables.FRAME_X]
    y += robot[i, tables.FRAME_Y] - eyelets[i, tables.FRAME_Y]
    z += robot[i, tables.FRAME_Z] - eyelets[i, tables.FRAME_Z]
    back = swivel.radius * at.sine
    share = back / (chord * (1.0 + at.cosine) + back) * (x * at.sx + y * at.sy + z * at.sz)
    return (
        eyelets[i, tables.FRAME_X] + (x - share * at.sx),
        eyelets[i, tables.FRAME_Y] + (y - share * at.sy),
        eyelets[i, tables.FRAME_Z] + (z - share * at.sz),
    ), at


@entry
def exits_of_forces(robots: Array, gravity: Array, forces: Array, eyelets: Array, chords: Array, exits: Array) -> None:
    """Next exit points of cables with swivel axes."""
    # robots: cable_table with swivel axes, (1 or N, m, SWIVEL_COLUMNS).
    # gravity: Gravity for the weight of the cables [m/s^2], (1 or N,); 0 for cables without weight.
    # forces: Forces at the present exit points, toward the platform ends [N], (N, m, 3).
    # eyelets: Present exit points in world axes [m], (N, m, 3).
    # chords: Lengths of the chords of the free spans [m], (N, m).
    # exits: Filled with the next exit points in world axes [m], the wrap angle [rad], the unstrained length on the
    #   pulley and the unstrained dead length [m], (N, m, 6). In further columns, the level components of the first
    #   moment about the anchor of the cable behind the exit point [m^2], (N, m, 8).
    for p in range(forces.shape[0]):
        cables = robots[min(p, robots.shape[0] - 1)]
        for i in range(cables.shape[0]):
            swivel = swivel_at(cables, i, gravity[min(p, gravity.shape[0] - 1)])
            force = (forces[p, i, 0], forces[p, i, 1], forces[p, i, 2])
            (x, y, z), at = next_exit(swivel, cables, i, force, eyelets[p], chords[p, i])
            exits[p, i, 0], exits[p, i, 1], exits[p, i, 2] = x, y, z
            exits[p, i, 3], exits[p, i, 4], exits[p, i, 5] = at.wrap, at.wrapped, at.dead
            if exits.shape[2] > 6:
                exits[p, i, 6], exits[p, i, 7], _z = first_moment_behind(swivel, at, force, 0.0)

"""A rigid body in free motion and under forces: steps that the integrators combine.

The body axes are the principal axes, with the origin at the center of mass. A state is a row of 13 numbers: position of
the center of mass, unit quaternion (scalar last) of the rotation from body axes to world axes, velocity, and angular
momentum in world axes. The first seven numbers are a pose row. In free motion, the angular momentum is constant.
docs/model.md, section 11; Dullweber, Leimkuhler & McLachlan, J. Chem. Phys. 107, 1997.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.algebra.factors import dot
from sagline.kernels.jit import entry, formula
from sagline.kernels.statics import turned

CENTER, TURN, VELOCITY, MOMENTUM = 0, 3, 7, 10
STATE_COLUMNS = 13
# row of inertia: mass [kg], principal moments [kg m^2], which are infinite for axes about which the body cannot turn
MASS, MOMENTS = 0, 1

Triple = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]


@formula
def kick_body(state: Array, inertia: Array, wrench: Array, time: float) -> None:
    """Update velocity and angular momentum by `wrench` (6,), which acts for `time` [s]."""
    for k in range(3):
        state[VELOCITY + k] += time * wrench[k] / inertia[MASS]
        state[MOMENTUM + k] += time * wrench[3 + k]


@formula
def drift_body(state: Array, time: float) -> None:
    """Move the center of mass at its velocity for `time` [s]."""
    for k in range(3):
        state[CENTER + k] += time * state[VELOCITY + k]


@formula
def _into_body(state: Array, x: float, y: float, z: float) -> Triple:
    """Components of the world vector (x, y, z) in the body's axes."""
    qx, qy, qz, qw = -state[TURN], -state[TURN + 1], -state[TURN + 2], state[TURN + 3]
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return x + qw * tx + qy * tz - qz * ty, y + qw * ty + qz * tx - qx * tz, z + qw * tz + qx * ty - qy * tx


@formula
def _turn_about(a: float, b: float, c: float, w: float, pa: float, pb: float, pc: float, share: float) -> Six:
    """Rotate by the angle `share` * `pa` [rad] about the first axis. The three axes are in cyclic order."""
    # `a`, `b`, `c`: vector part of the quaternion along these axes. `w`: its scalar part. `pa`, `pb`, `pc`: angular
    # momentum along these axes. The results are the new quaternion and the new pb and pc.
    angle = 0.5 * share * pa
    sine, cosine = math.sin(angle), math.cos(angle)
    whole_sine, whole_cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
    return (
        w * sine + a * cosine,
        b * cosine + c * sine,
        c * cosine - b * sine,
        w * cosine - a * sine,
        whole_cosine * pb + whole_sine * pc,
        whole_cosine * pc - whole_sine * pb,
    )


@formula
def free_turn(state: Array, inertia: Array, time: float) -> None:
    """Rotate the body for `time` without a moment, by a symmetric sequence of exact rotations about principal axes."""
    x, y, z, w = state[TURN], state[TURN + 1], state[TURN + 2], state[TURN + 3]
    px, py, pz = _into_body(state, state[MOMENTUM], state[MOMENTUM + 1], state[MOMENTUM + 2])
    by_x, by_y = 0.5 * time / inertia[MOMENTS], 0.5 * time / inertia[MOMENTS + 1]
    x, y, z, w, py, pz = _turn_about(x, y, z, w, px, py, pz, by_x)
    y, z, x, w, pz, px = _turn_about(y, z, x, w, py, pz, px, by_y)
    z, x, y, w, px, py = _turn_about(z, x, y, w, pz, px, py, time / inertia[MOMENTS + 2])
    y, z, x, w, pz, px = _turn_about(y, z, x, w, py, pz, px, by_y)
    x, y, z, w, py, pz = _turn_about(x, y, z, w, px, py, pz, by_x)
    scale = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)  # this scaling corrects only rounding errors
    state[TURN], state[TURN + 1], state[TURN + 2], state[TURN + 3] = x * scale, y * scale, z * scale, w * scale


@formula
def spin(state: Array, inertia: Array) -> Triple:
    """Angular velocity in world axes [rad/s]."""
    x, y, z = _into_body(state, state[MOMENTUM], state[MOMENTUM + 1], state[MOMENTUM + 2])
    return turned(state, x / inertia[MOMENTS], y / inertia[MOMENTS + 1], z / inertia[MOMENTS + 2])


@formula
def kinetic_energy(state: Array, inertia: Array) -> float:
    """Kinetic energy of translation and rotation [J]."""
    x, y, z = _into_body(state, state[MOMENTUM], state[MOMENTUM + 1], state[MOMENTUM + 2])
    velocity = state[VELOCITY:MOMENTUM]
    turning = x * x / inertia[MOMENTS] + y * y / inertia[MOMENTS + 1] + z * z / inertia[MOMENTS + 2]
    return 0.5 * (inertia[MASS] * dot(velocity, velocity) + turning)


@formula
def power_of(wrench: Array, state: Array, spinning: Triple) -> float:
    """Power of `wrench` (6,) on the body [W]."""
    power = wrench[3] * spinning[0] + wrench[4] * spinning[1] + wrench[5] * spinning[2]
    for k in range(3):
        power += wrench[k] * state[VELOCITY + k]
    return power


@formula
def rates_of(state: Array, inertia: Array, wrench: Array, rates: Array) -> None:
    """Fill the time derivative (13,) of `state` under `wrench`. The length of the quaternion does not change."""
    wx, wy, wz = spin(state, inertia)
    x, y, z, w = state[TURN], state[TURN + 1], state[TURN + 2], state[TURN + 3]
    for k in range(3):
        rates[CENTER + k] = state[VELOCITY + k]
        rates[VELOCITY + k] = wrench[k] / inertia[MASS]
        rates[MOMENTUM + k] = wrench[3 + k]
    rates[TURN] = 0.5 * (wx * w + wy * z - wz * y)
    rates[TURN + 1] = 0.5 * (wy * w + wz * x - wx * z)
    rates[TURN + 2] = 0.5 * (wz * w + wx * y - wy * x)
    rates[TURN + 3] = -0.5 * (wx * x + wy * y + wz * z)


@entry
def platform_state(state: Array, inertia: Array, center: Array, turn: Array, out: Array) -> None:
    """Fill the state of the platform frame: position of its origin, quaternion, velocity and angular velocity (13,)."""
    # state: Row of 13 numbers, see the beginning of this module.
    # inertia: Row of inertia.
    # center: Center of mass, relative to the frame's origin, in principal axes (3,).
    # turn: Quaternion of the rotation from frame axes to principal axes, (4,).
    # out: Filled.
    lever = turned(state, center[0], center[1], center[2])
    wx, wy, wz = spin(state, inertia)
    for k in range(3):
        out[k] = state[CENTER + k] - lever[k]
    out[VELOCITY] = state[VELOCITY] - wy * lever[2] + wz * lever[1]
    out[VELOCITY + 1] = state[VELOCITY + 1] - wz * lever[0] + wx * lever[2]
    out[VELOCITY + 2] = state[VELOCITY + 2] - wx * lever[1] + wy * lever[0]
    x, y, z, w = state[TURN], state[TURN + 1], state[TURN + 2], state[TURN + 3]
    a, b, c, s = turn[0], turn[1], turn[2], turn[3]
    out[TURN] = w * a + x * s + y * c - z * b
    out[TURN + 1] = w * b - x * c + y * s + z * a
    out[TURN + 2] = w * c + x * b - y * a + z * s
    out[TURN + 3] = w * s - x * a - y * b - z * c
    out[MOMENTUM], out[MOMENTUM + 1], out[MOMENTUM + 2] = wx, wy, wz

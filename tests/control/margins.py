"""Margins of a loop from its frequency response, and inner loops of a robot on its flexible platform."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.core.arrays import Array, Indices

DELAY = 1.5e-3  # s: half a period of the drives, and one period of computation
# Hz; a mode of the platform has a width of a percent
FREQUENCY = np.concatenate((np.geomspace(0.3, 10.0, 3000), np.geomspace(10.05, 200.0, 300)))


class Margins(NamedTuple):
    """Stability margins of a loop.

    Attributes:
        gain: By which its gain may change, up or down, the nearer [dB].
        phase: By which its phase may change at any of its crossovers [degrees].
        crossover: The highest frequency at which its gain is 1, of the grid's unit.
    """

    gain: float
    phase: float
    crossover: float


def margins(response: Array, frequency: Array) -> Margins:
    """Margins of an open loop (F,), complex, that is stable when closed with negative feedback."""
    size, turn = np.log10(np.abs(response)), np.unwrap(np.angle(response))
    crossing = np.flatnonzero(np.diff(np.sign(size)))
    share = size[crossing] / (size[crossing] - size[crossing + 1])
    there = turn[crossing] + share * (turn[crossing + 1] - turn[crossing])
    phase = np.abs((there + 2.0 * np.pi) % (2.0 * np.pi) - np.pi)
    # on the negative real axis the phase is an odd multiple of pi
    opposite = np.flatnonzero(np.diff(np.floor((turn - np.pi) / (2.0 * np.pi))))
    level = 0.5 * (size[opposite] + size[opposite + 1])
    gain = float(20.0 * np.abs(level).min(initial=np.inf))
    return Margins(gain, float(np.degrees(phase.min(initial=np.pi))), float(frequency[crossing[-1]]))


class Axis(NamedTuple):
    """Equal drives of a robot at an equilibrium: J_e s'' = u + T, u = -(k_v + k_i/s)(k_p + s) s.

    Attributes:
        inertia: J_e of motor, gear and drum at the cable [kg].
        position: k_p [1/s].
        speed: k_v [N s/m].
        integral: k_i [N/m].
        system: A, B, C, D from the rates of the lengths to the tensions at the frame ends.
        lengths: Which states of A are lengths.
        by_wrench: What a wrench on the platform adds to the rates of the states.
    """

    inertia: float
    position: float
    speed: float
    integral: float
    system: tuple[Array, Array, Array, Array]
    lengths: Indices
    by_wrench: Array


def axis(state: sl.Equilibrium, damping: sl.Damping) -> Axis:
    """Drives at an equilibrium; a third of the air damping of the cables acts at their ends."""
    robot, m = state.one_robot, state.one_robot.cable_count
    winch = robot.winches
    assert winch is not None
    assert winch.inertia is not None
    assert winch.drum_radius is not None
    gains = (winch.position_gain, winch.speed_gain, winch.integral_gain)
    position, speed, integral = (float(gain[0]) for gain in gains if gain is not None)
    inertia = float((winch.inertia * (winch.gear / winch.drum_radius) ** 2)[0])
    linear = sl.linearized(state, sl.Damping(loss_time=damping.loss_time), "speeds")
    slowed = linear.A.copy()
    slowed[6:12, 6:12] -= linear.B[6:12, m:] @ _air(state, damping.air_damping)
    system = (slowed, linear.B[:, :m], linear.C[6 : 6 + m], linear.D[6 : 6 + m, :m])
    return Axis(inertia, position, speed, integral, system, np.arange(12, 12 + m), linear.B[:, m:])


def _air(state: sl.Equilibrium, damping: float) -> Array:
    """Wrench for a unit velocity of the platform, (6, 6)."""
    robot, matrix = state.one_robot, state.pose.matrix
    levers = (robot.platform_anchors - robot.center_of_mass) @ matrix.T
    reach = robot.frame_anchors - state.pose.position - robot.platform_anchors @ matrix.T
    found = np.zeros((6, 6))
    for lever, way in zip(levers, reach, strict=True):
        length = np.linalg.norm(way)
        across = np.eye(3) - np.outer(way, way) / length**2
        moves = np.hstack((np.eye(3), -np.cross(np.eye(3), lever).T @ -np.eye(3)))
        found += moves.T @ (damping * length / 3.0 * across) @ moves
    return found


def inner_loops(drives: Axis, delay: float = DELAY) -> Array:
    """Open loops, each with the others closed, on the flexible platform; complex, shape (F, m)."""
    a, b, c, d = drives.system
    m, s = b.shape[1], 2j * np.pi * FREQUENCY
    poles, shapes = np.linalg.eig(a)
    share = 1.0 / (s[:, None] - poles)
    rates = ((c @ shapes) * share[:, None, :]) @ np.linalg.solve(shapes, b.astype(complex)) + d
    control = (drives.speed + drives.integral / s) * (drives.position + s) * np.exp(-s * delay)
    drum = (s**2)[:, None, None] * (drives.inertia * np.eye(m)) - s[:, None, None] * rates
    # 1/(1 + L_i) is on the diagonal of the sensitivity Z (Z + C)^-1
    closed = np.linalg.inv(drum + control[:, None, None] * np.eye(m))
    found: Array = 1.0 / np.einsum("fij,fji->fi", drum, closed) - 1.0
    return found


def closed_poles(drives: Axis, delay: float = DELAY) -> Array:
    """Poles of platform and drums with all loops closed [rad/s]."""
    return np.asarray(np.linalg.eigvals(closed_loops(drives, delay)))


def closed_loops(drives: Axis, delay: float = DELAY) -> Array:
    """Platform and drums with all loops closed, as A of dx/dt = A x; delays as rational functions of second order.

    e^(-s h) = 1 - (12/h) s/(s^2 + 6 s/h + 12/h^2): q1' = q2, q2' = w - (6/h) q2 - (12/h^2) q1, u = w - (12/h) q2.
    """
    a, b, c, d = drives.system
    n, m = b.shape
    total, one = n + 4 * m, np.eye(m)
    platform, speed, whole, first, second = np.split(np.arange(total), n + m * np.arange(4))
    wanted = np.zeros((m, total))  # before the delay
    wanted[:, drives.lengths] = -(drives.speed * drives.position + drives.integral) * one
    wanted[:, speed] = -drives.speed * one
    wanted[:, whole] = -drives.integral * drives.position * one
    force = wanted.copy()
    force[:, second] -= 12.0 / delay * one
    force[:, platform] += c
    force[:, speed] += d
    matrix = np.zeros((total, total))
    matrix[np.ix_(platform, platform)], matrix[np.ix_(platform, speed)] = a, b
    matrix[speed] = force / drives.inertia
    matrix[np.ix_(whole, drives.lengths)] = one
    matrix[np.ix_(first, second)] = one
    matrix[second] = wanted
    matrix[np.ix_(second, second)] -= 6.0 / delay * one
    matrix[np.ix_(second, first)] -= 12.0 / delay**2 * one
    return matrix

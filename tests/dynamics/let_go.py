"""Swinging robots: released beside their equilibrium, with an integration in time independent of the kernels."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array

LIFT = sl.MinimumNorm()


def beside(
    robot: sl.Robot, place: tuple[float, float, float], by: Array, model: sl.CableModel | None = None
) -> tuple[sl.Equilibrium, Array]:
    """A state beside a pose, and the lengths for which the robot is at equilibrium at the pose."""
    model = model or sl.Catenary()
    at, away = (sl.Pose.from_euler(np.asarray(place) + shift, 0.0, 0.0, 0.0) for shift in (np.zeros(3), by))
    lengths = sl.inverse(robot, at, model=model, tension=LIFT).unstrained_length
    state = sl.inverse(robot, away, model=model, tension=LIFT).state
    return state, lengths


def lopsided(name: str) -> sl.Robot:
    """A preset with its center of mass off the platform origin and an inertia that is not diagonal."""
    robot = sl.load_robot(name)
    turn = Rotation.from_euler("xyz", [0.3, -0.5, 0.8]).as_matrix()
    moments = np.linalg.eigvalsh(robot.inertia) * [0.9, 1.1, 1.3]
    return robot.replace(center_of_mass=(0.02, -0.03, 0.05), inertia=turn @ np.diag(moments) @ turn.T)


def integrated(robot: sl.Robot, model: sl.CableModel, pose: sl.Pose, lengths: Array, times: Array) -> Array:
    """Position of the platform origin and its quaternion, (N, 7), released at rest, by DOP853 and Euler's equations.

    In the platform's own axes, with forces from the public cable model: another formulation, another method.
    """
    center, inertia = robot.center_of_mass, robot.inertia

    def rates(_: float, y: Array) -> Array:
        spin = y[10:]
        rotation = Rotation.from_quat(y[3:7]).as_matrix()
        levers = (robot.platform_anchors - center) @ rotation.T
        chord = y[:3] + levers - robot.frame_anchors
        span = np.hypot(chord[:, 0], chord[:, 1])
        hung = model.from_length(robot.cables, span, chord[:, 2], lengths, gravity=robot.gravity)
        force = -hung.horizontal_tension[:, None] * chord / span[:, None]
        force[:, 2] = -hung.vertical_force
        total = force.sum(axis=0) - [0.0, 0.0, robot.mass * robot.gravity]
        moment = rotation.T @ np.cross(levers, force).sum(axis=0)
        x, y_, z, w = y[3:7]
        a, b, c = spin
        turning = 0.5 * np.array([w * a + y_ * c - z * b, w * b + z * a - x * c, w * c + x * b - y_ * a])
        scalar = -0.5 * (x * a + y_ * b + z * c)
        spinning = np.linalg.solve(inertia, moment - np.cross(spin, inertia @ spin))
        return np.concatenate((y[7:10], turning, [scalar], total / robot.mass, spinning))

    start = np.zeros(13)
    start[:3], start[3:7] = pose.position + pose.matrix @ center, pose.quaternion
    found = solve_ivp(rates, (times[0], times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-14)
    found.y[:3] -= (Rotation.from_quat(found.y[3:7].T).as_matrix() @ center).T
    rows: Array = found.y[:7].T
    return rows

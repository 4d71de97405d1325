"""A robot on massless cables: its wrench from the public cable models, its flexibility by integration."""

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.feasible import center, unbalance
from tests.statics.test_stiffness import richardson

_X, _W = np.polynomial.legendre.leggauss(30)


def wrench_after(state: sl.Equilibrium, motion: Array, lengths: Array) -> Array:
    """Wrench on a platform after a small motion with other lengths; that of the state is subtracted."""
    robot, pose = state.one_robot, state.pose
    turned = Rotation.from_rotvec(motion[3:]) * Rotation.from_quat(pose.quaternion.copy())
    position = center(pose, robot) + motion[:3] - turned.apply(robot.center_of_mass.copy())
    return unbalance(robot, state.cables.model, lengths, position, turned, np.asarray(state.wrench))


def tensions_after(state: sl.Equilibrium, motion: Array, lengths: Array) -> Array:
    """Tensions at the frame ends in the same state."""
    robot, pose = state.one_robot, state.pose
    turned = Rotation.from_rotvec(motion[3:]) * Rotation.from_quat(pose.quaternion.copy())
    lever = turned.apply(robot.platform_anchors - robot.center_of_mass)
    reach = center(pose, robot) + motion[:3] + lever - robot.frame_anchors
    span = np.hypot(reach[:, 0], reach[:, 1])
    found = state.cables.model.from_length(robot.cables, span, reach[:, 2], lengths, robot.gravity)
    return found.frame_end_tension.copy()


def slopes_of(function, state: sl.Equilibrium) -> tuple[Array, Array]:  # type: ignore[no-untyped-def]
    """Differences of `wrench_after` or `tensions_after` by motion and by length, one per column."""
    lengths, none = state.unstrained_length.copy(), np.zeros(6)
    by_motion = [richardson(lambda h, one=one: function(state, h * one, lengths), 5e-5) for one in np.eye(6)]
    by_length = [richardson(lambda h, one=one: function(state, none, lengths + h * one), 5e-5) for one in np.eye(8)]
    return np.transpose(by_motion), np.transpose(by_length)


def mass_of(state: sl.Equilibrium) -> Array:
    robot, turned = state.one_robot, state.pose.matrix
    mass = np.zeros((6, 6))
    mass[:3, :3] = robot.mass * np.eye(3)
    mass[3:, 3:] = turned @ robot.inertia @ turned.T
    return mass


def flexibility_of(force: Array, weight: complex, length: complex, stretching: complex, panels: int = 400) -> Array:
    """dB/dT of one cable by integration over its length; analytic in all arguments.

    Args:
        force: On the platform end, shape (3,).
        weight: A length.
        length: Unstrained.
        stretching: EA.
        panels: Of thirty points each.
    """
    place = ((np.arange(panels)[:, None] + 0.5 * (_X + 1.0)) / panels).ravel()
    share = np.tile(_W, panels) / (2 * panels) * length
    along = np.asarray(force) - np.outer(weight * length * (1.0 - place), [0.0, 0.0, 1.0])
    size = np.sqrt((along**2).sum(axis=1))
    whole: Array = np.eye(3) * (share * (1.0 / size + 1.0 / stretching)).sum()
    # t^T t /N belongs to rotation and is left out; the stretch is already in the unit matrix
    whole = whole - np.einsum("s,sa,sb->ab", share / size**3, along, along)
    return whole


def stretch_of(force: Array, weight: float, length: float, stretching: float, panels: int = 400) -> Array:
    """Its part due to the stretch along the cable."""
    place = ((np.arange(panels)[:, None] + 0.5 * (_X + 1.0)) / panels).ravel()
    along = np.asarray(force) - np.outer(weight * length * (1.0 - place), [0.0, 0.0, 1.0])
    tangent = along / np.linalg.norm(along, axis=1)[:, None]
    share = np.tile(_W, panels) / (2 * panels) * length / stretching
    found: Array = np.einsum("s,sa,sb->ab", share, tangent, tangent)
    return found

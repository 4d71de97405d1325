"""Wrenches on the platform: about its center of mass, in world axes, force then moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import instance
from sagline.core.arrays import Array, checked, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.several import bodies_of, one_a_pose


def inertial_wrench(robot: Robot | Sequence[Robot], pose: Pose, twist: ArrayLike, twist_rate: ArrayLike) -> Array:
    """The d'Alembert wrench of a motion: what the platform's inertia does to it.

    Args:
        robot: Gives mass, center of mass and inertia; one robot, or a sequence of N, one a pose.
        pose: A batch of N poses.
        twist: Velocity of the platform origin [m/s] and angular velocity [rad/s], world axes, shape (N, 6).
        twist_rate: Their rates [m/s^2, rad/s^2], shape (N, 6).

    Returns:
        Force -M p_c'' [N] and moment -(Gamma w' + w x Gamma w) [N m] about the center of mass, shape (N, 6).

    Raises:
        InvalidValueError: If several robots are not one a pose or do not fit together, or the poses, the twists and
            their rates are not N of each.

    Source:
        Newton and Euler; docs/model.md, section 4. With the angular velocity itself, not Euler-angle rates.
    """
    if not instance(pose, Pose, "pose").shape:
        raise InvalidValueError("pose", "a single one", "a batch of N poses", "Take Pose(position[None], rotation).")
    body = bodies_of(one_a_pose(robot, len(pose)))
    twist = exactly(twist, "twist", "m/s or rad/s", (len(pose), 6))
    twist_rate = exactly(twist_rate, "twist_rate", "m/s^2 or rad/s^2", (len(pose), 6))
    spin, spin_rate = twist[:, 3:], twist_rate[:, 3:]
    wrench = np.empty((len(twist), 6))
    wrench[:, :3] = twist_rate[:, :3]
    wrench[:, 3:] = 0.0
    if np.any(spin) or np.any(spin_rate):
        rotation = pose.matrix
        lever = (rotation @ body.center_of_mass[..., None])[..., 0]
        wrench[:, :3] += np.cross(spin_rate, lever) + np.cross(spin, np.cross(spin, lever))
        inertia = rotation @ body.inertia @ np.swapaxes(rotation, 1, 2)
        momentum = np.einsum("nij,nj->ni", inertia, spin)
        wrench[:, 3:] = -np.einsum("nij,nj->ni", inertia, spin_rate) - np.cross(spin, momentum)
    wrench[:, :3] *= -body.mass[..., None]
    return locked(wrench)


def external_wrench(wrench: ArrayLike | None, count: int | None) -> Array:
    """The caller's wrench, checked; zeros for None.

    Args:
        wrench: What the caller gave: force [N], then moment [N m], or None.
        count: Number of poses; None for a single one.

    Returns:
        Array of shape (6,) or (N, 6).

    Raises:
        InvalidValueError: If it is no wrench, or its count is not that of the poses (None: a single pose).
    """
    if wrench is None:
        return locked(np.zeros(6))
    array = checked(wrench, "wrench", "N or N m", shape=(6,))
    if array.ndim == 1 or array.shape == (count, 6):
        return array
    allowed = "shape (6,)" if count is None else f"shape (6,) or ({count}, 6)"
    raise InvalidValueError("wrench", f"of shape {array.shape}", allowed, "Give one wrench, or one a pose.")

"""Unconstrained motion of the platform at a singular pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.statics.balance import structure_matrix


class UnresistedMotion(NamedTuple):
    """The platform motion that the cables constrain least.

    Attributes:
        twist: Velocity of the center of mass and angular velocity, world axes, shape (6,). Its angular part has length
            1; if the platform does not rotate, its linear part has length 1.
        resistance: Largest rate of a cable length in this motion, divided by the rate in the most constrained motion; 0
            at a singular pose, except for rounding.
        text: Description of the motion in words.
    """

    twist: Array
    resistance: float
    text: str


def unresisted_motion(robot: Robot, pose: PoseLike) -> UnresistedMotion:
    """Motion of the platform with the smallest change of the cable lengths. At a singular pose this change is zero.

    Args:
        robot: The robot.
        pose: One pose.

    Returns:
        UnresistedMotion: the twist, the resistance of the cables to this twist, and a description in words.

    Raises:
        InvalidValueError: If `pose` is not a single pose.
        CableGeometryError: If both ends of a cable coincide.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> motion = sl.unresisted_motion(robot, pose)
    """
    instance(robot, Robot, "robot")
    pose = single_pose(pose)
    lever = float(np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1).max()) or 1.0
    units = np.where(np.linalg.norm(robot.freedom[:, 3:], axis=1) > 0.5, 1.0 / lever, 1.0)
    structure = units[:, None] * structure_matrix(robot, pose)
    # The right singular vectors form an (m, m) matrix. They are computed only if the left singular vectors are not
    # complete.
    left, values, _right = np.linalg.svd(structure, full_matrices=structure.shape[1] < structure.shape[0])
    twist = robot.freedom.T @ (units * left[:, -1])
    linear, angular = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
    turns = angular * lever > 1e-6 * linear
    twist = twist / (angular if turns else linear)
    resistance = float(values[-1] / values[0]) if len(values) == robot.degrees_of_freedom else 0.0
    return UnresistedMotion(locked(twist), resistance, _in_words(robot, pose, twist, turns=bool(turns)))


def _in_words(robot: Robot, pose: Pose, twist: Array, *, turns: bool) -> str:
    if not turns:
        return f"translation along {_vector(twist[:3])}"
    axis = twist[3:]
    center = pose.position + pose.matrix @ robot.center_of_mass
    through = center + np.cross(axis, twist[:3])
    pitch = float(axis @ twist[:3])
    slide = f", sliding {pitch:.3g} m per radian along it" if abs(pitch) > 1e-6 else ""
    return f"rotation about the axis {_vector(axis)} through {_vector(through)} m{slide}"


def _vector(values: Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in np.round(values, 9)) + ")"

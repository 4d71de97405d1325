"""Poses after a small motion of the platform."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.robot.robot import Robot


def carried(before: Robot, after: Robot, poses: Array, motion: Array) -> Array:
    """Pose rows after a motion about the center of mass, which may be elsewhere in the platform then.

    Args:
        before: The robot.
        after: The same with another center of mass.
        poses: Pose rows (N, POSE_COLUMNS).
        motion: Of the center of mass and about it, world axes [m, rad], (N, 6).

    Returns:
        Pose rows; they have moved along the motions alone that the robot is free to make.
    """
    turned = Rotation.from_quat(poses[:, 3:])
    turning = Rotation.from_rotvec(motion[:, 3:]) * turned
    first, last = (np.array(robot.center_of_mass) for robot in (before, after))  # scipy takes no locked array
    shift = motion[:, :3] + turned.apply(first) - turning.apply(last)
    free = before.freedom[:, :3]
    return np.hstack((poses[:, :3] + shift @ free.T @ free, turning.as_quat()))

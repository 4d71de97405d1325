"""The box that a robot stands in."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

_FLAT: Final = 0.05  # anchors that differ in height by less than this, of the robot's size, all hang at the top


def bounds(robot: Robot) -> tuple[Array, Array]:
    """Lowest and highest corner of the box that the robot stands in [m]: its frame, or what its anchors span.

    Frames stand: their top is where the highest anchors are. Where all anchors hang at the top and no frame is given,
    the box reaches down to the floor, or to the lowest pose that the robot is meant for.

    Args:
        robot: The robot.

    Returns:
        The two corners, shape (3,) each.
    """
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    if robot.frame_size is not None:
        middle = 0.5 * (low + high)
        low, up = middle - 0.5 * robot.frame_size, middle + 0.5 * robot.frame_size
        return np.array([*low[:2], high[2] - robot.frame_size[2]]), np.array([*up[:2], high[2]])
    if high[2] - low[2] < _FLAT * float(np.linalg.norm(high - low)):
        floor = 0.0 if robot.test_box is None else min(0.0, float(robot.test_box.low[2]))
        low = np.array([*low[:2], min(floor, low[2])])
    return low, high


def home_pose(robot: Robot) -> Pose:
    """The middle of the poses that a robot is meant for, or of its box.

    Args:
        robot: The robot.
    """
    low, high = bounds(robot) if robot.test_box is None else (robot.test_box.low, robot.test_box.high)
    return Pose(0.5 * (low + high), np.eye(3))

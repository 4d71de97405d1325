"""Checks of poses: the poses of a batch may differ only by motions that the robot's motion pattern allows."""

from __future__ import annotations

from math import asin, degrees
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.robot.checks import ROTATING
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

_HOME_DECIMALS: Final = 9  # decimals of the home position [m]; they hide rounding errors
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
# [rad] and [m]; smaller deviations count as zero, because poses may be given with seven digits
ROUNDING = 1e-6


def is_underconstrained(robot: Robot) -> bool:
    """True if the robot has fewer cables than degrees of freedom."""
    return robot.cable_count < robot.degrees_of_freedom


def check_cable_count(robot: Robot, name: str | None = None) -> None:
    """Refuse an underconstrained robot; name: name of the robot in the message."""
    if is_underconstrained(robot):
        allowed = f">= {robot.degrees_of_freedom} for {robot.motion_pattern}"
        step = "Add cables, or use inverse, forward, vibration and workspace, which allow fewer."
        raise InvalidValueError(f"{name or robot.name}: number of cables", robot.cable_count, allowed, step)


def check_reach(robot: Robot, pose: Pose, item: str) -> None:
    """Refuse a batch in which poses differ by motions that the robot's motion pattern does not allow."""
    # A platform without rotations may have any orientation, which must be constant. A planar platform may rotate only
    # about the normal of its plane, and its position along the normal must be constant. NaN is accepted.
    pattern, normal = robot.motion_pattern, robot.plane_normal
    if pattern == "3R3T" or len(pose.shape) == 0 or len(pose) == 0:
        return
    turn = forbidden_turn(robot, pose, pose.quaternion[0])
    size = np.linalg.norm(turn, axis=1)
    if (outside := np.flatnonzero(size > ROUNDING)).size:
        k = int(outside[0])
        value = f"turned by {turn_in_words(turn[k])} from {item}[0]"
        allowed = "a turn about plane_normal" if pattern in ROTATING else "no turn"
        step = "Correct the poses, or choose another motion_pattern of the robot."
        raise InvalidValueError(f"{item}[{k}]", value, f"{allowed}, by motion_pattern {pattern}", step)
    height = np.zeros(1) if normal is None else (pose.position - pose.position[0]) @ normal
    if (outside := np.flatnonzero(np.abs(height) > ROUNDING)).size:
        k = int(outside[0])
        value = f"{height[k]:.6g} m along plane_normal from {item}[0]"
        step = "Project the poses onto one plane, or choose another motion_pattern of the robot."
        raise InvalidValueError(f"{item}[{k}]", value, f"0 m, by motion_pattern {pattern}", step)


def forbidden_turn(robot: Robot, pose: Pose, other: Array) -> Array:
    """Part of the rotation between the quaternion `other` (4,) and each pose that the motion pattern does not allow."""
    # Returns sin(angle/2) times the axis of rotation, (N, 3); zero for a motion pattern that allows all motions.
    own = np.atleast_2d(pose.quaternion)
    if robot.motion_pattern == "3R3T":
        return np.zeros((len(own), 3))
    turn: Array = other[3] * own[:, :3] - own[:, 3:] * other[:3] - np.cross(own[:, :3], other[:3])
    if robot.motion_pattern in ROTATING and robot.plane_normal is not None:
        turn -= np.outer(turn @ robot.plane_normal, robot.plane_normal)
    return turn


def turn_in_words(turn: Array) -> str:
    """Text of a rotation for a message; turn: nonzero vector sin(angle/2) times the axis, (3,)."""
    sine = float(np.linalg.norm(turn))
    axis = ", ".join(f"{x:.3g}" for x in np.round(turn / sine, 9) + 0.0)
    return f"{degrees(2.0 * asin(min(sine, 1.0))):.3g} deg about ({axis})"


_FLAT: Final = 0.05  # largest distance below the top, relative to the robot's size, of anchors that count as at the top


def bounds(robot: Robot) -> tuple[Array, Array]:
    """Lowest and highest corner [m], (3,) each, of a box around the robot: its frame, or the extent of its anchors."""
    # The top of the frame is at the height of the highest anchors. If the frame size is not given and all frame anchors
    # are at the top, the box extends down to the floor or to the lowest pose of the test box.
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
    """Center of the test box of a robot, or of the box around the robot."""
    low, high = bounds(robot) if robot.test_box is None else (robot.test_box.low, robot.test_box.high)
    return Pose(np.round(0.5 * (low + high), _HOME_DECIMALS), np.eye(3))

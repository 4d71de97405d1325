"""Checks of poses against the motion pattern of a robot: poses may differ only by free motions."""

from __future__ import annotations

from math import asin, degrees
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.robot.checks import ROTATING
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

_HOME_DECIMALS: Final = 9  # decimals of the home position [m], which remove the rounding errors of the middle of a box
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
# [rad] and [m]; smaller deviations count as zero, because they are the rounding errors of seven digits
ROUNDING = 1e-6
_FEWER_CABLES: Final = "Add cables, or use inverse, forward and vibration, which allow fewer."


def is_underconstrained(robot: Robot) -> bool:
    """True if the robot has fewer cables than degrees of freedom."""
    return robot.cable_count < robot.degrees_of_freedom


def check_cable_count(robot: Robot, name: str | None = None, step: str = _FEWER_CABLES) -> None:
    """Refuse an underconstrained robot. `name` and `step` are its name and the next step in the message."""
    if is_underconstrained(robot):
        allowed = f">= {robot.degrees_of_freedom} for {robot.motion_pattern}"
        raise InvalidValueError(f"{name or robot.name}: number of cables", robot.cable_count, allowed, step)


def check_reach(robot: Robot, pose: Pose, item: str) -> None:
    """Refuse a batch of poses with differences that the motion pattern of the robot does not allow.

    The orientation of a platform without rotations is arbitrary but constant. A planar platform rotates only about the
    normal of its plane, and its distance from this plane is constant. NaN is accepted.
    """
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


def check_plane(robot: Robot, pose: Pose, item: str) -> None:
    """Refuse poses of a planar robot whose cables would leave the plane of its frame anchors."""
    away = out_of_plane(robot, pose)
    if (outside := np.flatnonzero(np.abs(away) > ROUNDING)).size:
        k = int(outside[0])
        name = f"{item}[{k}]" if pose.shape else item
        value = f"{away[k]:.6g} m along plane_normal from the plane of the frame anchors"
        step = "Project the poses onto the plane, or choose another motion_pattern of the robot."
        raise InvalidValueError(name, value, f"0 m, by motion_pattern {robot.motion_pattern}", step)


def forbidden_turn(robot: Robot, pose: Pose, other: Array) -> Array:
    """Forbidden part of the rotation from the quaternion `other` (4,) to each pose, by the motion pattern.

    Returns sin(angle/2) times the axis, (N, 3); zeros if all motions are free.
    """
    own = np.atleast_2d(pose.quaternion)
    if robot.motion_pattern == "3R3T":
        return np.zeros((len(own), 3))
    turn: Array = other[3] * own[:, :3] - own[:, 3:] * other[:3] - np.cross(own[:, :3], other[:3])
    if robot.motion_pattern in ROTATING and robot.plane_normal is not None:
        turn -= np.outer(turn @ robot.plane_normal, robot.plane_normal)
    return turn


def turn_in_words(turn: Array) -> str:
    """Description of a rotation for a message; turn: sin(angle/2) times the axis, (3,), not zero."""
    sine = float(np.linalg.norm(turn))
    axis = ", ".join(f"{x:.3g}" for x in np.round(turn / sine, 9) + 0.0)
    return f"{degrees(2.0 * asin(min(sine, 1.0))):.3g} deg about ({axis})"


def out_of_plane(robot: Robot, pose: Pose) -> Array:
    """Signed distances (N,) [m] between the platform ends of a planar robot and the plane of its frame ends.

    They are zero if the robot is not planar, or if its frame ends or its platform ends are not in one plane.
    """
    away = np.zeros(len(np.atleast_2d(pose.position)))
    if robot.plane_normal is None:
        return away
    frame, platform = robot.frame_anchors @ robot.plane_normal, robot.platform_anchors @ robot.plane_normal
    if np.ptp(frame) > ROUNDING or np.ptp(platform) > ROUNDING:
        return away
    distance: Array = np.atleast_2d(pose.position) @ robot.plane_normal + platform[0] - frame[0]
    return distance


_FLAT: Final = 0.05  # anchors with a smaller height difference, relative to the size of the robot, are all at the top


def bounds(robot: Robot) -> tuple[Array, Array]:
    """Lowest and highest corner [m], (3,) each, of the box around the robot: its frame, or the range of its anchors.

    The top of the frame is at the height of the highest anchors. If all anchors are at the top and the frame is not
    given, the box extends down to the floor, or to the lowest pose of the test box.
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
    """Center of the test box of a robot, or of the box around the robot."""
    low, high = bounds(robot) if robot.test_box is None else (robot.test_box.low, robot.test_box.high)
    return Pose(np.round(0.5 * (low + high), _HOME_DECIMALS), np.eye(3))

"""The pulleys of a robot in the world: how they have turned, where they stand, and the cable on them."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.several import Robots, anchors_of, pulleys_of

_TINY = 1e-300


def outward(robot: Robots, pose: Pose) -> Array:
    """Level unit vectors from frame anchors to platform ends: pulleys turn until they stand along them.

    Args:
        robot: The robot, or one a pose.
        pose: One pose, or a batch of N.

    Returns:
        x and y of each, shape (m, 2) or (N, m, 2); zero for an end straight above or below its anchor.
    """
    anchors = anchors_of(robot)
    ends = pose.position[..., None, :] + anchors.platform @ np.swapaxes(pose.matrix, -1, -2)
    level = (ends - anchors.frame)[..., :2]
    unit: Array = level / np.maximum(np.linalg.norm(level, axis=-1, keepdims=True), _TINY)
    return unit


def on_wheels(robot: Robots, pose: Pose, angle: Array) -> Array:
    """Points on the pulleys, from where the cables enter them.

    Args:
        robot: The robot, or one a pose.
        pose: One pose, or a batch of N: the pulleys have turned towards the platform ends.
        angle: Along the cable from the frame anchor [rad], shape (..., m); the wrap angle gives the exit point.

    Returns:
        Points in the world [m], shape (..., m, 3); frame anchors where there is no pulley.
    """
    radius, entry = pulleys_of(robot)
    away = outward(robot, pose) * (radius * (1.0 - np.cos(angle)))[..., None]
    up = (radius * entry * np.sin(angle))[..., None]
    return np.asarray(anchors_of(robot).frame + np.concatenate((away, up), axis=-1))


def wheel_centers(robot: Robot, pose: Pose) -> Array:
    """Middles of the pulleys [m], shape (m, 3): beside the frame anchors, at their height."""
    centers = robot.frame_anchors.copy()
    centers[:, :2] += pulleys_of(robot).radius[:, None] * outward(robot, pose)
    return locked(centers)


def dead_cable(robot: Robots) -> Array:
    """Length of each cable between pulley and drum, which no length off the drum is below [m].

    Args:
        robot: The robot, or one a sample.

    Returns:
        Lengths, shape (m,) or (N, m); zero for a cable with nothing behind its frame anchor.
    """
    if not isinstance(robot, Robot):
        return np.stack([dead_cable(one) for one in robot])
    return np.zeros(robot.cable_count) if robot.winches is None else robot.winches.dead_cable

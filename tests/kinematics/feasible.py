"""Feasible poses of the test box of a robot, and distances between poses."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array, locked
from tests.tiers import extended

Variable = Literal["chord", "horizontal", "frame_end"]


def pose_rows(pose: sl.Pose) -> Array:
    """Positions and quaternions, (N, 7), read-only."""
    return locked(np.hstack((np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion))))


def by_tier(names: Iterable[str]) -> list[Any]:
    """Names of robots; those with pulleys belong to the second tier, which compiles their kernels."""
    return [pytest.param(name, marks=extended) if "pulleys" in name else name for name in names]


def box_poses(robot: sl.Robot, count: int, seed: int) -> sl.Pose:
    box = robot.test_box
    assert box is not None
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=(count, 3))
    axis *= rng.uniform(0.0, box.tilt, (count, 1)) / np.linalg.norm(axis, axis=1, keepdims=True)
    return sl.Pose(rng.uniform(box.low, box.high, (count, 3)), Rotation.from_rotvec(axis))


def feasible_plan(robot: sl.Robot, count: int, seed: int, model: sl.CableModel | None = None) -> sl.Plan:
    pose = box_poses(robot, count, seed)
    method = sl.MinimumNorm()
    keep = np.flatnonzero(sl.inverse(robot, pose, tension=method).feasible)
    return sl.inverse(robot, pose[keep], model=model or sl.Catenary(), tension=method)


def moved(pose: sl.Pose, distance: float, degrees: float, seed: int) -> sl.Pose:
    """Displace and rotate every pose by the same amounts in random directions."""
    rng = np.random.default_rng(seed)
    steps, axes = rng.normal(size=(2, *pose.position.shape))
    steps *= distance / np.linalg.norm(steps, axis=-1, keepdims=True)
    axes *= np.radians(degrees) / np.linalg.norm(axes, axis=-1, keepdims=True)
    turned = Rotation.from_rotvec(axes) * Rotation.from_quat(pose.quaternion.copy())
    return sl.Pose(pose.position + steps, turned)


def position_error(found: sl.ForwardSolution, pose: sl.Pose) -> Array:
    error: Array = np.linalg.norm(found.pose.position - pose.position, axis=-1)
    return error


def angle_error(found: sl.ForwardSolution, pose: sl.Pose) -> Array:
    one, other = found.pose.quaternion, pose.quaternion
    near = np.where(np.sum(one * other, axis=-1, keepdims=True) < 0.0, -other, other)
    error: Array = 2.0 * np.linalg.norm(one - near, axis=-1)
    return error


def center(pose: sl.Pose, robot: sl.Robot) -> Array:
    """Position of the center of mass."""
    at: Array = pose.position + pose.matrix @ robot.center_of_mass
    return at


def motion_between(before: sl.ForwardSolution, after: sl.ForwardSolution) -> Array:
    """Displacement of the center of mass and rotation vector, world axes."""
    robot = before.state.one_robot
    first, last = (Rotation.from_quat(s.pose.quaternion.copy()) for s in (before, after))
    turn: Array = (last * first.inv()).as_rotvec()
    shift = center(after.pose, robot) - center(before.pose, robot)
    return np.concatenate((shift, turn), axis=-1)


def unbalance(
    robot: sl.Robot, model: sl.CableModel, lengths: Array, position: Array, rotation: Rotation, wrench: Array
) -> Array:
    """Residual wrench on the platform about its center of mass, computed with the public cable models."""
    lever = rotation.apply(robot.platform_anchors - robot.center_of_mass)
    reach = position + rotation.apply(robot.platform_anchors.copy()) - robot.frame_anchors
    span = np.hypot(reach[:, 0], reach[:, 1])
    state = model.from_length(robot.cables, span, reach[:, 2], lengths, robot.gravity)
    level = reach[:, :2] / span[:, None]
    force = -np.column_stack((level * state.horizontal_tension[:, None], state.vertical_force))
    total = np.concatenate((force.sum(axis=0), np.cross(lever, force).sum(axis=0))) + wrench
    total[2] -= robot.mass * robot.gravity
    return total

"""The balance and its sharing written out in NumPy and handed to other programs: the tests' independent reference."""

from collections.abc import Iterator

import daqp
import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from sagline.files.robot_file import load_robot
from sagline.kinematics.plan import Plan
from sagline.robot.catalogue import robot_names
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


def random_poses(robot: Robot, count: int, rng: np.random.Generator, stretch: float = 1.0) -> Pose:
    """Poses in the robot's test box, stretched about its center; tilted about any axis."""
    box = robot.test_box
    assert box is not None
    middle, half = (box.high + box.low) / 2, (box.high - box.low) / 2 * stretch
    axes = rng.normal(size=(count, 3))
    angles = rng.uniform(-box.tilt, box.tilt, (count, 1)) * stretch
    turns = axes / np.linalg.norm(axes, axis=1, keepdims=True) * angles
    return Pose(middle + half * rng.uniform(-1, 1, (count, 3)), Rotation.from_rotvec(turns))


def presets() -> Iterator[Robot]:
    yield from map(load_robot, robot_names())


def structure(robot: Robot, pose: Pose) -> np.ndarray:
    """J (6, m) of one pose: columns (u; r x u)."""
    turn = pose.rotation.as_matrix()
    lever = (robot.platform_anchors - robot.center_of_mass) @ turn.T
    rope = robot.frame_anchors - (pose.position + robot.platform_anchors @ turn.T)
    unit = rope / np.linalg.norm(rope, axis=1, keepdims=True)
    return np.concatenate((unit.T, np.cross(lever, unit).T))


def needed(robot: Robot, wrench: np.ndarray) -> np.ndarray:
    """What weightless cables must supply (6,)."""
    return np.array([0, 0, robot.mass * robot.gravity, 0, 0, 0]) - wrench


def unbalanced(plan: Plan) -> np.ndarray:
    """Force and moment left over at every pose (N, 6), from the cables' forces and anchors alone."""
    robot, state = plan.state.robot, plan.state.cables
    pose = plan.state.pose
    turn = pose.rotation.as_matrix().reshape(-1, 3, 3)
    ends = pose.position.reshape(-1, 1, 3) + robot.platform_anchors @ np.swapaxes(turn, 1, 2)
    lever = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(turn, 1, 2)
    rope = ends - robot.frame_anchors
    azimuth = np.arctan2(rope[..., 1], rope[..., 0])
    tx, tz = np.atleast_2d(state.horizontal_tension), np.atleast_2d(state.vertical_force)
    force = -np.stack((tx * np.cos(azimuth), tx * np.sin(azimuth), tz), axis=-1)
    total = np.concatenate((force.sum(axis=1), np.cross(lever, force).sum(axis=1)), axis=1)
    total[:, 2] -= robot.mass * robot.gravity
    return np.asarray(total + plan.state.wrench)


def is_feasible(matrix: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> bool:
    """The verdict of a linear program."""
    bounds = np.column_stack((low, np.where(np.isfinite(high), high, np.inf)))
    scale = np.abs(right).max()
    found = linprog(np.zeros(len(low)), A_eq=matrix, b_eq=right / scale, bounds=bounds / scale, method="highs")
    assert found.status in (0, 2), found.message
    return bool(found.status == 0)


def nearest(
    matrix: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray, target: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Tensions of least weighted distance to a target, by DAQP."""
    rows = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
    sides = right / np.linalg.norm(matrix, axis=1)
    upper = np.concatenate((np.minimum(high, 1e30), sides))
    lower = np.concatenate((low, sides))
    sense = np.concatenate((np.zeros(len(low)), np.full(len(sides), 5))).astype(np.int32)
    x, _value, flag, _info = daqp.solve(
        np.diag(weights), -weights * target, rows, upper, lower, sense, primal_tol=1e-10, dual_tol=1e-12
    )
    assert flag == 1
    return np.asarray(x)

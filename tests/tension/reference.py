"""Balance and tension distribution in NumPy and other programs, the independent reference of the tests."""

from functools import cache
from typing import Any, NamedTuple

import daqp
import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline import Cable, MinimumNorm, Plan, Pose, Robot, inverse, load_robot, robot_names
from sagline.core.arrays import Array
from tools.size import public_values

BORDER_ROBOTS = ["article-suspended", "article-mixed", "expo2015-lucia", "ipanema-1", "fast"]


def random_poses(robot: Robot, count: int, rng: np.random.Generator, stretch: float = 1.0) -> Pose:
    """Poses in the test box of the robot, enlarged about its center and tilted about any axis."""
    box = robot.test_box
    assert box is not None
    middle, half = (box.high + box.low) / 2, (box.high - box.low) / 2 * stretch
    axes = rng.normal(size=(count, 3))
    angles = rng.uniform(-box.tilt, box.tilt, (count, 1)) * stretch
    turns = axes / np.linalg.norm(axes, axis=1, keepdims=True) * angles
    return Pose(middle + half * rng.uniform(-1, 1, (count, 3)), Rotation.from_rotvec(turns))


def public_methods() -> dict[str, type[sl.TensionMethod]]:
    """All tension distribution methods of the public surface, by name."""
    return {
        name: kind
        for name, kind in public_values().items()
        if isinstance(kind, type) and issubclass(kind, sl.TensionMethod) and kind is not sl.TensionMethod
    }


@cache
def presets() -> tuple[Robot, ...]:
    return tuple(load_robot(name) for name in robot_names())


def ropes(robot: Robot, ends: np.ndarray) -> np.ndarray:
    """Vectors from platform ends (..., m, 3) to the points of tangency of straight cables, or to the frame anchors."""
    anchors = robot.frame_anchors
    if robot.winches is not None:
        radius, entry = robot.winches.pulley_radius, robot.winches.swivel_axis[:, 2]
        span = np.hypot(*np.moveaxis(ends - anchors, -1, 0)[:2])
        outward = (ends - anchors) * [1.0, 1.0, 0.0] / span[..., None]
        across, drop = span - radius, -entry * (ends - anchors)[..., 2]  # from the center of the pulley
        # angle of the exit beyond the top of the pulley (beyond its bottom, for a cable from above)
        past = np.arctan2(drop, across) + np.arcsin(radius / np.hypot(across, drop))
        up = np.array([0.0, 0.0, 1.0]) * entry[:, None]
        anchors = anchors + radius[:, None] * ((1.0 + np.sin(past))[..., None] * outward + np.cos(past)[..., None] * up)
    return np.asarray(anchors - ends)


def clear_of_pulleys(robot: Robot, poses: Pose) -> np.ndarray:
    """Poses (N,) with all platform ends farther from the swivel axes than twice the radius."""
    radius = np.zeros(robot.cable_count) if robot.winches is None else robot.winches.pulley_radius
    ends = poses.position[:, None] + robot.platform_anchors @ np.swapaxes(poses.rotation.as_matrix(), 1, 2)
    span = np.hypot(*np.moveaxis(ends - robot.frame_anchors, -1, 0)[:2])
    return np.asarray((span > 2.0 * radius).all(axis=1))


def structure(robot: Robot, pose: Pose) -> np.ndarray:
    """J (6, m) of one pose: columns (u; r x u)."""
    turn = pose.rotation.as_matrix()
    lever = (robot.platform_anchors - robot.center_of_mass) @ turn.T
    rope = ropes(robot, pose.position + robot.platform_anchors @ turn.T)
    unit = rope / np.linalg.norm(rope, axis=1, keepdims=True)
    return np.asarray(np.concatenate((unit.T, np.cross(lever, unit).T)))


def structures(robot: Robot, poses: Pose) -> np.ndarray:
    """J (N, 6, m) of a batch."""
    turn = poses.rotation.as_matrix()
    lever = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(turn, 1, 2)
    rope = ropes(robot, poses.position[:, None] + robot.platform_anchors @ np.swapaxes(turn, 1, 2))
    unit = rope / np.linalg.norm(rope, axis=2, keepdims=True)
    both = np.concatenate((np.swapaxes(unit, 1, 2), np.swapaxes(np.cross(lever, unit), 1, 2)), axis=1)
    return np.asarray(both)


def needed(robot: Robot, wrench: np.ndarray) -> np.ndarray:
    """Required wrench of weightless cables (6,)."""
    return np.asarray(np.array([0, 0, robot.mass * robot.gravity, 0, 0, 0]) - wrench)


def unbalanced(plan: Plan) -> np.ndarray:
    """Residual force and moment at each pose (N, 6), from the forces and anchors of the cables only."""
    robot, state = plan.state.one_robot, plan.state.cables
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
    """Verdict of a linear program."""
    bounds = np.column_stack((low, np.where(np.isfinite(high), high, np.inf)))
    scale = np.abs(right).max()
    found = linprog(
        np.zeros(len(low)),
        A_eq=matrix,
        b_eq=right / scale,
        bounds=bounds / scale,
        method="highs-ds",
        options={"presolve": False, "primal_feasibility_tolerance": 1e-10},
    )
    assert found.status in (0, 2), found.message
    return bool(found.status == 0)


def nearest(
    matrix: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray, target: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Tensions with the least weighted distance to a target, by DAQP."""
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


def planar(**changes: Any) -> Robot:
    """Four cables to one point of a level plane, without weight across it; limits 3.8 to 25 N."""
    side = 0.315
    fields: dict[str, Any] = {
        "name": "planar",
        "frame_anchors": [[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0]],
        "platform_anchors": np.zeros((4, 3)),
        "cables": Cable(1e-3, 1e5),
        "mass": 1.0,
        "motion_pattern": "2T",
        "plane_normal": [0, 0, 1],
        "tension_min": 3.8,
        "tension_max": 25.0,
    }
    return Robot(**{**fields, **changes})


class Border(NamedTuple):
    """Feasible poses and directions of load (N, 6), and the largest load along each that is feasible (N,)."""

    robot: Robot
    poses: Pose
    ways: Array
    loads: Array


def found_border(name: str, count: int, seed: int) -> Border:
    """Increase the load from zero, along a force of 1 N with some moment, until it is infeasible; then bisect."""
    robot = load_robot(name)
    rng = np.random.default_rng(seed)
    poses = random_poses(robot, 20 * count, rng)
    poses = poses[np.flatnonzero(inverse(robot, poses, tension=MinimumNorm()).feasible)[:count]]
    ways = rng.normal(size=(count, 6))
    ways[:, 3:] *= 0.3 * np.ptp(robot.platform_anchors, axis=0).max()
    ways /= np.linalg.norm(ways[:, :3], axis=1, keepdims=True)
    low, high = np.zeros(count), np.full(count, 1e-3 * robot.mass * robot.gravity)
    while (held := can_hold(robot, poses, ways * high[:, None])).any():
        low, high = np.where(held, high, low), np.where(held, 2 * high, high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        held = can_hold(robot, poses, ways * middle[:, None])
        low, high = np.where(held, middle, low), np.where(held, high, middle)
    return Border(robot, poses, ways, low)


def can_hold(robot: Robot, poses: Pose, wrench: Array) -> np.ndarray:
    """Feasibility of poses with sag under a load (N, 6), by the verdict itself."""
    return inverse(robot, poses, tension=MinimumNorm(), wrench=wrench).feasible

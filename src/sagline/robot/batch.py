"""One robot for all poses, or one robot per pose: common properties of all robots of a batch, and selections."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sagline.cables.cable import Cable
from sagline.core.arguments import brief, listed
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

Robots: TypeAlias = Robot | tuple[Robot, ...]  # a robot, or a checked batch of robots
Index: TypeAlias = int | slice | NDArray[Any]  # index of a batch

# properties that are equal for all robots of a batch, and their units
_ALIKE = {"cable_count": "", "motion_pattern": "", "tension_limits_of": "", "gravity": " m/s^2"}


def together(robot: Robot | Sequence[Robot]) -> Robots:
    """Check `robot`: a robot, or several with common properties (`_ALIKE`, plane normal), as a tuple."""
    if isinstance(robot, Robot):
        return robot
    robots = listed(robot, Robot, "robot")
    first = first_of(robots)
    for index, other in enumerate(robots):
        _check_alike(first, other, index)
    return robots


def check_count(robot: Robots, poses: int | None) -> None:
    """Refuse a tuple of robots unless it has one robot per pose; poses: number of poses, None for a single pose."""
    if isinstance(robot, Robot) or len(robot) == poses:
        return
    allowed = "one robot" if poses is None else f"one robot, or a sequence of {poses}"
    step = "Give one robot per pose; to solve one pose for all robots, repeat the pose."
    raise InvalidValueError("robot", f"a sequence of {len(robot)} robots", allowed, step)


def one_a_pose(robot: Robot | Sequence[Robot], poses: int | None) -> Robots:
    """Check the robot, or the tuple with one robot per pose: `together`, then `check_count`."""
    robots = together(robot)
    check_count(robots, poses)
    return robots


def first_of(robot: Robots) -> Robot:
    """The robot, or the first of several robots, whose common properties apply to all; refuses an empty selection."""
    if isinstance(robot, Robot):
        return robot
    if not robot:
        raise InvalidValueError("robot", "an empty sequence", "at least one robot", "Select at least one robot.")
    return robot[0]


def robots_at(robot: Robots, index: Index) -> Robots:
    """The single robot of all poses; if each pose has its robot, the robots at the poses of an index."""
    if isinstance(robot, Robot):
        return robot
    chosen = np.arange(len(robot))[index]
    return robot[int(chosen)] if np.ndim(chosen) == 0 else tuple(robot[i] for i in chosen)


def robot_at(robot: Robots, pose: int) -> Robot:
    """The robot of one pose."""
    return robot if isinstance(robot, Robot) else robot[pose]


def cables_of(robot: Robots) -> Cable:
    """Material of the cables, (m,), or (N, m) for several robots; optional fields only if all robots have them."""
    if isinstance(robot, Robot):
        return robot.cables
    materials = [one.cables.known() for one in robot]
    names = [name for name in materials[0] if all(name in material for material in materials)]
    return Cable(**{name: np.stack([material[name] for material in materials]) for name in names})


def has_routing(robot: Robots) -> bool:
    """True if any cable runs over a pulley or has a dead length."""
    robots = (robot,) if isinstance(robot, Robot) else robot
    return any(one.winches is not None and one.winches.anything_behind for one in robots)


def robot_fields(robot: Robots, *names: str) -> tuple[Array, ...]:
    """Fields of a robot; fields of several robots are stacked along a leading axis N."""
    return _each(robot, lambda one: tuple(np.asarray(getattr(one, name)) for name in names))


class _Pulleys(NamedTuple):
    """The pulleys of the cables; a cable without a pulley has radius 0 and enters from below."""

    radius: Array  # R [m], shape (m,) or, for several robots, (N, m)
    entry: Array  # +1 if a cable enters from below, -1 if from above, of the same shape


def pulleys_of(robot: Robots) -> _Pulleys:
    """Pulleys of the robot or robots."""

    def own(one: Robot) -> tuple[Array, ...]:
        if one.winches is None:
            return np.zeros(one.cable_count), np.ones(one.cable_count)
        return one.winches.pulley_radius, one.winches.swivel_axis[:, 2]

    return _Pulleys(*_each(robot, own))


def _each(robot: Robots, own: Callable[[Robot], tuple[Array, ...]]) -> tuple[Array, ...]:
    """Arrays of one robot, unchanged; or arrays of several robots, stacked along a leading axis N."""
    if isinstance(robot, Robot):
        return own(robot)
    return tuple(np.stack(arrays) for arrays in zip(*(own(one) for one in robot), strict=True))


def _check_alike(first: Robot, other: Robot, index: int) -> None:
    if not isinstance(other, Robot):
        raise InvalidValueError(f"robot[{index}]", brief(other), "a Robot", "Give robots only.")
    if other is first:
        return
    step = "This value must be equal for all robots of a batch; use another batch for other values."
    for name, unit in _ALIKE.items():
        value, wanted = getattr(other, name), getattr(first, name)
        if value != wanted:
            raise InvalidValueError(f"robot[{index}]: {name}", f"{value}{unit}", f"{wanted}{unit}, as robot[0]", step)
    # both normals are given or both are None, because the motion patterns are equal
    normal, wanted = other.plane_normal, first.plane_normal
    if normal is not None and wanted is not None and not np.array_equal(normal, wanted):
        raise InvalidValueError(f"robot[{index}]: plane_normal", normal, f"{wanted}, as robot[0]", step)


_TINY = 1e-300


def outward(robot: Robots, pose: Pose) -> Array:
    """Horizontal unit vectors from frame anchors to platform ends, (..., m, 2); zero for a vertical cable."""
    frame, platform = robot_fields(robot, "frame_anchors", "platform_anchors")
    ends = pose.position[..., None, :] + platform @ np.swapaxes(pose.matrix, -1, -2)
    level = (ends - frame)[..., :2]
    unit: Array = level / np.maximum(np.linalg.norm(level, axis=-1, keepdims=True), _TINY)
    return unit


def points_on_pulleys(robot: Robots, pose: Pose, angle: Array) -> Array:
    """Points on the pulleys in the world [m], (..., m, 3); frame anchors for cables without a pulley.

    pose: one pose, or a batch of N, which defines the swivel angles of the pulleys; angle: angle along the pulley
    [rad], (..., m): 0 at the frame anchor, the wrap angle at the exit point.
    """
    radius, entry = pulleys_of(robot)
    away = outward(robot, pose) * (radius * (1.0 - np.cos(angle)))[..., None]
    up = (radius * entry * np.sin(angle))[..., None]
    (frame,) = robot_fields(robot, "frame_anchors")
    return np.asarray(frame + np.concatenate((away, up), axis=-1))


def pulley_centers(robot: Robot, pose: Pose) -> Array:
    """Centers of the pulleys [m], shape (m, 3), at a horizontal distance of one radius from the frame anchors."""
    centers = robot.frame_anchors.copy()
    centers[:, :2] += pulleys_of(robot).radius[:, None] * outward(robot, pose)
    return locked(centers)


def dead_cable(robot: Robots) -> Array:
    """Dead length of each cable [m], (m,) or (N, m): lower bound of its length off the drum."""
    if not isinstance(robot, Robot):
        return np.stack([dead_cable(one) for one in robot])
    return np.zeros(robot.cable_count) if robot.winches is None else robot.winches.dead_cable

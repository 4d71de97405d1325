"""Batches with one robot for all poses, or with one robot per pose: checks, selections and common properties."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sagline.cables.cable import Cable
from sagline.core.arguments import brief, listed
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

Robots: TypeAlias = Robot | tuple[Robot, ...]  # one robot for all poses, or one checked robot per pose
Index: TypeAlias = int | slice | NDArray[Any]  # index that selects poses of a batch

# Properties that must be equal for all robots of a batch, and the units of these properties.
_ALIKE = {"cable_count": "", "motion_pattern": "", "tension_limits_of": "", "gravity": " m/s^2"}


def together(robot: Robot | Sequence[Robot]) -> Robots:
    """Checked robot, or tuple of checked robots; all robots of a tuple have equal properties `_ALIKE`."""
    if isinstance(robot, Robot):
        return robot
    robots = listed(robot, Robot, "robot")
    first = first_of(robots)
    for index, other in enumerate(robots):
        _check_alike(first, other, index)
    return robots


def check_count(robot: Robots, poses: int | None) -> None:
    """Refuse a tuple of robots with a length other than `poses`, the number of poses (None for a single pose)."""
    if isinstance(robot, Robot) or len(robot) == poses:
        return
    allowed = "one robot" if poses is None else f"one robot, or a sequence of {poses}"
    step = "Give one robot per pose; to solve one pose for all robots, repeat the pose."
    raise InvalidValueError("robot", f"a sequence of {len(robot)} robots", allowed, step)


def one_a_pose(robot: Robot | Sequence[Robot], poses: int | None) -> Robots:
    """Checked robot for all poses, or checked tuple with one robot per pose; poses: number of poses, or None."""
    robots = together(robot)
    check_count(robots, poses)
    return robots


def first_of(robot: Robots) -> Robot:
    """First robot of a batch, with the properties that all robots have in common; refuses an empty tuple."""
    if isinstance(robot, Robot):
        return robot
    if not robot:
        raise InvalidValueError("robot", "an empty sequence", "at least one robot", "Select at least one robot.")
    return robot[0]


def robots_at(robot: Robots, index: Index) -> Robots:
    """Robot or robots of the poses that `index` selects; a robot for all poses is returned unchanged."""
    if isinstance(robot, Robot):
        return robot
    chosen = np.arange(len(robot))[index]
    return robot[int(chosen)] if np.ndim(chosen) == 0 else tuple(robot[i] for i in chosen)


def cables_of(robot: Robots) -> Cable:
    """Material of the cables, fields of shape (m,) or, for N robots, (N, m); a field must be known for all robots."""
    if isinstance(robot, Robot):
        return robot.cables
    materials = [one.cables.known() for one in robot]
    names = [name for name in materials[0] if all(name in material for material in materials)]
    return Cable(**{name: np.stack([material[name] for material in materials]) for name in names})


def winches_of(robot: Robots) -> list[Winch]:
    """Winches of the robot or robots, without unknown ones."""
    return [one.winches for one in ((robot,) if isinstance(robot, Robot) else robot) if one.winches is not None]


def has_routing(robot: Robots) -> bool:
    """True if any cable of the robot or robots runs over a pulley, has a dead length or a winch on the platform."""
    return any(winches.anything_behind for winches in winches_of(robot))


def has_slanted_axes(robot: Robots) -> bool:
    """True if any pulley of the robot or robots is on the platform or swivels about an axis that is not vertical."""
    return any(winches.slanted.any() for winches in winches_of(robot))


def refuse_slanted(robot: Robots, *, only_platform: bool = False) -> None:
    """Refuse a robot with a swivel axis that is not vertical, unless `only_platform`, or a winch on the platform."""
    for winches in winches_of(robot):
        refused = winches.on_platform if only_platform else winches.slanted
        if refused.any():
            cable = int(np.argmax(refused))
            if winches.on_platform[cable]:
                step = (
                    "On the platform: use inverse, forward, confirm, stiffness, modes, linearized, calibrate, view, "
                    "simulate (massless cables), margin or workspace (not with fewer cables than freedoms), without "
                    "friction."
                )
                raise InvalidValueError(f"winches: on_platform[{cable}]", "true", "false here", step)
            shown = ", ".join(f"{x:.3g}" for x in winches.swivel_axis[cable])
            step = (
                "Other axes: use inverse, forward, confirm, stiffness, modes, view, calibrate or simulate (massless "
                "cables), margin or workspace, without friction."
            )
            raise InvalidValueError(f"winches: swivel_axis[{cable}]", f"({shown})", "up or down here", step)


def on_platform(robot: Robots) -> Flags:
    """True for each cable whose winch is on the platform, (m,) or (N, m)."""
    robots = (robot,) if isinstance(robot, Robot) else robot
    none = np.zeros(first_of(robot).cable_count, dtype=np.bool_)
    flags = np.array([none if one.winches is None else one.winches.on_platform for one in robots])
    return flags[0] if isinstance(robot, Robot) else flags


def robot_fields(robot: Robots, *names: str) -> tuple[Array, ...]:
    """Fields `names` of a robot; the fields of N robots are stacked along a leading axis N."""
    return _each(robot, lambda one: tuple(np.asarray(getattr(one, name)) for name in names))


class _Pulleys(NamedTuple):
    """Pulleys of the cables; a cable without a pulley has the radius 0 and counts as entering from below."""

    radius: Array  # R [m], shape (m,) or, for several robots, (N, m)
    entry: Array  # +1 for a cable that enters its pulley from below, -1 from above; shape of `radius`


def pulleys_of(robot: Robots) -> _Pulleys:
    """Radius and direction of entry of the pulleys of a robot or of N robots, which must have vertical swivel axes."""
    refuse_slanted(robot)

    def own(one: Robot) -> tuple[Array, ...]:
        if one.winches is None:
            return np.zeros(one.cable_count), np.ones(one.cable_count)
        return one.winches.pulley_radius, np.where(one.winches.swivel_axis[:, 2] < 0.0, -1.0, 1.0)

    return _Pulleys(*_each(robot, own))


def _each(robot: Robots, own: Callable[[Robot], tuple[Array, ...]]) -> tuple[Array, ...]:
    """Arrays that the function `own` returns for a robot; the arrays of N robots are stacked along a leading axis N."""
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
    # The motion patterns are equal. Therefore, both robots have a plane normal, or neither has one.
    normal, wanted = other.plane_normal, first.plane_normal
    if normal is not None and wanted is not None and not np.array_equal(normal, wanted):
        raise InvalidValueError(f"robot[{index}]: plane_normal", normal, f"{wanted}, as robot[0]", step)


_TINY = 1e-300
_NEAR = 1e-9  # distance of an exit point from the swivel axis [m] below which its direction is lost in rounding


def pulley_radius(robot: Robots) -> Array:
    """Radii of the pulleys [m], (m,) or (N, m); zero for a cable without a pulley."""
    none = np.zeros(first_of(robot).cable_count)
    return _each(robot, lambda one: (none if one.winches is None else one.winches.pulley_radius,))[0]


class CableEnds(NamedTuple):
    """Both ends of the cables, and the swivel axes of their pulleys, in world axes, (..., m, 3) each."""

    entry: Array  # point at which the cable enters its pulley or eyelet [m]
    axis: Array  # unit vector along the cable there
    other: Array  # end without a pulley [m]


def cable_ends(robot: Robots, pose: Pose) -> CableEnds:
    """Ends of the cables at a pose or a batch. Pulleys are at the frame anchors, or on the platform at its anchors."""
    (frame, platform), back = robot_fields(robot, "frame_anchors", "platform_anchors"), np.swapaxes(pose.matrix, -1, -2)
    up = np.zeros(frame.shape[-2:]) + np.array([0.0, 0.0, 1.0])
    (axis,) = _each(robot, lambda one: (up if one.winches is None else _axes_of(one.winches),))
    ends, aboard = pose.position[..., None, :] + platform @ back, on_platform(robot)[..., None]
    return CableEnds(np.where(aboard, ends, frame), np.where(aboard, axis @ back, axis), np.where(aboard, frame, ends))


def _axes_of(winches: Winch) -> Array:
    """Swivel axes (m, 3); that of an eyelet at the frame counts as vertical, because it has no effect."""
    upright = np.zeros(winches.swivel_axis.shape)
    upright[:, 2] = np.where(winches.swivel_axis[:, 2] < 0.0, -1.0, 1.0)
    eyelet = (winches.pulley_radius == 0.0) & ~winches.on_platform
    return np.where(eyelet[:, None], upright, winches.swivel_axis)


def outward(robot: Robots, pose: Pose, exits: Array | None = None) -> Array:
    """Unit vectors (..., m, 3) from the swivel axes to the centers of the pulleys; zero for a cable along its axis.

    A pulley is in the plane of its axis and the other end of the cable, or of its axis and the exit point. `exits`
    (..., m, 3) [m]: exit points, which the weight of the cable on an inclined pulley moves out of the first plane.
    """
    entry, axis, other = cable_ends(robot, pose)

    def normal_to_axis(way: Array) -> tuple[Array, Array]:
        across = way - axis * (way * axis).sum(axis=-1, keepdims=True)
        return across, np.linalg.norm(across, axis=-1, keepdims=True)

    across, size = normal_to_axis(other - entry)
    if exits is not None:
        exact, distance = normal_to_axis(exits - entry)
        across, size = np.where(distance > _NEAR, exact, across), np.where(distance > _NEAR, distance, size)
    return np.asarray(across / np.maximum(size, _TINY))


def points_on_pulleys(robot: Robots, pose: Pose, angle: Array, exits: Array | None = None) -> Array:
    """Points on the pulleys in world axes [m], (..., m, 3); the entry point for a cable without a pulley.

    The swivel angles of the pulleys belong to `pose`, which is one pose or a batch, and to `exits` as in `outward`.
    `angle` (..., m) [rad] is the position on the pulley: 0 at the entry point, and the wrap angle at the exit point.
    """
    radius, (entry, axis, _) = pulley_radius(robot), cable_ends(robot, pose)
    away = outward(robot, pose, exits) * (radius * (1.0 - np.cos(angle)))[..., None]
    return np.asarray(entry + (away + axis * (radius * np.sin(angle))[..., None]))


def pulley_centers(robot: Robot, pose: Pose, exits: Array | None = None) -> Array:
    """Centers of the pulleys [m], shape (m, 3); the distance from the entry point is the pulley radius."""
    return locked(cable_ends(robot, pose).entry + pulley_radius(robot)[:, None] * outward(robot, pose, exits))


def dead_cable(robot: Robots, name: Literal["dead_cable", "dead_rise"] = "dead_cable") -> Array:
    """Dead length of each cable, or its rise [m], (m,) or (N, m); a length off the drum cannot be shorter."""
    if not isinstance(robot, Robot):
        return np.stack([dead_cable(one, name) for one in robot])
    return np.zeros(robot.cable_count) if robot.winches is None else np.asarray(getattr(robot.winches, name))


def drum_heights(robot: Robots, pose: Pose) -> Array:
    """Heights of the drums [m], (..., m)."""
    (frame,) = robot_fields(robot, "frame_anchors")
    turned = (drums_on_platform(robot) @ pose.matrix[..., 2, :, None])[..., 0]
    at_frame = frame[..., 2] - dead_cable(robot, "dead_rise")
    return np.where(on_platform(robot), pose.position[..., 2, None] + turned, at_frame)


def drums_on_platform(robot: Robots) -> Array:
    """Positions of drums on the platform in the platform frame [m], (m, 3) or (N, m, 3): on the swivel axes."""

    def own(one: Robot) -> tuple[Array, ...]:
        ends, winches = one.platform_anchors, one.winches
        return (ends if winches is None else ends - winches.dead_cable[:, None] * winches.swivel_axis,)

    return _each(robot, own)[0]

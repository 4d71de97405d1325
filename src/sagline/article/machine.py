"""Robots with parameter errors, and the equilibria of the platform that result from the errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

import sagline as sl
from sagline.core.arrays import Array
from sagline.robot.batch import has_routing

MODULUS, DENSITY, LOAD = "Young's modulus E", "linear density ρ", "load"
ANCHORS, DRUM, ZERO = "anchor height", "drum radius", "zero of the lengths"
PULLEY, DEAD = "pulley radius", "dead cable"
WIDTH, HEIGHT = "platform anchors, outward", "platform anchors, up and down"
Errors: TypeAlias = Mapping[str, float]  # error of each parameter in its unit, by name; missing errors are zero


class Parameter(NamedTuple):
    """Parameter of the prototype that may differ from Table 1; the error is the same for all cables."""

    name: str
    unit: str  # unit of the error
    typical: float  # typical error, in this unit
    plausible: float  # largest plausible error, in this unit; assumed, because the article does not give it
    positive: bool = False  # True if the error can only be positive


PARAMETERS = (
    Parameter(MODULUS, "%", 20.0, 50.0),
    Parameter(DENSITY, "%", 20.0, 30.0),
    Parameter(LOAD, "kg", -2.0, 5.0),
    Parameter(ANCHORS, "mm", 20.0, 50.0),
    Parameter(DRUM, "%", -1.0, 3.0),
    Parameter(ZERO, "mm", -10.0, 50.0),
    Parameter(PULLEY, "mm", 30.0, 60.0, positive=True),
    Parameter(DEAD, "m", 0.2, 4.0, positive=True),
    Parameter(WIDTH, "mm", 10.0, 20.0),
    Parameter(HEIGHT, "mm", 10.0, 20.0),
)


def robot_with_errors(robot: sl.Robot, errors: Errors) -> sl.Robot:
    """Robot with errors of some parameters: anchors, cables, routing and load."""
    off = {parameter.name: 0.0 for parameter in PARAMETERS} | dict(errors)
    cables, winches, outward = robot.cables, robot.winches, np.sign(robot.platform_anchors)
    changes: dict[str, Any] = {}  # parts without errors are not copied, because a fit needs a thousand robots
    if off[MODULUS] or off[DENSITY]:
        changes["cables"] = cables.replace(
            axial_stiffness=cables.axial_stiffness * (1.0 + 0.01 * off[MODULUS]),
            linear_density=cables.linear_density * (1.0 + 0.01 * off[DENSITY]),
        )
    if off[PULLEY] or off[DEAD]:
        winches = sl.Winch() if winches is None else winches
        changes["winches"] = winches.replace(
            pulley_radius=winches.pulley_radius + 1e-3 * off[PULLEY], dead_cable=winches.dead_cable + off[DEAD]
        )
    return robot.replace(
        mass=robot.mass + off[LOAD],
        frame_anchors=robot.frame_anchors + np.array([0.0, 0.0, 1e-3 * off[ANCHORS]]),
        platform_anchors=robot.platform_anchors + 1e-3 * outward * [off[WIDTH], off[WIDTH], off[HEIGHT]],
        **changes,
    )


def wound_lengths(plan: sl.Plan, home: sl.Plan, errors: Errors) -> Array:
    """Actual lengths that the winches give for commanded lengths."""
    from_home = plan.unstrained_length - home.unstrained_length
    return plan.unstrained_length + 0.01 * errors.get(DRUM, 0.0) * from_home + 1e-3 * errors.get(ZERO, 0.0)


def rest_positions(robot: sl.Robot, plan: sl.Plan, home: sl.Plan, errors: Sequence[Errors]) -> Array:
    """Equilibria of robots with errors; their lengths are planned for the robot without errors."""
    # In the home pose, the encoders are set to the planned lengths. Therefore, the lengths on pulleys and the dead
    # lengths at home have no effect.
    robots = [robot_with_errors(robot, one) for one in errors]
    off_drum = np.stack([wound_lengths(plan, home, one) for one in errors]) + _not_counted(robots, home)[:, None]
    count, poses, m = off_drum.shape
    repeated = [one for one in robots for _ in range(poses)]
    found = sl.forward(repeated, off_drum.reshape(-1, m), start=plan.state.pose[np.tile(np.arange(poses), count)])
    if not found.solved.all():
        index = int(np.argmin(found.solved))
        raise sl.InvalidValueError(
            "the changed robot",
            f"without a stable equilibrium at pose {index % poses}",
            "smaller changes",
            "Reduce the change of the robot.",
        )
    return found.pose.position.reshape(count, poses, 3)


def _not_counted(robots: Sequence[sl.Robot], home: sl.Plan) -> Array:
    """Cable lengths on pulleys and behind them, at the home pose [m], shape (K, m)."""
    added = np.zeros((len(robots), home.unstrained_length.shape[-1]))
    behind = [index for index, robot in enumerate(robots) if has_routing(robot)]
    if behind:
        pose = home.state.pose[np.zeros(len(behind), dtype=int)]
        there = [robots[index] for index in behind]
        bare = [robot.replace(winches=None) for robot in there]
        with_them, without = (sl.inverse(some, pose, tension=home.tension).unstrained_length for some in (there, bare))
        added[behind] = with_them - without
    return added

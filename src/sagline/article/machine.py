"""A robot as it is rather than as it was planned: parameters that are off, and where the platform then rests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot
from sagline.robot.several import anything_behind
from sagline.robot.winch import Winch

MODULUS, DENSITY, LOAD = "Young's modulus E", "linear density ρ", "load"
ANCHORS, DRUM, ZERO = "anchor height", "drum radius", "zero of the lengths"
PULLEY, DEAD = "pulley radius", "dead cable"
WIDTH, HEIGHT = "platform anchors, outward", "platform anchors, up and down"


class Parameter(NamedTuple):
    """Something about the prototype that may be other than Table 1 says, for all cables alike.

    Attributes:
        name: What it is.
        unit: Unit in which its error is told.
        typical: An error that is told as an example, in that unit.
        plausible: The largest error we think possible, in that unit; ours, the article says nothing of it.
        positive: Whether it can only be larger than planned.
    """

    name: str
    unit: str
    typical: float
    plausible: float
    positive: bool = False


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

Errors: TypeAlias = Mapping[
    str, float
]  # of parameters by name, each in its unit; those that are left out are as planned


def machine(robot: Robot, errors: Errors) -> Robot:
    """The robot with some of its parameters off: what the cables hang from, what they are and what they carry.

    Args:
        robot: As it was planned.
        errors: By how much parameters are off. `DRUM` and `ZERO` change no robot but what is wound: see `wound`.

    Returns:
        Another robot.
    """
    off = {parameter.name: 0.0 for parameter in PARAMETERS} | dict(errors)
    cables, winches, outward = robot.cables, robot.winches, np.sign(robot.platform_anchors)
    changes: dict[str, Any] = {}  # what is as planned is not made again: a fit makes a thousand robots
    if off[MODULUS] or off[DENSITY]:
        changes["cables"] = cables.replace(
            axial_stiffness=cables.axial_stiffness * (1.0 + 0.01 * off[MODULUS]),
            linear_density=cables.linear_density * (1.0 + 0.01 * off[DENSITY]),
        )
    if off[PULLEY] or off[DEAD]:
        winches = Winch() if winches is None else winches
        changes["winches"] = winches.replace(
            pulley_radius=winches.pulley_radius + 1e-3 * off[PULLEY], dead_cable=winches.dead_cable + off[DEAD]
        )
    return robot.replace(
        mass=robot.mass + off[LOAD],
        frame_anchors=robot.frame_anchors + np.array([0.0, 0.0, 1e-3 * off[ANCHORS]]),
        platform_anchors=robot.platform_anchors + 1e-3 * outward * [off[WIDTH], off[WIDTH], off[HEIGHT]],
        **changes,
    )


def wound(plan: Plan, home: Plan, errors: Errors) -> Array:
    """What the winches wind when they are told planned lengths.

    Args:
        plan: N planned poses at rest.
        home: The plan of the home pose alone, a batch of one, where the winches count from.
        errors: `DRUM`: the drums' radii are off, counted from home; `ZERO`: every cable is longer at every pose.

    Returns:
        Lengths, but for what is wrapped and dead, which no encoder counts [m], shape (N, m).
    """
    from_home = plan.unstrained_length - home.unstrained_length
    return plan.unstrained_length + 0.01 * errors.get(DRUM, 0.0) * from_home + 1e-3 * errors.get(ZERO, 0.0)


def rest(robot: Robot, plan: Plan, home: Plan, errors: Sequence[Errors]) -> Array:
    """Where the platform rests on what is wound for the lengths of a plan, if the robot is other than planned.

    Encoders are set while the platform rests in its home pose, held as planned: what pulleys and dead cable add to the
    lengths there is not counted.

    Args:
        robot: As it was planned.
        plan: Its plan for N poses at rest.
        home: The plan of its home pose alone, a batch of one, where the winches count from.
        errors: K ways in which it may be off.

    Returns:
        Positions of the platform origin [m], shape (K, N, 3).

    Raises:
        InvalidValueError: If the cables do not hold the platform in a stable equilibrium at some pose.
    """
    robots = [machine(robot, one) for one in errors]
    off_drum = np.stack([wound(plan, home, one) for one in errors]) + _not_counted(robots, home)[:, None]
    count, poses, m = off_drum.shape
    repeated = [one for one in robots for _ in range(poses)]
    found = forward(repeated, off_drum.reshape(-1, m), start=plan.state.pose[np.tile(np.arange(poses), count)])
    if not found.solved.all():
        index = int(np.argmin(found.solved))
        raise InvalidValueError(
            "the changed robot",
            f"not held in a stable equilibrium at pose {index % poses}",
            "smaller changes",
            "Change it by less.",
        )
    return found.pose.position.reshape(count, poses, 3)


def _not_counted(robots: Sequence[Robot], home: Plan) -> Array:
    """By how much pulleys and dead cable lengthen the cables that hold the platform at home [m], shape (K, m)."""
    added = np.zeros((len(robots), home.unstrained_length.shape[-1]))
    behind = [index for index, robot in enumerate(robots) if anything_behind(robot)]
    if behind:
        pose = home.state.pose[np.zeros(len(behind), dtype=int)]
        there = [robots[index] for index in behind]
        bare = [robot.replace(winches=None) for robot in there]
        with_them, without = (inverse(some, pose, tension=home.tension).unstrained_length for some in (there, bare))
        added[behind] = with_them - without
    return added

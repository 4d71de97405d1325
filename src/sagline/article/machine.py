"""A robot as it is rather than as it was planned: parameters that are off, and where the platform then rests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sagline.arrays import Array
from sagline.errors import InvalidValueError
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

MODULUS, DENSITY = "Young's modulus E", "linear density ρ"
PULLEY_ROUNDS = 8  # the exit points move by a radius, the platform by less


@dataclass(frozen=True, slots=True, eq=False)
class Machine:
    """A real robot.

    Attributes:
        robot: Its true geometry, load and cables.
        drum_error: Relative error of the drum radius: how much too much is wound, counted from the home pose.
        length_offset: By how much every cable is longer than planned, at every pose [m].
        pulley_radius: Of pulleys that swivel about a vertical axis through the frame anchors, where the cable
            enters them from below [m]. The planned lengths know nothing of them, but the encoders are set
            while the platform rests in its home pose.
    """

    robot: Robot
    drum_error: float = 0.0
    length_offset: float = 0.0
    pulley_radius: float = 0.0

    def rest(self, plan: Plan, home: Plan) -> Array:
        """Where the platform rests on the lengths of a plan.

        Args:
            plan: N planned poses at rest.
            home: The plan of the home pose alone, a batch of one, where the winches count from.

        Returns:
            Positions of the platform origin [m], shape (N, 3).

        Raises:
            InvalidValueError: If the cables do not hold the platform in a stable equilibrium at some pose.
        """
        lengths = plan.unstrained_length + self.length_offset
        lengths = lengths + self.drum_error * (plan.unstrained_length - home.unstrained_length)
        if self.pulley_radius == 0.0:
            return _rest(self.robot, lengths, plan.state.pose)
        at_home = _zero(self.robot, home, self.pulley_radius)
        return np.array(
            [self._rest_on_pulleys(row + at_home, pose) for row, pose in zip(lengths, plan.state.pose, strict=True)]
        )

    def _rest_on_pulleys(self, lengths: Array, start: Pose) -> Array:
        """One pose: the exit points of the cables follow the platform, round by round."""
        position = start.position
        for _ in range(PULLEY_ROUNDS):
            exits, wrapped = _exits(self.robot, Pose.from_quaternion(position, start.quaternion), self.pulley_radius)
            seen = self.robot.replace(frame_anchors=exits)
            new = _rest(seen, (lengths - wrapped)[None], Pose.from_quaternion(position[None], start.quaternion))[0]
            step, position = float(np.abs(new - position).max()), new
            if step < 1e-9:
                break
        return position


class Parameter(NamedTuple):
    """Something about the prototype that may be other than Table 1 says.

    Attributes:
        name: What it is.
        unit: Unit in which its error is told.
        typical: An error that is told as an example, in that unit.
        plausible: The largest error we think possible, in that unit; ours, the article says nothing of it.
        positive: Whether it can only be larger than planned.
        changed: The machine of a robot with this error, in that unit.
    """

    name: str
    unit: str
    typical: float
    plausible: float
    positive: bool
    changed: Callable[[Machine, float], Machine]


def _with_robot(machine: Machine, **changes: object) -> Machine:
    return replace(machine, robot=machine.robot.replace(**changes))


def _modulus(machine: Machine, percent: float) -> Machine:
    cables = machine.robot.cables
    changed = cables.replace(axial_stiffness=cables.axial_stiffness * (1.0 + 0.01 * percent))
    return _with_robot(machine, cables=changed)


def _density(machine: Machine, percent: float) -> Machine:
    cables = machine.robot.cables
    changed = cables.replace(linear_density=cables.linear_density * (1.0 + 0.01 * percent))
    return _with_robot(machine, cables=changed)


def _load(machine: Machine, kilograms: float) -> Machine:
    return _with_robot(machine, mass=machine.robot.mass + kilograms)


def _anchor_height(machine: Machine, millimeters: float) -> Machine:
    return _with_robot(machine, frame_anchors=machine.robot.frame_anchors + np.array([0.0, 0.0, 1e-3 * millimeters]))


def _platform_width(machine: Machine, millimeters: float) -> Machine:
    anchors = machine.robot.platform_anchors
    return _with_robot(machine, platform_anchors=anchors + np.sign(anchors) * [1e-3 * millimeters] * [1.0, 1.0, 0.0])


def _platform_height(machine: Machine, millimeters: float) -> Machine:
    anchors = machine.robot.platform_anchors
    return _with_robot(machine, platform_anchors=anchors + np.sign(anchors) * [0.0, 0.0, 1e-3 * millimeters])


def _drum(machine: Machine, percent: float) -> Machine:
    return replace(machine, drum_error=machine.drum_error + 0.01 * percent)


def _offset(machine: Machine, millimeters: float) -> Machine:
    return replace(machine, length_offset=machine.length_offset + 1e-3 * millimeters)


def _pulley(machine: Machine, millimeters: float) -> Machine:
    return replace(machine, pulley_radius=machine.pulley_radius + 1e-3 * millimeters)


PARAMETERS = (
    Parameter(MODULUS, "%", 20.0, 50.0, False, _modulus),
    Parameter(DENSITY, "%", 20.0, 30.0, False, _density),
    Parameter("load", "kg", -2.0, 5.0, False, _load),
    Parameter("anchor height", "mm", 20.0, 50.0, False, _anchor_height),
    Parameter("drum radius", "%", -1.0, 3.0, False, _drum),
    Parameter("zero of the lengths", "mm", -10.0, 50.0, False, _offset),
    Parameter("pulley radius", "mm", 30.0, 60.0, True, _pulley),
    Parameter("platform anchors, outward", "mm", 10.0, 20.0, False, _platform_width),
    Parameter("platform anchors, up and down", "mm", 10.0, 20.0, False, _platform_height),
)


def _rest(robot: Robot, lengths: Array, start: Pose) -> Array:
    found = forward(robot, lengths, start=start)
    if not found.solved.all():
        pose = int(np.argmin(found.solved))
        raise InvalidValueError(
            "the changed robot",
            f"not held in a stable equilibrium at pose {pose}",
            "smaller changes",
            "Change it by less.",
        )
    return found.pose.position


def _exits(robot: Robot, pose: Pose, radius: float) -> tuple[Array, Array]:
    """Where the cables leave their pulleys [m], shape (m, 3), and what is wrapped around them [m], shape (m,).

    The cable enters at the frame anchor going up, bends over the pulley toward the platform, and leaves along the line
    to the platform end.
    """
    ends = pose.transform(robot.platform_anchors)
    along = ends - robot.frame_anchors
    span = np.hypot(along[:, 0], along[:, 1])
    outward = np.stack((along[:, 0] / span, along[:, 1] / span, np.zeros_like(span)), axis=1)
    across, drop = span - radius, -along[:, 2]  # from the pulley's center to the platform end
    # the angle below the horizontal of the tangent from the platform end to the upper side of the pulley
    below = np.arctan2(drop, across) + np.arcsin(radius / np.hypot(across, drop))
    up = np.array([0.0, 0.0, 1.0])
    exits = robot.frame_anchors + radius * ((1.0 + np.sin(below))[:, None] * outward + np.cos(below)[:, None] * up)
    return exits, radius * (0.5 * np.pi + below)


def _zero(robot: Robot, home: Plan, radius: float) -> Array:
    """By how much pulleys lengthen the cables that hold the platform in its home pose [m], shape (m,).

    The encoders, set there, do not count it.
    """
    exits, wrapped = _exits(robot, home.state.pose[0], radius)
    over, bare = (
        inverse(seen, home.state.pose, tension=home.tension).unstrained_length[0]
        for seen in (robot.replace(frame_anchors=exits), robot)
    )
    zero: Array = over + wrapped - bare
    return zero

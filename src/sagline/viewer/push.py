"""Response of the platform to a force: displacement, reserve up to a limit, and compliance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.models import Straight
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import InvalidValueError
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse import inverse
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.slopes import motions_of_ends
from sagline.statics.stiffness import stiffness

FORCES: Final = 24  # trials per iteration, which divides the distance between the bounds of a limit by about 23
ITERATIONS: Final = 4
SMALLEST: Final = 1e-4  # first trial, as a share of the largest force
BEYOND: Final = 1e3  # largest force, relative to weight and tensions, for cables without an upper limit
AT_LIMIT: Final = 1e-9  # a tension counts as at its limit if the excess, relative to the largest tension, is smaller


class Push(NamedTuple):
    """A force on the platform."""

    force: Array  # force in world axes [N], shape (3,)
    at: Array  # point at which it acts, platform frame [m], shape (3,)

    def load(self, robot: Robot, pose: Pose) -> Array:
        """Wrench of the force at a pose [N, N m], shape (6,)."""
        lever = pose.matrix @ (self.at - robot.center_of_mass)
        return np.concatenate((self.force, np.cross(lever, self.force)))

    def wrench(self, state: Equilibrium, factor: Array | float = 1.0) -> Array:
        """Wrench (..., 6) on the platform at the equilibrium `state`, with the force multiplied by `factor`."""
        return np.asarray(state.wrench + np.multiply.outer(factor, self.load(state.one_robot, state.pose)))


class Reserve(NamedTuple):
    """Largest force in a direction."""

    force: float  # magnitude of the force [N]; infinite if no limit was found
    cable: int | None = None  # index of the cable that reaches its limit first; None if unknown
    upper: bool = False  # True if this is its upper limit


@dataclass(frozen=True, slots=True, eq=False)
class PushResponse:
    """Response of a platform to a force with constant unstrained lengths."""

    push: Push
    state: Equilibrium  # equilibrium without the force
    loaded: Equilibrium | None  # equilibrium with the force; None if none was found
    reserve: Reserve  # largest force until a tension reaches its limit, at constant lengths
    redistributed: Reserve  # largest force with feasible tensions at this pose
    compliance: Array  # compliance of the point of application, world axes [m/N], shape (3, 3); NaN if unknown

    @property
    def force(self) -> float:
        """Magnitude of the force [N]."""
        return float(np.linalg.norm(self.push.force))

    @property
    def displacement(self) -> Array:
        """Displacement of the point of application [m], shape (3,); NaN if unknown."""
        if self.loaded is None:
            return np.full(3, np.nan)
        return np.asarray(self.loaded.pose.transform(self.push.at) - self.state.pose.transform(self.push.at))

    @property
    def rotation(self) -> Array:
        """Rotation vector of the platform [rad], shape (3,); NaN if unknown."""
        if self.loaded is None:
            return np.full(3, np.nan)
        return np.asarray((self.loaded.pose.rotation * self.state.pose.rotation.inv()).as_rotvec())

    def scaled_pose(self, factor: float) -> Pose | None:
        """Pose with the force; the motion from the pose without the force is multiplied by a factor."""
        if self.loaded is None:
            return None
        rest, rotation = self.state.pose, Rotation.from_rotvec(factor * self.rotation) * self.state.pose.rotation
        place = rest.transform(self.push.at) + factor * self.displacement
        return Pose(place - rotation.as_matrix() @ self.push.at, rotation)


def push_response(state: Equilibrium, push: Push) -> PushResponse:
    """Response to a force, with the model of the state's cables."""
    if isinstance(state.cables.model, Straight):
        raise InvalidValueError("push: cable model", "straight", "one that stretches", "Choose another cable model.")
    found = forward(state.one_robot, state.unstrained_length, state.pose, state.cables.model, push.wrench(state))
    lever = push.at - state.one_robot.center_of_mass
    arm = motions_of_ends(state.pose.matrix @ lever)
    loaded, compliance = found.state if bool(found.solved) else None, arm @ stiffness(state).compliance @ arm.T
    return PushResponse(push, state, loaded, _reserve(state, push), _redistributed(state, push), locked(compliance))


def semi_axes(compliance: Array) -> tuple[Array, Array]:
    """Semi-axes of the compliance ellipsoid [m/N], ascending, (3,), and their directions, one per column, (3, 3)."""
    if not np.isfinite(compliance).all():
        return np.full(3, np.nan), np.eye(3)
    axes, values, _ = np.linalg.svd(compliance)
    return values[::-1], axes[:, ::-1]


def _reserve(state: Equilibrium, push: Push) -> Reserve:
    """Largest force until a tension reaches a limit, at constant lengths."""
    robot, unit = state.one_robot, Push(push.force / np.linalg.norm(push.force), push.at)
    lengths = np.tile(state.unstrained_length, (FORCES, 1))
    edge = AT_LIMIT * float(np.nanmax(state.limited_tension))

    def margins(forces: Array) -> tuple[Array, Flags, Flags]:
        found = forward(robot, lengths, state.pose, state.cables.model, unit.wrench(state, forces))
        tension = found.state.limited_tension
        to_lower, to_upper = tension - robot.tension_min, robot.tension_max - tension
        return np.minimum(to_lower, to_upper), to_upper < to_lower, found.solved

    def is_exceeded(forces: Array) -> Flags:
        margin, _, solved = margins(forces)
        return np.asarray(~solved | (margin.min(axis=1) < -edge))

    low, high = _bracket(is_exceeded, _upper_bound(state))
    if not np.isfinite(high):
        return Reserve(np.inf)
    margin, above, solved = margins(np.full(FORCES, high))
    if not solved[0]:
        return Reserve(low)
    cable = int(np.argmin(margin[0]))
    return Reserve(low, cable, bool(above[0, cable]))


def _redistributed(state: Equilibrium, push: Push) -> Reserve:
    """Largest force that tensions within the limits can balance at the pose of the state."""
    robot, unit = state.one_robot, Push(push.force / np.linalg.norm(push.force), push.at)
    poses = Pose.from_quaternion(np.tile(state.pose.position, (FORCES, 1)), np.tile(state.pose.quaternion, (FORCES, 1)))

    def is_exceeded(forces: Array) -> Flags:
        return np.asarray(~inverse(robot, poses, state.cables.model, wrench=unit.wrench(state, forces)).feasible)

    return Reserve(_bracket(is_exceeded, _upper_bound(state))[0])


def _bracket(is_exceeded: Callable[[Array], Flags], largest: float) -> tuple[float, float]:
    """Bounds of the smallest force that exceeds a limit [N]; infinite if no force exceeds a limit."""
    low, forces = 0.0, np.geomspace(SMALLEST * largest, largest, FORCES)
    high = np.inf
    for _ in range(ITERATIONS):
        exceeded = is_exceeded(forces)
        if not exceeded.any():
            return (low, high) if np.isfinite(high) else (np.inf, np.inf)
        first = int(np.argmax(exceeded))
        low, high = float(forces[first - 1]) if first else low, float(forces[first])
        forces = np.linspace(low, high, FORCES + 1)[1:]
    return low, high


def _upper_bound(state: Equilibrium) -> float:
    """Upper bound of the forces that the cables of the robot can balance [N]."""
    robot = state.one_robot
    weight = robot.mass * robot.gravity
    if np.isfinite(robot.tension_max).all():
        return weight + float(robot.tension_max.sum())
    return BEYOND * (weight + float(np.nansum(state.limited_tension)))

"""A force at the platform, and what answers it: where the platform goes, how much more it takes, how it gives way."""

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
from sagline.statics.stiffness import stiffness

FORCES: Final = 24  # tried at once: each round narrows the place of a limit to a 23rd
ROUNDS: Final = 4
SMALLEST: Final = 1e-4  # of the largest force that is tried: the first one
BEYOND: Final = 1e3  # largest force that is tried, of the robot's own where its cables have no upper limit
AT_LIMIT: Final = 1e-9  # of the largest tension: a tension this little beyond its limit stands at it


class Push(NamedTuple):
    """A force.

    Attributes:
        force: World axes [N], shape (3,).
        at: Where it acts, in the platform frame [m], shape (3,).
    """

    force: Array
    at: Array

    def wrench(self, state: Equilibrium, times: Array | float = 1.0) -> Array:
        """The wrench on the platform at a rest with the force some times as large, shape (..., 6)."""
        lever = state.pose.matrix @ (self.at - state.one_robot.center_of_mass)
        own = np.concatenate((self.force, np.cross(lever, self.force)))
        return np.asarray(state.wrench + np.multiply.outer(times, own))


class Reserve(NamedTuple):
    """How large a force may become.

    Attributes:
        force: In its direction, from nothing on [N]; infinite where no limit was found.
        cable: Whose limit is reached first; None where nobody knows whose.
        upper: Whether that is its upper limit.
    """

    force: float
    cable: int | None = None
    upper: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Pushed:
    """What a force does to a platform whose winches stand.

    Attributes:
        push: The force.
        state: The rest without it.
        pushed: The rest with it; None where none was found.
        held: How large it may become until a tension is at its limit, the winches at a stand.
        shared: And until no tensions within the limits hold the platform where it is; None where that is not known yet.
        compliance: Of the place at which it acts, world axes [m/N], shape (3, 3); NaN where it is not known.
    """

    push: Push
    state: Equilibrium
    pushed: Equilibrium | None
    held: Reserve
    shared: Reserve | None
    compliance: Array

    @property
    def force(self) -> float:
        """How large it is [N]."""
        return float(np.linalg.norm(self.push.force))

    @property
    def moved(self) -> Array:
        """By how much the place at which it acts moves [m], shape (3,); NaN where nobody knows."""
        if self.pushed is None:
            return np.full(3, np.nan)
        return np.asarray(self.pushed.pose.transform(self.push.at) - self.state.pose.transform(self.push.at))

    @property
    def turned(self) -> Array:
        """By how much the platform turns, as a rotation vector [rad], shape (3,); NaN where nobody knows."""
        if self.pushed is None:
            return np.full(3, np.nan)
        return np.asarray((self.pushed.pose.rotation * self.state.pose.rotation.inv()).as_rotvec())

    def drawn(self, times: float) -> Pose | None:
        """The platform as it goes, its motion some times as large."""
        if self.pushed is None:
            return None
        rest, rotation = self.state.pose, Rotation.from_rotvec(times * self.turned) * self.state.pose.rotation
        place = rest.transform(self.push.at) + times * self.moved
        return Pose(place - rotation.as_matrix() @ self.push.at, rotation)


def pushed(state: Equilibrium, push: Push, *, anew: bool = True) -> Pushed:
    """What answers a force.

    Returns:
        Pushed; within the model of the state's cables.
    """
    if isinstance(state.cables.model, Straight):
        raise InvalidValueError("push: cable model", "straight", "one that stretches", "Choose another cable model.")
    found = forward(state.one_robot, state.unstrained_length, state.pose, state.cables.model, push.wrench(state))
    lever = push.at - state.one_robot.center_of_mass
    arm = np.hstack((np.eye(3), -_crossing(state.pose.matrix @ lever)))
    return Pushed(
        push,
        state,
        found.state if bool(found.solved) else None,
        _held(state, push),
        _shared(state, push) if anew else None,
        locked(arm @ stiffness(state).compliance @ arm.T),
    )


def radii(compliance: Array) -> tuple[Array, Array]:
    """How far a place goes for 1 N in the directions in which it gives way least to most.

    Returns:
        Radii [m/N], ascending, (3,), and the directions in which it goes, one a column, (3, 3); NaN if not known.
    """
    if not np.isfinite(compliance).all():
        return np.full(3, np.nan), np.eye(3)
    axes, values, _ = np.linalg.svd(compliance)
    return values[::-1], axes[:, ::-1]


def _held(state: Equilibrium, push: Push) -> Reserve:
    """Until a tension is at a limit, the lengths held."""
    robot, unit = state.one_robot, Push(push.force / np.linalg.norm(push.force), push.at)
    lengths = np.tile(state.unstrained_length, (FORCES, 1))
    edge = AT_LIMIT * float(np.nanmax(state.limited_tension))

    def margins(forces: Array) -> tuple[Array, Flags, Flags]:
        found = forward(robot, lengths, state.pose, state.cables.model, unit.wrench(state, forces))
        tension = found.state.limited_tension
        above = robot.tension_max - tension < tension - robot.tension_min
        margin = np.where(above, robot.tension_max - tension, tension - robot.tension_min)
        return margin, above, found.solved

    def lost(forces: Array) -> Flags:
        margin, _, solved = margins(forces)
        return np.asarray(~solved | (margin.min(axis=1) < -edge))

    low, high = _bracket(lost, _largest(state))
    if not np.isfinite(high):
        return Reserve(np.inf)
    margin, above, solved = margins(np.full(FORCES, high))
    if not solved[0]:
        return Reserve(low)
    cable = int(np.argmin(margin[0]))
    return Reserve(low, cable, bool(above[0, cable]))


def _shared(state: Equilibrium, push: Push) -> Reserve:
    """Until no tensions within the limits hold the platform where it is."""
    robot, unit = state.one_robot, Push(push.force / np.linalg.norm(push.force), push.at)
    there = Pose.from_quaternion(np.tile(state.pose.position, (FORCES, 1)), np.tile(state.pose.quaternion, (FORCES, 1)))

    def lost(forces: Array) -> Flags:
        plan = inverse(robot, there, state.cables.model, wrench=unit.wrench(state, forces))
        return np.asarray(~plan.feasible)

    return Reserve(_bracket(lost, _largest(state))[0])


def _bracket(lost: Callable[[Array], Flags], largest: float) -> tuple[float, float]:
    """The largest of the forces before the first that is lost [N], and that one; infinite where none is lost."""
    low, forces = 0.0, np.geomspace(SMALLEST * largest, largest, FORCES)
    high = np.inf
    for _ in range(ROUNDS):
        gone = lost(forces)
        if not gone.any():
            return (low, high) if np.isfinite(high) else (np.inf, np.inf)
        first = int(np.argmax(gone))
        low, high = float(forces[first - 1]) if first else low, float(forces[first])
        forces = np.linspace(low, high, FORCES + 1)[1:]
    return low, high


def _largest(state: Equilibrium) -> float:
    """A force that no cables of the robot hold [N]."""
    robot = state.one_robot
    weight = robot.mass * robot.gravity
    if np.isfinite(robot.tension_max).all():
        return weight + float(robot.tension_max.sum())
    return BEYOND * (weight + float(np.nansum(state.limited_tension)))


def _crossing(lever: Array) -> Array:
    """Matrix of the cross product with a vector."""
    x, y, z = lever
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

"""Events during a simulation, and its result."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arguments import brief
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.fields import NumberFields, rule
from sagline.core.results import Result, Saved
from sagline.dynamics.simulation.winches import Winches
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

WHICH: Final = rule(most=9_999)  # cable or winch; no robot has more
TIME, MASS = rule("s"), rule("kg", above=0.0)


@dataclass(frozen=True, slots=True)
class Break(NumberFields):
    """A cable breaks: from then on it is not there. Its energy goes with it, as `energy.removed`.

    Attributes:
        cable: Number of the cable, from 0.
        time: When [s].
    """

    cable: int = field(metadata=WHICH)
    time: float = field(metadata=TIME)


@dataclass(frozen=True, slots=True)
class Stall(NumberFields):
    """A winch stops at once, and stands from then on while the others go on.

    Attributes:
        winch: Number of the winch, from 0.
        time: When [s].
    """

    winch: int = field(metadata=WHICH)
    time: float = field(metadata=TIME)


@dataclass(frozen=True, slots=True)
class Brake(NumberFields):
    """The rates that a winch is asked for, or those of all winches together, fall evenly to zero and stay there.

    With one duration for all the platform keeps to the direction of its path.

    Attributes:
        time: When [s].
        winch: Number of the winch, from 0; None for all.
        duration: Duration [s], > 0.
    """

    time: float = field(metadata=TIME)
    winch: int | None = field(default=None, metadata=WHICH)
    duration: float = field(default=0.2, metadata=rule("s", above=0.0))


@dataclass(frozen=True, slots=True)
class Drop(NumberFields):
    """A part of the platform's mass falls off; the inertia shrinks with it, the center of mass stays where it is.

    Attributes:
        mass: Mass [kg], > 0, less than the platform's.
        time: When [s].
    """

    mass: float = field(metadata=MASS)
    time: float = field(metadata=TIME)


@dataclass(frozen=True, slots=True)
class PickUp(NumberFields):
    """A mass at rest is fixed to the platform: its momentum is then the momentum of both.

    The inertia grows with the mass, the center of mass stays where it is.

    Attributes:
        mass: Mass [kg], > 0.
        time: When [s].
    """

    mass: float = field(metadata=MASS)
    time: float = field(metadata=TIME)


Event: TypeAlias = Break | Stall | Brake | Drop | PickUp
KINDS = {Break: "break", Stall: "stall", Brake: "brake", Drop: "drop", PickUp: "pick up"}


def event_cable(event: Event) -> int | None:
    """Index of the cable or winch of an event; None for the platform's, and for that of all winches."""
    return event.cable if isinstance(event, Break) else getattr(event, "winch", None)


def checked_events(events: Any, robot: Robot, begin: float, end: float) -> tuple[Event, ...]:
    """Checked events in order of time, between begin and end [s]."""
    given = (events,) if isinstance(events, Event) else events
    if not isinstance(given, Iterable) or isinstance(given, str):
        step = "Give sl.Break(cable=3, time=2.5), or several in a list."
        raise InvalidValueError("events", brief(events), "events, or none", step)
    found: list[Event] = []
    listed: list[Any] = list(given)
    for k, event in enumerate(listed):
        if not isinstance(event, Event):
            names = ", ".join(kind.__name__ for kind in KINDS)
            step = "Give sl.Break(cable=3, time=2.5) for instance."
            raise InvalidValueError(f"events[{k}]", brief(event), f"one of {names}", step)
        cable = event_cable(event)
        if cable is not None and cable >= robot.cable_count:
            name = "cable" if isinstance(event, Break) else "winch"
            allowed = f"0 to {robot.cable_count - 1}, as {robot.name} has"
            raise InvalidValueError(f"events[{k}]: {name}", cable, allowed, "They count from 0.")
        if not begin <= event.time <= end:
            step = "Correct it, or give a longer duration."
            raise InvalidValueError(f"events[{k}]: time", f"{event.time:g} s", f"{begin:g} to {end:g} s", step)
        found.append(event)
    found.sort(key=lambda event: event.time)
    _check_order(found, robot)
    return tuple(found)


def _check_order(events: list[Event], robot: Robot) -> None:
    """Refuse events of broken cables, and drops of more than the platform's mass."""
    broken: set[int] = set()
    mass = robot.mass
    for event in events:
        cable = event_cable(event)
        if cable in broken:
            step = "Remove the later events of this cable."
            raise InvalidValueError(f"events: cable {cable}", f"broken before {event.time:g} s", "there", step)
        if isinstance(event, Break):
            broken.add(event.cable)
        if isinstance(event, Drop):
            if event.mass >= mass:
                allowed = f"< {mass:g} kg, the mass at {event.time:g} s"
                raise InvalidValueError("events: Drop: mass", f"{event.mass:g} kg", allowed, "Drop less.")
            mass -= event.mass
        if isinstance(event, PickUp):
            mass += event.mass
    if len(broken) == robot.cable_count:
        step = "Keep one: a platform without cables only falls."
        raise InvalidValueError("events", "a break of every cable", "at least one left", step)


@dataclass(frozen=True, slots=True, eq=False)
class EnergyBalance(Result):
    """Energy balance of a simulation [J]; each of shape (N,).

    Attributes:
        kinetic: Of platform, cables and drums.
        potential: Of weight and of strain and height of the cables off the drums, frame ends and the origin at zero.
        supplied: Work done on the robot since the start: by winches, given forces and wind.
        lost: Work done by damping and friction since the start, strain that slipped on drums, and what chains lost
            where nodes were born and merged.
        removed: Energy that left the robot with cables that broke and loads that were dropped since the start, less
            what loads brought that were picked up. Heights count in it as in `potential`, so it has either sign.
        error: kinetic + potential - supplied + lost + removed, less its value at the start: what the integrator
            invents.
    """

    kinetic: Array
    potential: Array
    supplied: Array
    lost: Array
    removed: Array
    error: Array


@dataclass(frozen=True, slots=True, eq=False)
class Occurrence:
    """Something that happened to the robot while it moved.

    Attributes:
        time: When [s].
        kind: "break", "stall", "brake", "drop" or "pick up", as asked for; "saturate" or "slack" by itself.
        cable: Number of the cable or winch, or None for the platform.
        tension_before: Largest tension of that cable, or of all, before it [N].
        tension_after: Largest tension of any cable after it, to the end or the next [N].
    """

    time: float
    kind: str
    cable: int | None
    tension_before: float
    tension_after: float


@dataclass(frozen=True, slots=True, eq=False)
class Simulation(Result, Saved):
    """Result of `simulate`: N samples of a motion.

    Attributes:
        robot: The robot.
        time: [s], increasing, shape (N,): every so many steps, and the end.
        pose: Poses of the platform, a batch of N.
        twist: Velocity of the platform's origin and angular velocity, world axes [m/s, rad/s], shape (N, 6).
        tensions: At the frame ends [N], shape (N, m).
        length: Unstrained lengths off the drum [m], shape (N, m); NaN of a cable that has broken.
        energy: Energies over time.
        events: Events in order.
        cable_mass: "none", "lumped" or "modal".
        step: Of the integrator [s].
        nodes: Position of every cable at its nodes, world axes [m], shape (N, m, P, 3); None without cable mass, NaN of
            a cable that has broken.
        integrator: "runge-kutta" or "splitting"; "exact" of modes.
        winches: "ideal", "robot" or SecondOrder(...).
        winding: "constant" or "remembered".
        damping: Energy losses of the cables.
        largest_tension: Of each cable at the frame end at any step, also between samples [N], shape (m,); None where it
            is not known.
    """

    robot: Robot
    time: Array
    pose: Pose
    twist: Array
    tensions: Array
    length: Array
    energy: EnergyBalance
    events: tuple[Occurrence, ...]
    cable_mass: str
    step: float
    nodes: Array | None = None
    integrator: str = "runge-kutta"
    winches: Winches = "ideal"
    winding: str = "constant"
    damping: Damping = field(default_factory=Damping)
    largest_tension: Array | None = None


def energy_balance(kinetic: Array, potential: Array, supplied: Array, lost: Array, removed: Array) -> EnergyBalance:
    """The balance of five energies [J], each of shape (N,)."""
    total = kinetic + potential - supplied + lost + removed
    return EnergyBalance(*map(locked, (kinetic, potential, supplied, lost, removed, total - total[0])))


def displaced_pose(pose: Pose, robot: Robot, motion: Array) -> Pose:
    """Pose after a motion (..., 6) [m, rad]: the center of mass displaced, the platform turned about it."""
    center = pose.matrix @ robot.center_of_mass
    turned = Rotation.from_rotvec(motion[..., 3:])
    place = pose.position + center + motion[..., :3] - turned.as_matrix() @ center
    return Pose.from_quaternion(place, (turned * pose.rotation).as_quat())


def twist_of_origin(robot: Robot, pose: Pose, velocity: Array, spin: Array) -> Array:
    """Twists of the platform frame's origin, as a path has them, from motions of the center of mass."""
    # shapes: velocity (N, 3) [m/s]; spin (N, 3) [rad/s]; returns (N, 6)
    lever = pose.matrix @ robot.center_of_mass
    return locked(np.concatenate((velocity - np.cross(spin, lever), spin), axis=1))

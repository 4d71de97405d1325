"""Result of a simulation, and events during a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arguments import brief, elements
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.fields import NumberFields, rule
from sagline.core.results import Columns, Result, Saved, Tabular
from sagline.dynamics.simulation.winches import Winches
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.motion.anchors import AnchorMotion
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

WHICH: Final = rule(most=9_999)  # upper limit of the index of a cable or winch
TIME, MASS = rule("s"), rule("kg", above=0.0)


@dataclass(frozen=True, slots=True)
class Break(NumberFields):
    """Break of a cable.

    A cable without mass is removed. Its energy is added to `energy.removed`. The pieces of a cable with mass fall: the
    piece at the platform stays attached to the platform, and the piece at the frame is suspended from its locked
    winch.

    Attributes:
        cable: Index of the cable, from 0.
        time: Time of the event [s].
        position: Place of the break, relative to the free length: 0 at the frame end, 1 at the platform end. A cable
            with mass breaks at an end or at the nearest node at least two elements from all ends.
    """

    cable: int = field(metadata=WHICH)
    time: float = field(metadata=TIME)
    position: float = field(default=1.0, metadata=rule(low=0.0))


@dataclass(frozen=True, slots=True)
class Stall(NumberFields):
    """Sudden stop of a winch. The other winches continue.

    Attributes:
        winch: Index of the winch, from 0.
        time: Time of the event [s].
    """

    winch: int = field(metadata=WHICH)
    time: float = field(metadata=TIME)


@dataclass(frozen=True, slots=True)
class Brake(NumberFields):
    """Brake of one winch or of all winches: the length rates decrease linearly to zero and remain zero.

    If all winches brake together, the platform keeps the direction of its path.

    Attributes:
        time: Time of the event [s].
        winch: Index of the winch, from 0; None for all.
        duration: Duration [s], > 0.
    """

    time: float = field(metadata=TIME)
    winch: int | None = field(default=None, metadata=WHICH)
    duration: float = field(default=0.2, metadata=rule("s", above=0.0))


@dataclass(frozen=True, slots=True)
class Drop(NumberFields):
    """Loss of a part of the platform's mass. The inertia decreases in proportion; the center of mass is unchanged.

    Attributes:
        mass: Mass [kg], > 0, less than the mass of the platform.
        time: Time of the event [s].
    """

    mass: float = field(metadata=MASS)
    time: float = field(metadata=TIME)


@dataclass(frozen=True, slots=True)
class PickUp(NumberFields):
    """Pick-up of a mass at rest. The total momentum of platform and mass is conserved.

    The inertia increases in proportion to the mass; the center of mass is unchanged.

    Attributes:
        mass: Mass [kg], > 0.
        time: Time of the event [s].
    """

    mass: float = field(metadata=MASS)
    time: float = field(metadata=TIME)


Event: TypeAlias = Break | Stall | Brake | Drop | PickUp
KINDS = {Break: "break", Stall: "stall", Brake: "brake", Drop: "drop", PickUp: "pick up"}


def event_cable(event: Event) -> int | None:
    """Index of the cable or winch to which `event` applies. None for the platform or all winches."""
    return event.cable if isinstance(event, Break) else getattr(event, "winch", None)


def checked_events(events: Any, robot: Robot, begin: float, end: float, *, pieces: bool) -> tuple[Event, ...]:
    """Check that `events` are between `begin` and `end` [s], and sort them by time; `pieces` can break again."""
    found: list[Event] = []
    for k, event in enumerate(elements(events, Event, "events", "Give sl.Break(cable=3, time=2.5), or several.")):
        if not isinstance(event, Event):
            names = ", ".join(kind.__name__ for kind in KINDS)
            step = "Give for instance sl.Break(cable=3, time=2.5)."
            raise InvalidValueError(f"events[{k}]", brief(event), f"one of {names}", step)
        cable = event_cable(event)
        if cable is not None and cable >= robot.cable_count:
            name = "cable" if isinstance(event, Break) else "winch"
            allowed = f"0 to {robot.cable_count - 1}, as {robot.name} has"
            raise InvalidValueError(f"events[{k}]: {name}", cable, allowed, "Indices start at 0.")
        if isinstance(event, Break) and event.position > 1.0:
            step = "Give 0 for the frame end, or 1 for the platform end."
            raise InvalidValueError(f"events[{k}]: position", f"{event.position:g}", "0 to 1", step)
        if not begin <= event.time <= end:
            step = "Correct it, or give a longer duration."
            raise InvalidValueError(f"events[{k}]: time", f"{event.time:g} s", f"{begin:g} to {end:g} s", step)
        found.append(event)
    found.sort(key=lambda event: event.time)
    _check_order(found, robot, pieces=pieces)
    return tuple(found)


def _check_order(events: list[Event], robot: Robot, *, pieces: bool) -> None:
    """Reject events of broken cables, and drops of more than the platform's mass."""
    broken: set[int] = set()
    mass = robot.mass
    for event in events:
        cable = event_cable(event)
        if cable in broken and not (pieces and isinstance(event, Break)):
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
        step = "Keep at least one cable: a platform without cables only falls."
        raise InvalidValueError("events", "a break of every cable", "at least one unbroken cable", step)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EnergyBalance(Result):
    """Energy balance of a simulation [J]; each of shape (N,).

    Attributes:
        kinetic: Kinetic energy of platform, cables and drums.
        potential: Potential energy of the platform's weight, and of strain and height of the cables off the drums. The
            height of the platform counts from the origin, the heights of the cables from their frame ends, or from
            their drums on the platform.
        supplied: Work done on the robot since the start by winches, external forces, wind and moving anchors. Anchors
            that rise also lift the weight of their cables; this work is not included, because heights of cables count
            from their frame ends.
        lost: Energy lost since the start, due to damping and friction, and due to averaging of strains on drums and
            creation and merging of chain nodes.
        removed: Energy of broken cables without mass and of dropped loads since the start, minus the energy of
            picked-up loads. Heights count as in `potential`, so that the value can have either sign. For a cable with
            mass that breaks at the frame: strain energy of the cable between exit point and drum.
        error: Energy error of the integrator: change of the sum kinetic + potential - supplied + lost + removed.
    """

    kinetic: Array
    potential: Array
    supplied: Array
    lost: Array
    removed: Array
    error: Array

    @classmethod
    def _of(cls, kinetic: Array, potential: Array, supplied: Array, lost: Array, removed: Array) -> EnergyBalance:
        """Compute the energy balance from five energies [J], each of shape (N,)."""
        total = kinetic + potential - supplied + lost + removed
        return cls(*map(locked, (kinetic, potential, supplied, lost, removed, total - total[0])))


@dataclass(frozen=True, slots=True, eq=False)
class Occurrence:
    """Event during the motion of the robot.

    Attributes:
        time: Time of the event [s].
        kind: "break", "stall", "brake", "drop" or "pick up" for scheduled events; "saturate" or "slack" for other
            events.
        cable: Index of the cable or winch, or None for the platform.
        tension_before: Largest tension before the event [N]: of the named cable, or of any cable if none is named.
        tension_after: Largest tension of any cable after the event, until the next event or the end [N].
        limit: Limits of the drive that are active at a "saturate" event: "torque", "speed" or "torque and speed". None
            for other events.
    """

    time: float
    kind: str
    cable: int | None
    tension_before: float
    tension_after: float
    limit: str | None = None

    @property
    def text(self) -> str:
        """Kind of the event, with the active limits and the cable."""
        what = self.kind if self.limit is None else f"{self.kind} ({self.limit})"
        return what if self.cable is None else f"{what} of cable {self.cable}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Simulation(Result, Saved, Tabular):
    """Result of `simulate`: N samples of a motion.

    Attributes:
        robot: The robot.
        time: Times of the samples [s], increasing, shape (N,): at constant intervals, and at the end.
        pose: Poses of the platform, a batch of N.
        twist: Velocity of the platform's origin and angular velocity, world axes [m/s, rad/s], shape (N, 6).
        tensions: Tensions at the frame ends [N], shape (N, m). For a broken cable: the tension of its piece at the
            frame, 0 without such a piece or without cable mass.
        length: Unstrained lengths off the drum [m], shape (N, m); NaN for a broken cable.
        energy: Energies over time.
        events: Events in order.
        cable_mass: "none", "lumped" or "modal".
        step: Time step of the integrator [s].
        nodes: Positions of the nodes of every cable from the frame end to the platform end, world axes [m], shape (N,
            m, P, 3); None without cable mass. NaN between the pieces of a broken cable.
        integrator: "runge-kutta" or "splitting"; "exact" for cable_mass="modal".
        winches: "ideal", "robot" or SecondOrder(...).
        winding: "constant" or "remembered".
        damping: Energy losses of the cables.
        largest_tension: Largest frame-end tension of each cable at any step, including steps between samples [N], shape
            (m,); None if unknown.
        anchors: Motion of the frame anchors; None for fixed anchors. The robot is then that at the first sample.
    """

    _columns: ClassVar[Columns] = ("time", "pose", "T#=tensions", "L#=length")

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
    anchors: AnchorMotion | None = None


def displaced_pose(pose: Pose, robot: Robot, motion: Array) -> Pose:
    """Pose after `motion` (..., 6): displacement of the center of mass [m], and rotation about this point [rad]."""
    center = pose.matrix @ robot.center_of_mass
    turned = Rotation.from_rotvec(motion[..., 3:])
    place = pose.position + center + motion[..., :3] - turned.as_matrix() @ center
    return Pose.from_quaternion(place, (turned * pose.rotation).as_quat())


def twist_of_origin(robot: Robot, pose: Pose, velocity: Array, spin: Array) -> Array:
    """Convert motions of the center of mass to twists of the platform frame's origin, as in `Path`."""
    # shapes: velocity (N, 3) [m/s]; spin (N, 3) [rad/s]; returns (N, 6)
    lever = pose.matrix @ robot.center_of_mass
    return locked(np.concatenate((velocity - np.cross(spin, lever), spin), axis=1))

"""Equilibrium of a robot: pose of its platform, state of its cables, and contact with pulleys."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from importlib import import_module
from typing import Any, ClassVar, Concatenate, Final, ParamSpec, Protocol, TypeVar, overload

import numpy as np

from sagline.cables.model import CableModel, CableState
from sagline.core.arguments import instance
from sagline.core.arrays import Array, Codes, locked
from sagline.core.errors import InvalidValueError
from sagline.core.indices import batch_length, part_of
from sagline.core.results import Result
from sagline.core.table import Columns, Tabular
from sagline.kernels import tables
from sagline.robot.batch import (
    Index,
    Robots,
    cables_of,
    first_of,
    has_routing,
    points_on_pulleys,
    robot_fields,
    robots_at,
)
from sagline.robot.pose import Pose, PoseLike
from sagline.robot.robot import Robot

_P = ParamSpec("_P")
_R_co = TypeVar("_R_co", covariant=True)
# imported by name when it is needed, because inverse kinematics imports this module
_INVERSE: Final = "sagline.kinematics.inverse"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Contact(Result):
    """Cables on pulleys, and their dead lengths; fields of shape (m,) or (N, m).

    Attributes:
        wrap_angle: Psi, the angle over which a cable lies on its pulley [rad].
        wrapped_length: Unstrained length on the pulley [m].
        dead_length: Unstrained length between pulley and drum [m].
        chord_tension: T_x/cos phi along the tangent from the platform end to the pulley [N]. Tension distribution and
            limits apply to this tension. The chord of the free span is another line, which starts at the actual exit
            point.
        chord_sine: sin phi of this tangent.
        winding: Direction of each drum, which determines the friction: +1 winding in, -1 paying out, 0 at rest. None:
            no friction.
    """

    wrap_angle: Array
    wrapped_length: Array
    dead_length: Array
    chord_tension: Array
    chord_sine: Array
    winding: Array | None = None

    def part(self, index: Index) -> Contact:
        """Contact at the poses of the index."""
        known = {name: field for name in self.__slots__ if (field := getattr(self, name)) is not None}
        return Contact(**{name: locked(field[index, ...]) for name, field in known.items()})


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Equilibrium(Result, Tabular):
    """Equilibrium of a robot, the input of stiffness, vibration, viewer and files.

    A batch is indexed like an array: `state[3]` is a single pose, `state[2:5]` and `state[mask]` are batches. Slices
    share the memory of the batch.

    Attributes:
        robot: The robot, or a tuple of N robots, one per pose.
        pose: Pose of the platform, single or a batch of N.
        wrench: External plus inertial wrench on the platform about its center of mass, world axes, without
            gravity: force [N], moment [N m], shape (6,) or (N, 6).
        cables: State of the free spans, from their exit points to their platform ends, fields of shape (m,) or (N, m).
        contact: Wrapped and dead lengths of the cables. None if the robot has neither pulleys nor dead lengths: each
            cable then starts at its frame anchor, and its length off the drum is its free length.
    """

    _columns: ClassVar[Columns] = ("pose", "L#=unstrained_length", "T#=chord_tension")

    robot: Robot | tuple[Robot, ...]
    pose: Pose
    wrench: Array
    cables: CableState
    contact: Contact | None = None

    @property
    def unstrained_length(self) -> Array:
        """Whole unstrained length L off the drum [m], shape (m,) or (N, m): free, wrapped and dead length."""
        if self.contact is None:
            return self.cables.unstrained_length
        return locked(self.free_length + (self.contact.wrapped_length + self.contact.dead_length))

    @property
    def free_length(self) -> Array:
        """Unstrained length of the free spans [m], shape (m,) or (N, m)."""
        return self.cables.unstrained_length

    @property
    def chord_tension(self) -> Array:
        """Chord tension tau = T_x/cos phi [N], shape (m,) or (N, m); on a pulley, phi belongs to the tangent.

        Tension distribution and limits apply to this tension, unless the robot limits the frame-end tension.
        """
        return self.cables.chord_tension if self.contact is None else self.contact.chord_tension

    @property
    def pull(self) -> Array:
        """Sag force of the cables: vertical force at the platform end due to their weight, T_z - tau sin phi [N]."""
        cables = self.cables
        sine = cables.rise / cables.chord if self.contact is None else self.contact.chord_sine
        return locked(cables.vertical_force - self.chord_tension * sine)

    @property
    def exit_point(self) -> Array:
        """Exit points of the cables on pulleys, or frame anchors, world axes [m], shape (m, 3) or (N, m, 3)."""
        if self.contact is None:
            (anchors,) = robot_fields(self.robot, "frame_anchors")
            return locked(np.array(np.broadcast_to(anchors, (*self.cables.shape, 3))))
        return locked(points_on_pulleys(self.robot, self.pose, self.contact.wrap_angle))

    @property
    def one_robot(self) -> Robot:
        """The robot, if it is the same at all poses.

        Raises:
            InvalidValueError: If there is one robot per pose.
        """
        if isinstance(self.robot, Robot):
            return self.robot
        value = f"a sequence of {len(self.robot)} robots, one per pose"
        raise InvalidValueError("robot", value, "one robot for all poses", "Select a single pose: state[i].")

    def __len__(self) -> int:
        """Number of poses in a batch."""
        return batch_length(self.pose.shape, "single equilibrium")

    def __getitem__(self, index: Index) -> Equilibrium:
        """One pose of a batch, or a part of the batch.

        Args:
            index: A number (negative: from the end), a slice, or an array of numbers or of N booleans.

        Raises:
            NoBatchError: If the equilibrium has a single pose (also a TypeError).
            NoSuchEntryError: If a pose does not exist (also an IndexError).
        """
        part = part_of(index, self.pose.shape, "single equilibrium")
        contact = None if self.contact is None else self.contact.part(part)
        robot, wrench = robots_at(self.robot, part), locked(self.wrench[part])
        return Equilibrium(robot, self.pose[part], wrench, self.cables[part], contact)

    def __iter__(self) -> Iterator[Equilibrium]:
        """Iterate over the poses of a batch."""
        return (self[i] for i in range(len(self)))

    @property
    def limited_tension(self) -> Array:
        """Tension to which the limits apply [N], shape (m,) or (N, m): chord tension or frame-end tension."""
        return limited_tension(self.robot, self.cables, self.contact)


class HasState(Protocol):
    """A result with an equilibrium, such as a plan, a forward solution or a vibration."""

    @property
    def state(self) -> Equilibrium:
        """The equilibrium."""


class OfEquilibrium(Protocol[_P, _R_co]):
    """A function of an equilibrium, of a result with an equilibrium, or of a robot and a pose."""

    @overload
    def __call__(self, state: Equilibrium | HasState, *args: _P.args, **options: _P.kwargs) -> _R_co: ...
    @overload
    def __call__(self, robot: Robot, pose: PoseLike, *args: _P.args, **options: _P.kwargs) -> _R_co: ...


def equilibrium_of(start: Any, pose: PoseLike | None = None, item: str = "state") -> Equilibrium:
    """The given equilibrium, the equilibrium in a given result, or the equilibrium of a given robot at given poses."""
    if isinstance(start, Robot) and pose is not None:
        found: Equilibrium = import_module(_INVERSE).equilibrium_at(start, pose)
        return found
    state = getattr(start, "state", None)
    return state if isinstance(state, Equilibrium) else instance(start, Equilibrium, item)


def of_result(function: Callable[Concatenate[Equilibrium | HasState, _P], _R_co]) -> OfEquilibrium[_P, _R_co]:
    """Let a function of an equilibrium or of a result also accept a robot and a pose."""

    @wraps(function)
    def call(*given: Any, **options: Any) -> _R_co:
        start, *rest = given or (options.pop("state", None),)
        if isinstance(start, Robot):
            start = equilibrium_of(start, options.pop("pose") if "pose" in options else rest.pop(0) if rest else None)
        return function(start, *rest, **options)

    return call


def of_equilibrium(function: Callable[Concatenate[Equilibrium, _P], _R_co]) -> OfEquilibrium[_P, _R_co]:
    """Let a function of an equilibrium also accept a result, or a robot and a pose."""

    @wraps(function)
    def of_state(start: Equilibrium | HasState, /, *args: _P.args, **options: _P.kwargs) -> _R_co:
        return function(equilibrium_of(start), *args, **options)

    return of_result(of_state)


def limited_tension(robot: Robots, cables: CableState, contact: Contact | None = None) -> Array:
    """Tension to which the limits of the robot or robots apply [N]: chord tension or frame-end tension."""
    if first_of(robot).tension_limits_of == "frame_end":
        return cables.frame_end_tension
    return cables.chord_tension if contact is None else contact.chord_tension


def cables_of_results(
    robot: Robots, model: CableModel, results: Array, status: Codes, shape: tuple[int, ...]
) -> tuple[CableState, Contact | None]:
    """States of the free spans of solved poses, and their contact, or None if no cable has a pulley or a dead length.

    results: rows as in `sagline.kernels.tables`, (RESULT_ROWS, N, m); status: status of each cable, (N, m); shape: ()
    or (N,), of the poses.
    """
    m = results.shape[2]

    def row(which: int) -> Array:
        return locked(results[which].reshape(*shape, m))

    span, rise, length, tension = (row(k) for k in (tables.SPAN, tables.RISE, tables.LENGTH, tables.TENSION))
    contact = None
    if has_routing(robot):
        rows = (tables.WRAP, tables.WRAPPED, tables.DEAD, tables.TENSION, tables.SINE)
        contact = Contact(*(row(k) for k in rows))
        length = locked(length - (contact.wrapped_length + contact.dead_length))
        tension = locked(_free_chord_tension(span, rise, row(tables.HORIZONTAL), tension))
    cables = CableState(
        model=model,
        cable=cables_of(robot),
        gravity=first_of(robot).gravity,
        span=span,
        rise=rise,
        unstrained_length=length,
        horizontal_tension=row(tables.HORIZONTAL),
        vertical_force=row(tables.VERTICAL),
        chord_tension=tension,
        status=locked(status.reshape(*shape, m)),
    )
    return cables, contact


def _free_chord_tension(span: Array, rise: Array, horizontal: Array, tension: Array) -> Array:
    """Chord tensions of the free spans; for a vertical free span, the given chord tension is returned."""
    level = np.where(span > 0.0, span, 1.0)
    own: Array = np.where(span > 0.0, horizontal * (np.hypot(span, rise) / level), tension)
    return own

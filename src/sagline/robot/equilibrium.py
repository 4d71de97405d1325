"""Equilibrium of a robot: pose of its platform, state of its cables, and contact with pulleys."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import wraps
from importlib import import_module
from typing import Any, ClassVar, Concatenate, Final, ParamSpec, Protocol, TypeVar, overload

import numpy as np

from sagline.cables.model import CableModel, CableState
from sagline.core.arguments import batch_length, instance, part_of
from sagline.core.arrays import Array, Codes, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels import tables
from sagline.robot import batch
from sagline.robot.batch import Index, Robots
from sagline.robot.pose import Pose, PoseLike
from sagline.robot.robot import Robot

_P = ParamSpec("_P")
_R_co = TypeVar("_R_co", covariant=True)
# loaded by name on demand, because inverse kinematics imports this module
_INVERSE: Final = "sagline.kinematics.inverse"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Contact(Result):
    """Contact of the cables with pulleys, and dead lengths; fields of shape (m,) or (N, m).

    Attributes:
        wrap_angle: Psi, the angle over which a cable lies on its pulley [rad].
        wrapped_length: Unstrained length on the pulley [m].
        dead_length: Unstrained length between pulley and drum [m].
        chord_tension: T_x/cos phi [N], where phi is the elevation of the tangent from the platform end to the pulley.
            Tension distribution and limits apply to this chord tension. The chord of the free span is a different line,
            which begins at the exit point of the sagging cable.
        chord_sine: sin phi, where phi is the elevation of the same tangent.
        winding: Direction of motion of each drum, on which friction depends: +1 winding in, -1 paying out, 0 at rest.
            None: no friction.
        azimuth: Azimuth of the vertical plane of each free span [rad], if a swivel axis is not vertical; chord_tension
            and chord_sine are then those of the free span's chord. None: vertical swivel axes, which are in the planes.
    """

    wrap_angle: Array
    wrapped_length: Array
    dead_length: Array
    chord_tension: Array
    chord_sine: Array
    winding: Array | None = None
    azimuth: Array | None = None

    def part(self, index: Index) -> Contact:
        """Contact at the poses that `index` selects."""
        known = {name: field for name in self.__slots__ if (field := getattr(self, name)) is not None}
        return Contact(**{name: locked(field[index, ...]) for name, field in known.items()})


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Equilibrium(Result, Tabular):
    """Equilibrium of a robot: pose, wrench, and states of all cables.

    A batch is indexed like an array: `state[3]` is a single pose; `state[2:5]` and `state[mask]` are batches. A slice
    shares the memory of the batch.

    Attributes:
        robot: The robot, or a tuple of N robots, one per pose.
        pose: Pose of the platform, single or a batch of N.
        wrench: External plus inertial wrench on the platform about its center of mass, world axes, without
            gravity: force [N], moment [N m], shape (6,) or (N, 6).
        cables: State of the free spans between exit points and platform ends, fields of shape (m,) or (N, m).
        contact: Wrapped and dead lengths of the cables. None for a robot with neither pulleys nor dead lengths, whose
            cables start at the frame anchors.
    """

    _columns: ClassVar[Columns] = ("pose", "L#=unstrained_length", "T#=chord_tension")

    robot: Robot | tuple[Robot, ...]
    pose: Pose
    wrench: Array
    cables: CableState
    contact: Contact | None = None

    @property
    def unstrained_length(self) -> Array:
        """Unstrained length L off the drum [m], shape (m,) or (N, m): sum of free, wrapped and dead length."""
        if self.contact is None:
            return self.cables.unstrained_length
        return locked(self.free_length + (self.contact.wrapped_length + self.contact.dead_length))

    @property
    def free_length(self) -> Array:
        """Unstrained length of the free spans [m], shape (m,) or (N, m)."""
        return self.cables.unstrained_length

    @property
    def chord_tension(self) -> Array:
        """Chord tension tau = T_x/cos phi [N], shape (m,) or (N, m); phi: elevation of the chord or pulley tangent.

        Tension distribution and limits apply to the chord tension, unless the robot limits the frame-end tension.
        """
        return self.cables.chord_tension if self.contact is None else self.contact.chord_tension

    @property
    def pull(self) -> Array:
        """Sag force T_z - tau sin phi of each cable: vertical force at the platform end due to the weight [N]."""
        cables = self.cables
        sine = cables.rise / cables.chord if self.contact is None else self.contact.chord_sine
        return locked(cables.vertical_force - self.chord_tension * sine)

    @property
    def exit_point(self) -> Array:
        """Exit points in world axes [m], shape (m, 3) or (N, m, 3); frame anchors for cables without pulleys."""
        if self.contact is None:
            (anchors,) = batch.robot_fields(self.robot, "frame_anchors")
            return locked(np.array(np.broadcast_to(anchors, (*self.cables.shape, 3))))
        if self.contact.azimuth is not None:
            frame, ends = batch.robot_fields(self.robot, "frame_anchors", "platform_anchors")
            ends = self.pose.position[..., None, :] + ends @ np.swapaxes(self.pose.matrix, -1, -2)
            span, azimuth = self.cables.span, self.contact.azimuth
            chord = np.stack((span * np.cos(azimuth), span * np.sin(azimuth), self.cables.rise), axis=-1)
            return locked(np.where(batch.on_platform(self.robot)[..., None], frame + chord, ends - chord))
        return locked(batch.points_on_pulleys(self.robot, self.pose, self.contact.wrap_angle))

    @property
    def one_robot(self) -> Robot:
        """The robot of all poses.

        Raises:
            InvalidValueError: If the equilibrium has one robot per pose.
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
            index: A number (negative numbers count from the end), a slice, or an array of numbers or of N booleans.

        Raises:
            NoBatchError: If the equilibrium has a single pose; the error is also a TypeError.
            NoSuchEntryError: If a pose does not exist; the error is also an IndexError.
        """
        part = part_of(index, self.pose.shape, "single equilibrium")
        contact = None if self.contact is None else self.contact.part(part)
        robot, wrench = batch.robots_at(self.robot, part), locked(self.wrench[part])
        return Equilibrium(robot, self.pose[part], wrench, self.cables[part], contact)

    def __iter__(self) -> Iterator[Equilibrium]:
        """Iterate over the poses of a batch."""
        return (self[i] for i in range(len(self)))

    @property
    def limited_tension(self) -> Array:
        """Tension to which the limits apply [N], shape (m,) or (N, m): chord tension or frame-end tension."""
        return limited_tension(self.robot, self.cables, self.contact)


class HasState(Protocol):
    """Any result that contains an equilibrium, such as a plan, a forward solution or a vibration."""

    @property
    def state(self) -> Equilibrium:
        """Equilibrium that the result contains."""


class _OfEquilibrium(Protocol[_P, _R_co]):
    """Function that accepts an equilibrium, a result that contains one, or a robot with a pose."""

    @overload
    def __call__(self, state: Equilibrium | HasState, *args: _P.args, **options: _P.kwargs) -> _R_co: ...
    @overload
    def __call__(self, robot: Robot, pose: PoseLike, *args: _P.args, **options: _P.kwargs) -> _R_co: ...


def equilibrium_of(start: Any, pose: PoseLike | None = None, item: str = "state") -> Equilibrium:
    """Equilibrium that `start` is or contains, or the equilibrium of the robot `start` at `pose`."""
    if isinstance(start, Robot) and pose is not None:
        found: Equilibrium = import_module(_INVERSE).equilibrium_at(start, pose)
        return found
    state = getattr(start, "state", None)
    return state if isinstance(state, Equilibrium) else instance(start, Equilibrium, item)


def of_result(function: Callable[Concatenate[Equilibrium | HasState, _P], _R_co]) -> _OfEquilibrium[_P, _R_co]:
    """Decorator: the function accepts a robot and a pose in place of an equilibrium or result."""

    @wraps(function)
    def call(*given: Any, **options: Any) -> _R_co:
        start, *rest = given or (options.pop("state", None),)
        if isinstance(start, Robot):
            start = equilibrium_of(start, options.pop("pose") if "pose" in options else rest.pop(0) if rest else None)
        return function(start, *rest, **options)

    return call


def of_equilibrium(function: Callable[Concatenate[Equilibrium, _P], _R_co]) -> _OfEquilibrium[_P, _R_co]:
    """Decorator: the function accepts a result, or a robot and a pose, in place of an equilibrium."""

    @wraps(function)
    def of_state(start: Equilibrium | HasState, /, *args: _P.args, **options: _P.kwargs) -> _R_co:
        return function(equilibrium_of(start), *args, **options)

    return of_result(of_state)


def limited_tension(robot: Robots, cables: CableState, contact: Contact | None = None) -> Array:
    """Tension to which tension limits apply [N]: chord tension or frame-end tension, depending on the robot."""
    if batch.first_of(robot).tension_limits_of == "frame_end":
        return cables.frame_end_tension
    return cables.chord_tension if contact is None else contact.chord_tension


def result_rows(robot: Robots) -> int:
    """Number of rows of kernel results for a robot or robots."""
    if batch.has_slanted_axes(robot):
        return tables.SWIVEL_ROWS
    return tables.RESULT_ROWS if batch.has_routing(robot) else tables.BARE_ROWS


def cables_of_results(
    robot: Robots, model: CableModel, results: Array, status: Codes, shape: tuple[int, ...]
) -> tuple[CableState, Contact | None]:
    """States of the free spans at solved poses; contact with pulleys, or None without pulleys and dead lengths."""
    # results: rows of `sagline.kernels.tables`, (RESULT_ROWS, N, m); status: status of each cable, (N, m); shape: shape
    # of the poses, () or (N,).
    m = results.shape[2]

    def row(which: int) -> Array:
        return locked(results[which].reshape(*shape, m))

    span, rise, length, tension = (row(k) for k in (tables.SPAN, tables.RISE, tables.LENGTH, tables.TENSION))
    contact = None
    if batch.has_routing(robot):
        rows = (tables.WRAP, tables.WRAPPED, tables.DEAD, tables.TENSION, tables.SINE)
        contact = Contact(*(row(k) for k in rows))
        if len(results) > tables.RESULT_ROWS:
            contact = replace(contact, azimuth=row(tables.AZIMUTH))
        length = locked(length - (contact.wrapped_length + contact.dead_length))
        # the horizontal tension of a vertical span is zero
        slope = np.hypot(span, rise) / np.where(span > 0.0, span, 1.0)
        tension = locked(np.where(span > 0.0, row(tables.HORIZONTAL) * slope, tension))
    cables = CableState(
        model=model,
        cable=batch.cables_of(robot),
        gravity=batch.first_of(robot).gravity,
        span=span,
        rise=rise,
        unstrained_length=length,
        horizontal_tension=row(tables.HORIZONTAL),
        vertical_force=row(tables.VERTICAL),
        chord_tension=tension,
        status=locked(status.reshape(*shape, m)),
    )
    return cables, contact

"""Events, and records of cycles for executions and recorders."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from math import nan
from typing import Any, Final, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from sagline.control.link import Command, Missing, Sample
from sagline.control.states import State
from sagline.core.arguments import brief
from sagline.core.arrays import Array, Indices
from sagline.core.errors import InvalidValueError
from sagline.core.status import Status
from sagline.kinematics.plan import Plan


class EventKind(StrEnum):
    """Kind of an event."""

    STATE = "state"  # change of state
    FAULT = "fault"
    NOTE = "note"  # note for the operator; no effect on the controller


class Event(NamedTuple):
    """Change of state, fault or note.

    Attributes:
        time: Time on the link's clock [s].
        cycle: Index of the controller's cycle, from 0.
        kind: State, fault or note.
        name: Name of the new state, or of the fault.
        state: State of the controller after the event.
        text: One line for the operator.
    """

    time: float
    cycle: int
    kind: EventKind
    name: str
    state: State
    text: str


# names in the record of a cycle with m winches and G groups: first real numbers, then whole numbers
REAL_OWN: Final = ("time", "late", "clock")
PLACE: Final = (("position", 3), ("quaternion", 4))
REAL_OF_GROUPS: Final = ("age", "plc_time")
REAL_OF_WINCHES: Final = ("length", "rate", "torque", "tension", "filtered")
ASKED: Final = ("set_length", "set_rate", "set_tension", "planned_tension", "correction")
WHOLE_OWN: Final = ("answered", "state", "estimate", "mode")
WHOLE_OF_GROUPS: Final = ("counter", "owner", "echo", "status", "fault", "discarded")
WHOLE_OF_WINCHES: Final = ("counts", "state", "winch_fault")


class Recorded(NamedTuple):
    """Record of one cycle. The arrays are not modified later.

    Attributes:
        number: Index of the cycle, from 0.
        state: State of the controller at the end of the cycle.
        degraded: True if a load cell is ignored. The tension loop then keeps its correction.
        late: Delay of the start of the cycle [s]; 0 on a lockstep clock.
        clock: Time since the start of the plan [s]; NaN without a plan.
        command: Command sent in the cycle; None if nothing was sent.
        answer: Answer of the link.
        position: Position of the platform's origin, from the encoders [m], shape (3,); NaN before homing.
        quaternion: Rotation platform -> world from the encoders, scalar last, shape (4,).
        estimate: Code of the `ForwardStatus`; -1 without an estimate.
        zero: Offset from homing, added to lengths of samples and subtracted from set points [m], shape (m,).
        planned_tension: Planned T_A at the time of the answer [N], shape (m,); NaN without a plan.
        correction: Correction by the tension loop, included in the set points that were sent [m], shape (m,).
    """

    number: int
    state: State
    degraded: bool
    late: float
    clock: float
    command: Command | None
    answer: Sample | Missing
    position: Array
    quaternion: Array
    estimate: int
    zero: Array
    planned_tension: Array
    correction: Array


@runtime_checkable
class Recorder(Protocol):
    """Receiver of cycles and events, for example a log. Its methods must return at once: the control loop waits."""

    @property
    def stopped(self) -> str:
        """Reason why the recorder has stopped, "" while it runs; the fault rules check it."""

    def begins(self, plan: Plan) -> None:
        """Receive a plan before its first cycle.

        Args:
            plan: The plan that is executed next.
        """

    def ends(self, status: Status, reason: str) -> None:
        """Receive the result of the plan after its last cycle.

        Args:
            status: `ExecutionStatus` of the plan.
            reason: Reason in words; empty if the plan was completed.
        """

    def cycle(self, cycle: Recorded) -> None:
        """Receive a cycle.

        Args:
            cycle: Readings, set points and states of one cycle.
        """

    def event(self, event: Event) -> None:
        """Receive an event.

        Args:
            event: Change of state, fault or note.
        """


class CycleTable:
    """Table of cycles in preallocated memory."""

    def __init__(self, cable_count: int, group_count: int, expected: int) -> None:
        """Allocate memory."""
        m, g = cable_count, group_count
        own = dict.fromkeys(REAL_OWN, 1)
        groups = {f"group_{name}": g for name in REAL_OF_GROUPS}
        winches = {f"winch_{name}": m for name in REAL_OF_WINCHES}
        self._real = _columns(own | dict(PLACE) | groups | winches | dict.fromkeys(ASKED, m))
        groups = {f"group_{name}": g for name in WHOLE_OF_GROUPS}
        winches = {f"winch_{name}": m for name in WHOLE_OF_WINCHES}
        self._whole = _columns(dict.fromkeys(WHOLE_OWN, 1) | groups | winches)
        rows, (real, whole) = max(expected, 1), (_width(columns) for columns in (self._real, self._whole))
        self._numbers, self._codes = np.empty((rows, real)), np.empty((rows, whole), dtype=np.int64)
        self._count = 0
        self._no_sample = np.full(len(REAL_OF_GROUPS) * g + len(REAL_OF_WINCHES) * m, nan)
        self._no_codes = np.zeros(whole - len(WHOLE_OWN), dtype=np.int64)
        self._no_command = np.full(3 * m, nan)

    def __len__(self) -> int:
        """Number of cycles so far."""
        return self._count

    def add(self, cycle: Recorded) -> None:
        """Add a cycle."""
        k = self._count
        if k == len(self._numbers):
            self._numbers, self._codes = (np.concatenate((old, np.empty_like(old))) for old in self._tables)
        answer, command = cycle.answer, cycle.command
        read: tuple[Array, ...] = (self._no_sample,)
        codes: tuple[Indices, ...] = (self._no_codes,)
        asked: tuple[Array, ...] = (self._no_command,)
        mode = -1
        if isinstance(answer, Sample):
            _, age, counter, plc_time, owner, echo, status, fault, *winches, counts, state, drive, discarded, _ = answer
            read = (age, plc_time, *winches)
            codes = (counter, owner, echo, status, fault, discarded, counts, state, drive)
        if command is not None:
            mode, asked = command.mode, (command.length + cycle.zero, command.rate, command.tension)
        own = (answer.time, cycle.late, cycle.clock)
        sight = (cycle.position, cycle.quaternion)
        np.concatenate((own, *sight, *read, *asked, cycle.planned_tension, cycle.correction), out=self._numbers[k])
        # plain integers, because numpy converts members of an enumeration ten times slower
        about = (int(answer.__class__ is Sample), int(cycle.state), cycle.estimate, int(mode))
        np.concatenate((about, *codes), out=self._codes[k])
        self._count = k + 1

    @property
    def _tables(self) -> tuple[NDArray[Any], NDArray[Any]]:
        return self._numbers, self._codes

    def column(self, name: str) -> NDArray[Any]:
        """Values of the quantity `name` over the cycles, (N,) or (N, width), not copied."""
        rows = slice(self._count)
        whole = name in self._whole
        found: NDArray[Any] = self._codes[rows, self._whole[name]] if whole else self._numbers[rows, self._real[name]]
        return found[:, 0] if name in REAL_OWN or name in WHOLE_OWN else found


def _columns(widths: dict[str, int]) -> dict[str, slice]:
    """Columns of each quantity in a table."""
    ends = np.cumsum(list(widths.values())).tolist()
    return {name: slice(end - width, end) for (name, width), end in zip(widths.items(), ends, strict=True)}


def _width(columns: dict[str, slice]) -> int:
    return max(int(part.stop) for part in columns.values())


class Journal:
    """List of events, and the recorder."""

    def __init__(self, record: Recorder | None) -> None:
        """Begin without events."""
        given: object = record  # this check is for callers without a type checker
        if given is not None and not isinstance(given, Recorder):
            step = "Give an object with the methods of control.Recorder, or None."
            raise InvalidValueError("record", brief(given), "a receiver of cycles and events", step)
        self.events: list[Event] = []
        self._record = record

    @property
    def watched(self) -> bool:
        """True if there is a recorder."""
        return self._record is not None

    def add(self, event: Event) -> str:
        """Add an event; return the message of `tell`."""
        self.events.append(event)
        return self.tell(lambda record: record.event(event))

    def tell(self, what: Callable[[Recorder], object]) -> str:
        """Call a method of the recorder. Return "". After an exception, remove the recorder and return a message."""
        if self._record is None:
            return ""
        try:
            what(self._record)
        except Exception as error:
            self._record = None
            why = f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
            return f"recording has stopped, because the recorder raised {why}. The motion continues without it."
        return ""

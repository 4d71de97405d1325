"""Events, and records of cycles for executions and recorders."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from math import nan
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from sagline.control.link import OF_WINCHES, REALS, Command, Missing, Sample
from sagline.control.states import State
from sagline.core.arguments import brief
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.results import Status
from sagline.kinematics.plan import Plan


class EventKind(StrEnum):
    """Kind of an event."""

    STATE = "state"  # change of state
    FAULT = "fault"
    NOTE = "note"  # note for the operator, without effect on the controller


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


class Recorded(NamedTuple):
    """Record of one cycle. The arrays are not modified later.

    Attributes:
        number: Index of the cycle, from 0.
        state: State of the controller at the end of the cycle.
        degraded: True if a load cell is ignored, so that the tension loop keeps its correction.
        late: Delay of the start of the cycle [s]; 0 on a lockstep clock.
        clock: Time since the start of the plan [s]; NaN without a plan.
        command: Command sent in the cycle; None if nothing was sent.
        answer: Answer of the link.
        position: Position of the platform's origin, from the encoders [m], shape (3,); NaN before homing.
        quaternion: Rotation platform -> world from the encoders, scalar last, shape (4,).
        estimate: Code of the `ForwardStatus`; -1 without an estimate.
        zero: Offset from homing [m], shape (m,). Added to the lengths of samples, subtracted from set points.
        planned_tension: Planned T_A at the time of the answer [N], shape (m,); NaN without a plan.
        correction: Correction by the tension loop [m], shape (m,). The set points that were sent include it.
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
    """Receiver of cycles and events, for example a log. The methods must be fast, because the control loop waits."""

    @property
    def stopped(self) -> str:
        """Reason why the recorder has stopped, "" while it runs. A fault rule checks the reason."""

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
        """Allocate memory for `expected` cycles."""
        m, real = cable_count, np.float64
        sample = np.dtype(
            [
                (name, real if name in REALS else np.int64, m if name in OF_WINCHES else group_count)
                for name in Sample._fields[1:-1]  # without the time and the reasons
            ]
        )
        asked = [(name, real, m) for name in ("set_length", "set_rate", "set_tension", "planned_tension", "correction")]
        own = [("time", real), ("late", real), ("clock", real), ("position", real, 3), ("quaternion", real, 4)]
        codes = [("answered", np.bool_), ("state", np.int8), ("estimate", np.int8), ("mode", np.int8)]
        self._rows = np.zeros(max(expected, 1), np.dtype([*own, *asked, ("sample", sample), *codes], align=True))
        self._count = 0
        self._no_command = np.full(m, nan)
        blank = np.zeros(1, sample)  # floats are NaN, and integers are 0
        for name in REALS:
            blank[name] = nan
        self._no_sample = blank[0]

    def __len__(self) -> int:
        """Number of cycles so far."""
        return self._count

    def add(self, cycle: Recorded) -> None:
        """Add a cycle."""
        k = self._count
        if k == len(self._rows):
            self._rows = np.concatenate((self._rows, np.empty_like(self._rows)))
        answer, command, mode, asked = cycle.answer, cycle.command, -1, (self._no_command,) * 3
        if command is not None:
            mode, asked = int(command.mode), (command.length + cycle.zero, command.rate, command.tension)
        answered = isinstance(answer, Sample)
        own = answer.time, cycle.late, cycle.clock, cycle.position, cycle.quaternion
        sample: Any = answer[1:-1] if answered else self._no_sample
        # plain integers, because numpy converts members of an enumeration ten times slower
        codes = answered, int(cycle.state), cycle.estimate, mode
        self._rows[k] = (*own, *asked, cycle.planned_tension, cycle.correction, sample, *codes)
        self._count = k + 1

    @property
    def rows(self) -> NDArray[Any]:
        """Cycles so far, (N,), not copied: the fields of `Execution`, and `sample` with the fields of `Samples`."""
        return self._rows[: self._count]


class Journal:
    """List of events, and the recorder."""

    def __init__(self, record: Recorder | None) -> None:
        """Begin without events."""
        given: object = record  # this check helps callers without a type checker
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
        """Add an event. Returns the message of `tell`."""
        self.events.append(event)
        return self.tell(lambda record: record.event(event))

    def tell(self, what: Callable[[Recorder], object]) -> str:
        """Call a method of the recorder. Returns "", or a message after an exception, which removes the recorder."""
        if self._record is None:
            return ""
        try:
            what(self._record)
        except Exception as error:
            self._record = None
            why = f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
            return f"recording has stopped, because the recorder raised {why}. The motion continues without it."
        return ""

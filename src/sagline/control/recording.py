"""What a controller keeps of each cycle, and hands to those who look on."""

from __future__ import annotations

from math import nan
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array
from sagline.control.events import Event
from sagline.control.link import Command, Missing, Sample
from sagline.control.states import State
from sagline.kinematics.plan import Plan
from sagline.status import Status

BLOCK: Final = 4096  # cycles that are made room for at once

# what a cycle leaves: name, and how many numbers of it there are, of m winches and G groups
OWN: Final = ("time", "answered", "state", "late", "clock", "estimate", "mode")
PLACE: Final = (("position", 3), ("quaternion", 4))
OF_GROUPS: Final = ("age", "counter", "plc_time", "owner", "echo", "status", "fault", "discarded")
OF_WINCHES: Final = ("length", "rate", "torque", "tension", "filtered", "counts", "state", "winch_fault")
ASKED: Final = ("set_length", "set_rate", "set_tension", "planned_tension", "correction")


class Recorded(NamedTuple):
    """One cycle, as it went. Its arrays are not written to again.

    Attributes:
        number: Of the cycle, from 0.
        state: Of the controller at its end.
        degraded: Whether a cell is distrusted, and the tension loop off.
        late: By how much it began too late [s]; 0 on a lockstep clock.
        clock: Where on the plan it was [s], from its start; NaN where there is none.
        command: What was sent in it; None: nothing was.
        answer: What came back.
        position: Of the platform's origin, from the encoders [m], shape (3,); NaN before homing.
        quaternion: Rotation platform -> world from the encoders, scalar last, shape (4,).
        estimate: Code of its `ForwardStatus`; -1 where there is none.
        zero: What is added to lengths of samples, and taken from set points, since homing [m], shape (m,).
        planned_tension: T_A planned for the moment of the answer [N], shape (m,); NaN where there is no plan.
        correction: Of the tension loop, in the set points that were sent [m], shape (m,).
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


class Recorder(Protocol):
    """One who looks on: a log, a status line. It must never block: the loop waits for it."""

    @property
    def stopped(self) -> str:
        """Why it takes nothing more, "" while it does: what `Cycle.recording` tells the rules for faults."""

    def begins(self, plan: Plan) -> None:
        """Take a plan, before the first cycle that follows it."""

    def ends(self, status: Status, reason: str) -> None:
        """Take how that plan ended, an `ExecutionStatus`, after its last cycle."""

    def cycle(self, cycle: Recorded) -> None:
        """Take a cycle."""

    def event(self, event: Event) -> None:
        """Take an event."""


class Tape:
    """Cycles one below the other, in memory that is made beforehand."""

    def __init__(self, cable_count: int, group_count: int, expected: int) -> None:
        """Make room.

        Args:
            cable_count: Number of winches m.
            group_count: Number of groups G.
            expected: How many cycles are to come; there may be more.
        """
        widths = [(name, 1) for name in OWN]
        widths += PLACE
        widths += [(f"group_{name}", group_count) for name in OF_GROUPS]
        widths += [(f"winch_{name}", cable_count) for name in OF_WINCHES]
        widths += [(name, cable_count) for name in ASKED]
        ends = np.cumsum([width for _, width in widths])
        self._columns = {
            name: slice(int(end) - width, int(end)) for (name, width), end in zip(widths, ends, strict=True)
        }
        self._width = int(ends[-1])
        self._blocks = [np.empty((max(expected, 1), self._width))]
        self._row = 0  # in the last block
        self._full = 0  # rows in those before it
        self._absent = (
            np.full(len(OF_GROUPS) * group_count + len(OF_WINCHES) * cable_count, nan),
            np.full(3 * cable_count, nan),
        )

    def __len__(self) -> int:
        """Number of cycles so far."""
        return self._full + self._row

    def add(self, cycle: Recorded) -> None:
        """Keep a cycle."""
        block = self._blocks[-1]
        if self._row == len(block):
            self._full, self._row = self._full + len(block), 0
            block = np.empty((BLOCK, self._width))
            self._blocks.append(block)
        answer, command = cycle.answer, cycle.command
        answered = isinstance(answer, Sample)
        mode = -1 if command is None else command.mode
        own = (answer.time, answered, cycle.state, cycle.late, cycle.clock, cycle.estimate, mode)
        if isinstance(answer, Sample):
            read: tuple[NDArray[Any], ...] = (
                answer.age, answer.counter, answer.plc_time, answer.owner, answer.echo, answer.status, answer.fault,
                answer.discarded, answer.length, answer.rate, answer.torque, answer.tension, answer.filtered,
                answer.counts, answer.state, answer.winch_fault,
            )  # fmt: skip
        else:
            read = self._absent[:1]
        if command is None:
            asked: tuple[Array, ...] = self._absent[1:]
        else:
            asked = (command.length + cycle.zero, command.rate, command.tension)
        np.concatenate(
            (own, cycle.position, cycle.quaternion, *read, *asked, cycle.planned_tension, cycle.correction),
            out=block[self._row],
        )
        self._row += 1

    def column(self, name: str) -> Array:
        """One quantity over the cycles: a copy.

        Args:
            name: One of `OWN`, `PLACE`, `ASKED`; group_ or winch_ before one of `OF_GROUPS`, `OF_WINCHES`.

        Returns:
            Shape (N,) for one of `OWN`, else (N, width).
        """
        part = self._columns[name]
        blocks = [*self._blocks[:-1], self._blocks[-1][: self._row]]
        whole = np.concatenate([block[:, part] for block in blocks])
        return whole[:, 0].copy() if name in OWN else whole

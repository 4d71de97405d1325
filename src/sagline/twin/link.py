"""Link in the process of the machine, in lockstep with the machine, with delay, jitter and losses of messages."""

from __future__ import annotations

from collections import deque
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from sagline.control.link import Command, Missing, Refusal, Sample, Sent, Whole, newer, no_news, sent_to
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.plc.blocks import LOAD, TORN
from sagline.twin.injected import TimedQueue
from sagline.twin.plc_program import Order


class Network:
    """Delay, jitter and losses of messages."""

    def __init__(self, delay: float, jitter: float, loss: float, seed: int) -> None:
        """Check the arguments `delay` [s], `jitter` [s] and `loss` (a share)."""
        self._delay = number(delay, "delay", "s", low=0.0)
        self._jitter = number(jitter, "jitter", "s", low=0.0)
        self._loss = number(loss, "loss", "", low=0.0)
        if self._loss >= 1.0:
            raise InvalidValueError("loss", f"{loss:g}", ">= 0, < 1", "Give the share, 0.01 for 1 %.")
        self.ideal = not (self._delay or self._jitter or self._loss)  # True if each message arrives without delay
        self._generator = np.random.default_rng((seed, 1))

    def send(self, way: TimedQueue, now: float, message: Any) -> None:
        """Add a message to the queue `way` with its arrival time, or lose it. `now`: time of sending [s]."""
        lost, late = (1.0, 0.0) if self.ideal else self._generator.random(2)
        if lost >= self._loss:
            way.add(now + self._delay + late * self._jitter, message)


FIRST: Final = 2  # index of the first array of `PlcBlocks` with one column per group; before it, per winch

COUNTS, STATE, DRIVE_FAULT = range(3)  # rows of the second array
COUNTER, OWNER, ECHO, STATUS, FAULT = range(5)  # rows of the third array


class PlcBlocks:
    """Blocks of all groups, in arrays."""

    __slots__ = ("arrays", "owners")

    def __init__(self, arrays: tuple[Array, Whole, Whole, Array]) -> None:
        """Store the arrays."""
        # arrays: length, rate, torque, tension, filtered (5, m); counts, state, winch fault (3, m); counter, owner,
        # echo, status, fault (5, G); the PLCs' clocks [s] (G,)
        self.arrays = arrays
        # owners: ids of the controllers that own the groups, as plain numbers
        self.owners: list[int] = arrays[FIRST][OWNER].tolist()

    def copy(self) -> PlcBlocks:
        """Copy of the blocks."""
        floats, whole, groups, clocks = self.arrays
        return PlcBlocks((floats.copy(), whole.copy(), groups.copy(), clocks.copy()))

    def counter(self, group: int) -> int:
        """Counter of a group's block."""
        return int(self.arrays[FIRST][COUNTER, group])

    def keep(self, group: int, part: slice, other: PlcBlocks) -> None:
        """Replace the data of a group, with the winches `part`, by those of other blocks."""
        for k, (array, own) in enumerate(zip(self.arrays, other.arrays, strict=True)):
            where = part if k < FIRST else group
            array[..., where] = own[..., where]
        self.owners[group] = other.owners[group]


class Report(NamedTuple):
    """Content of the block of one group, as servers need it.

    Fields of `Sample` have the same meanings and units here, with a number of the group or a list of its winches.

    Attributes:
        counter_again: Block counter at the end of the block. The counters of an incomplete block differ.
        foreign: True if the block belongs to another program.
    """

    counter: int
    counter_again: int
    foreign: bool
    plc_time: float
    owner: int
    echo: int
    status: int
    fault: int
    length: list[float]
    rate: list[float]
    torque: list[float]
    tension: list[float]
    filtered: list[float]
    counts: list[int]
    state: list[int]
    winch_fault: list[int]


INVALID: Final = {  # reasons to discard the blocks that two of the injected faults produce
    "is torn": Refusal("it is incomplete, because its two counters differ", TORN),
    "is foreign": Refusal("it is of another program", f"Check the address. {LOAD}"),
}
HISTORY: Final = 100  # number of earlier blocks that are kept for the fault "goes back"


class _Driven(Protocol):
    """The part of the interface of `Machine` that a link uses."""

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]: ...
    @property
    def period(self) -> float: ...
    @property
    def time(self) -> float: ...
    def deliver(self, group: int, message: int | Order) -> None: ...
    def advance(self) -> None: ...


class MachineLink:
    """`Link` to a machine in the same process, without a thread."""

    def __init__(self, machine: _Driven, network: Network, moves: bool) -> None:
        """Begin without data of any group. Use `Machine.link` to create a link."""
        self._machine, self._network, self._moves = machine, network, moves
        self._groups = machine.groups
        count = len(self._groups)
        self._outbound = [TimedQueue() for _ in range(count)]  # messages that were sent but have not arrived yet
        self._inbound = [TimedQueue() for _ in range(count)]
        self._newest: list[PlcBlocks | None] = [None] * count
        self._arrival = np.zeros(count)
        self._parts = [slice(winches[0], winches[-1] + 1) for winches in self._groups]
        self._discarded = np.zeros(count, dtype=np.int64)
        self._reasons: tuple[Refusal | None, ...] = (None,) * count
        self._owner = [0] * count
        self._held: list[PlcBlocks | None] = [None] * count
        self._past: deque[PlcBlocks] = deque(maxlen=HISTORY)
        self._steps_back = [0] * count
        self._closed = False

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the winches of each group, from 0."""
        return self._groups

    @property
    def period(self) -> float:
        """Time between two commands [s]; each exchange advances the machine by this time."""
        return self._machine.period

    def exchange(self, command: Command | None) -> Sample | Missing:
        """Send a command, advance the machine by a period, and return the newest sample."""
        machine = self._machine
        if command is not None and not self._closed:
            self._send(command, machine.time)
        if self._moves:
            machine.advance()
        return self._look(machine.time)

    def close(self) -> None:
        """Stop sending. The machine is not affected."""
        self._closed = True

    def _send(self, command: Command, now: float) -> None:
        numbers = command.length.tolist(), command.rate.tolist(), command.tension.tolist(), command.enable.tolist()
        lengths, rates, tensions, enable = numbers
        head = command.counter, command.owner, command.mode, command.valid_for
        ideal, deliver = self._network.ideal, self._machine.deliver
        for group, part in enumerate(self._parts):
            what = sent_to(self._owner[group], command)
            if what is Sent.NOTHING:
                continue
            if what is Sent.COMMAND:
                message: Any = Order(*head, lengths[part], rates[part], tensions[part], enable[part])
            else:
                message = command.owner
            if ideal:
                deliver(group, message)
            else:
                self._network.send(self._outbound[group], now, message)

    def before(self, now: float) -> None:
        """Deliver the messages that have arrived until `now`, the start time of a scan [s]."""
        if not self._network.ideal:
            for group, way in enumerate(self._outbound):
                for _, message in way.due(now):
                    self._machine.deliver(group, message)

    def after(self, now: float, snapshot: PlcBlocks, spoiled: dict[int, str]) -> None:
        """Send the blocks of the PLCs after a scan. `now`: time [s]."""
        if self._network.ideal and not spoiled:
            self._newest, self._owner = [snapshot] * len(self._groups), list(snapshot.owners)
            self._arrival.fill(now)
        else:
            for group, back in enumerate(self._inbound):
                for block in self._blocks(group, snapshot, spoiled.get(group)):
                    self._network.send(back, now, block)
                for arrival, block in back.due(now):
                    self._take(group, arrival, block)
        self._past.append(snapshot)

    def _blocks(self, group: int, snapshot: PlcBlocks, how: str | None) -> list[PlcBlocks | Refusal]:
        """Blocks that a group sends in a scan, and the reason to discard them if a block is invalid."""
        held, self._held[group] = self._held[group], None
        if how == "goes back":
            self._steps_back[group] += 1
            return [self._past[max(len(self._past) - 1 - self._steps_back[group], 0)]] if self._past else []
        self._steps_back[group] = 0
        if how == "swaps" and held is None:
            self._held[group] = snapshot
            return []
        if how == "is silent":
            return []
        if how == "repeats":
            newest = self._newest[group]
            return [] if newest is None else [newest]
        if how in INVALID:
            return [INVALID[how]]
        return [snapshot, snapshot] if how == "doubles" else [snapshot, held] if held is not None else [snapshot]

    def _take(self, group: int, arrival: float, block: PlcBlocks | Refusal) -> None:
        """Accept a block if it is valid and newer than the previous block."""
        known, reason = self._newest[group], block if isinstance(block, Refusal) else None
        if isinstance(block, PlcBlocks) and known is not None:
            counters = block.counter(group), known.counter(group)
            reason = None if newer(*counters) else no_news(*counters)
        if isinstance(block, Refusal) or reason is not None:
            self._discarded[group] += 1
            self._reasons = (*self._reasons[:group], reason, *self._reasons[group + 1 :])
            return
        self._newest[group], self._arrival[group] = block, arrival
        self._owner[group] = block.owners[group]

    def _look(self, now: float) -> Sample | Missing:
        newest = [block for block in self._newest if block is not None]
        if len(newest) < len(self._newest):
            silent = tuple(group for group, block in enumerate(self._newest) if block is None)
            return Missing(now, silent, ("no block has arrived yet",) * len(silent))
        blocks = newest[0].copy()
        for group, block in enumerate(newest):
            if block is not newest[0]:
                blocks.keep(group, self._parts[group], block)
        floats, whole, (counter, owner, echo, status, fault), clock = blocks.arrays
        length, rate, torque, tension, filtered = floats
        counts, state, winch_fault = whole
        return Sample(
            now, now - self._arrival, counter, clock, owner, echo, status, fault,
            length, rate, torque, tension, filtered, counts, state, winch_fault, self._discarded.copy(), self._reasons,
        )  # fmt: skip

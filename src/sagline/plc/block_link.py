"""Link to PLCs by data blocks. Each group has a thread that waits for the socket of its PLC."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from threading import Event, Thread
from time import perf_counter
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.control import link
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.plc.blocks import CLAIM, FROM_PLC, TO_PLC, Block, command_blocks, sample_of
from sagline.plc.wire import Address, LinkError, Wire, WireError, groups_at
from sagline.robot.robot import Robot

RETRY: Final = 0.2  # time between attempts to connect [s]


class _Newest(NamedTuple):
    """Newest valid block of a group, with its times."""

    values: dict[str, Any]  # values of the rows, by name
    arrived: float  # time of arrival on the link's clock [s]
    round_trip: float  # time between the request (or command) and the arrival [s]


class _GroupThread(Thread):
    """Thread that exchanges data with one PLC."""

    def __init__(self, number: int, winches: int, wire: Wire, clock: Callable[[], float]) -> None:
        """Prepare the thread. `clock`: clock of the link [s]."""
        super().__init__(name=f"sagline group {number}", daemon=True)
        self.number = number  # index of the group, from 0
        self.newest: _Newest | None = None  # newest valid block of the group; None before the first valid block
        self.discarded = 0
        self.reason: link.Refusal | None = None  # reason of the last invalid block; None before the first invalid block
        self.trouble: link.Refusal | None = None  # last error of the connection; None without an error
        self.settled = Event()  # event that the first answer of the PLC sets, whether the answer is valid or not
        self._winches = winches
        self._wire = wire
        self._clock = clock
        self._kick = Event()
        # block to write, its bytes, and the time at which it was queued [s]; a new block replaces a queued block
        self._outgoing: deque[tuple[Block, bytes, float]] = deque(maxlen=1)
        self._ending = Event()

    def hand_over(self, block: Block, data: bytes) -> None:
        """Queue `block` for writing in place of an earlier queued block. After the writing, the PLC's block is read."""
        self._outgoing.append((block, data, self._clock()))
        self._kick.set()

    def ask(self) -> None:
        """Read the PLC's block without writing."""
        self._outgoing.clear()
        self._kick.set()

    def finish(self) -> None:
        """Stop the thread after it has written the queued block."""
        self._ending.set()
        self._kick.set()

    def abort(self) -> None:
        self._wire.abort()

    def silence(self, waited: float) -> link.Refusal:
        """Reason why a PLC has not answered for the time `waited` [s], and the next step."""
        if self._wire.reached():
            return link.Refusal(f"the port is open, but there was no response for {waited:g} s", "Check the port")
        step = "Check address and cables, and that the PLC or the twin runs"
        return link.Refusal(f"no response for {waited:g} s", step)

    def run(self) -> None:
        """Exchange blocks until the thread is stopped. Reconnect after each failure."""
        while not self._ending.is_set():
            try:
                self._wire.open()
                self._serve()
            except Exception as error:  # all exceptions are caught, because only this thread can reconnect
                self.trouble = error.refusal if isinstance(error, WireError) else _unexpected(error)
                self.settled.set()
            finally:
                self._wire.close()
            self._ending.wait(RETRY)

    def _serve(self) -> None:
        connected = self._clock()
        while True:
            asked = self._clock()
            if self._outgoing:
                block, data, since = self._outgoing.popleft()
                if asked - since < link.HEARTBEAT:  # after a new connection, commands from before it are obsolete
                    asked = since
                    self._wire.write(block, data)
            if self._ending.is_set():
                return
            self._take(self._wire.read(FROM_PLC), asked, connected)
            self._kick.wait()
            self._kick.clear()

    def _take(self, data: bytes, asked: float, connected: float) -> None:
        arrived = self._clock()
        values = FROM_PLC.read(data)
        self.trouble = reason = values if isinstance(values, link.Refusal) else self._mismatch(values)
        if not isinstance(values, link.Refusal):
            reason = reason or self._no_news(values["counter"], arrived, connected)
            if reason is None:
                self.newest = _Newest(values, arrived, arrived - asked)
        if reason is not None:
            self.reason = reason
            self.discarded += 1
        self.settled.set()

    def _mismatch(self, values: dict[str, Any]) -> link.Refusal | None:
        """Reason why a valid block cannot be from the expected PLC; None if it can."""
        group = values["group"] - 1  # counters of blocks start at 1; 0 means no block
        if group != self.number:
            who = f"is group {group}" if group >= 0 else "has no group number"
            step = "Give the addresses in the groups' order, and give each PLC its number"
            return link.Refusal(f"the PLC there {who}, not {self.number}", step)
        if values["winches"] != self._winches:
            return link.Refusal(
                f"the PLC there drives {values['winches']} winches, the robot has {self._winches} in this group",
                "Check the robot file and the address",
            )
        return None

    def _no_news(self, counter: int, arrived: float, connected: float) -> link.Refusal | None:
        """Reason to discard a block, or None if it is new. Any block after a long silence is new (restarted PLC)."""
        newest = self.newest
        if newest is None:
            return None
        known = newest.values["counter"]
        restarted = newest.arrived < connected or arrived - newest.arrived > link.OWNER_TIMEOUT
        return None if link.newer(counter, known) or (restarted and counter != known) else link.no_news(counter, known)


def _unexpected(error: Exception) -> link.Refusal:
    text = " ".join(str(error).split())[:80]
    return link.Refusal(f"the exchange failed with {type(error).__name__} ({text})", "Report it, if it happens again")


LONGEST: Final = 3600.0  # largest allowed `timeout` for the first answers [s]


class BlockLink:
    """Link (`sagline.control.link.Link`) with one connection per group; base class of `S7Link` and `ModbusLink`."""

    def __init__(self, addresses: Sequence[Address], robot: Robot | int, wires: Sequence[Wire], timeout: float) -> None:
        """Connect to all groups at the same time. `timeout`: longest wait for the first answers [s]."""
        patience = number(timeout, "timeout", "s", above=0.0)
        if patience > LONGEST:
            raise InvalidValueError(
                "timeout", f"{patience:g} s", f"above 0 s, to {LONGEST:g} s", "2 s are sufficient in most networks."
            )
        self._groups = groups_at(addresses, robot)
        self._addresses = tuple(addresses)
        self._began = perf_counter()
        self._exchanges = [
            _GroupThread(i, len(group), wire, self._clock)
            for i, (group, wire) in enumerate(zip(self._groups, wires, strict=True))
        ]
        for group in self._exchanges:
            group.start()
        self._wait(patience)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the winches of each group, from 0."""
        return self._groups

    @property
    def period(self) -> float:
        """Time between two commands [s], the same as in the program of the PLCs."""
        return link.PERIOD

    @property
    def round_trip(self) -> Array:
        """Time from the command to the answer in the newest sample of each group [s], (G,); NaN without a sample."""
        return np.array([np.nan if g.newest is None else g.newest.round_trip for g in self._exchanges])

    def exchange(self, command: link.Command | None) -> link.Sample | link.Missing:
        """Pass a command to the threads of the groups and return the newest data, without waiting.

        If `command.claims` is True, a group that another controller owns receives the claim instead of the command.

        Args:
            command: Set points of all winches; None to read only.

        Returns:
            The newest sample of all groups, or the groups with missing data.
        """
        now = self._clock()
        newest = [group.newest for group in self._exchanges]
        if command is None:
            for group in self._exchanges:
                group.ask()
        else:
            self._send(command, [0 if n is None else n.values["owner"] for n in newest])
        known = [n for n in newest if n is not None]
        if len(known) < len(newest):
            return self._missing(now)
        return sample_of(
            [n.values for n in known],
            winches=sum(len(group) for group in self._groups),
            time=now,
            age=np.array([now - n.arrived for n in known]),
            discarded=np.array([group.discarded for group in self._exchanges]),
            reasons=tuple(group.reason for group in self._exchanges),
        )

    def close(self) -> None:
        """Wait until the last command is written, then disconnect."""
        for group in self._exchanges:
            group.finish()
        for patience in (0.5, 0.2):  # longest time until the last block is written and the threads end [s]
            until = perf_counter() + patience
            for group in self._exchanges:
                group.join(max(0.0, until - perf_counter()))
            for group in self._exchanges:
                if group.is_alive():
                    group.abort()

    def _clock(self) -> float:
        return perf_counter() - self._began

    def _send(self, command: link.Command, owners: Sequence[int]) -> None:
        claim = CLAIM.pack({"owner": command.owner})
        for group, owner, block in zip(self._exchanges, owners, command_blocks(command), strict=True):
            what = link.sent_to(owner, command)
            if what is link.Sent.NOTHING:
                group.ask()
            else:
                group.hand_over(*((TO_PLC, block) if what is link.Sent.COMMAND else (CLAIM, claim)))

    def _missing(self, now: float) -> link.Missing:
        silent = [i for i, group in enumerate(self._exchanges) if group.newest is None]
        reasons = [self._refusal(i, now) for i in silent]
        return link.Missing(now, tuple(silent), tuple(reason.reason for reason in reasons))

    def _refusal(self, index: int, waited: float) -> link.Refusal:
        group = self._exchanges[index]
        return group.trouble or group.silence(waited)

    def _wait(self, timeout: float) -> None:
        """Wait for the first answers. If a group does not answer, close the link."""
        for group in self._exchanges:
            group.settled.wait(max(0.0, timeout - self._clock()))
        silent = [i for i, group in enumerate(self._exchanges) if group.newest is None]
        if not silent:
            return
        first = self._refusal(silent[0], timeout)
        others = [str(i) for i in silent[1:]]
        self.close()
        more = f" (group{'s' * (len(others) > 1)} {', '.join(others)} cannot be used either)" if others else ""
        where = f"group {silent[0]} at {self._addresses[silent[0]]}"
        raise LinkError(where, first.reason + more, first.next_step)

"""The link to PLCs by data blocks, whatever carries them: one thread a group, and nobody else waits."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Final

import numpy as np

from sagline.control.link import PERIOD, Command, Missing, Sample, Sent, sent_to
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.plc.addresses import Address, groups_at
from sagline.plc.blocks import CLAIM, TO_PLC, Refusal
from sagline.plc.group import Group
from sagline.plc.packing import claim_block, command_blocks, sample_of
from sagline.plc.wire import LinkError, Wire
from sagline.robot.robot import Robot

LONGEST: Final = 3600.0  # s, that a PLC may take to answer first


class BlockLink:
    """A link (`sagline.control.link.Link`) over one wire a group; `S7Link` and `ModbusLink` are made of it."""

    def __init__(self, addresses: Sequence[Address], robot: Robot | int, wires: Sequence[Wire], timeout: float) -> None:
        """Connect to all groups at once.

        Args:
            addresses: Of the PLCs, in the groups' order.
            robot: Whose winches they drive; or how many there are.
            wires: To each of them.
            timeout: How long they may take to answer first [s].

        Raises:
            LinkError: If one does not answer, or not as sagline's PLC would.
        """
        patience = number(timeout, "timeout", "s", above=0.0)
        if patience > LONGEST:
            raise InvalidValueError(
                "timeout", f"{patience:g} s", f"above 0 s, to {LONGEST:g} s", "2 s do for most networks."
            )
        self._groups = groups_at(addresses, robot)
        self._addresses = tuple(addresses)
        self._began = perf_counter()
        self._exchanges = [
            Group(i, len(group), wire, self._clock)
            for i, (group, wire) in enumerate(zip(self._groups, wires, strict=True))
        ]
        for group in self._exchanges:
            group.start()
        self._wait(patience)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The winches of each group, from 0."""
        return self._groups

    @property
    def period(self) -> float:
        """Between two commands, as the program in the PLCs has it [s]."""
        return PERIOD

    @property
    def round_trip(self) -> Array:
        """How long each group's newest sample took, from command to answer [s], shape (G,); NaN before the first."""
        return np.array([np.nan if g.newest is None else g.newest.round_trip for g in self._exchanges])

    def exchange(self, command: Command | None) -> Sample | Missing:
        """Hand a command to the groups' threads and take what they have; waits for nothing.

        A group whose grant another id has, or nobody, is sent the claim of `command.owner` where it says so, and no
        command.

        Args:
            command: What is asked for; None: nothing is sent, for those who only read.
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
        )

    def close(self) -> None:
        """Write what was handed over last, and disconnect."""
        for group in self._exchanges:
            group.finish()
        for patience in (0.5, 0.2):  # s: for what they write, and for what they waited for
            until = perf_counter() + patience
            for group in self._exchanges:
                group.join(max(0.0, until - perf_counter()))
            for group in self._exchanges:
                if group.is_alive():
                    group.abort()

    def _clock(self) -> float:
        return perf_counter() - self._began

    def _send(self, command: Command, owners: Sequence[int]) -> None:
        claim = claim_block(command.owner)
        for group, owner, block in zip(self._exchanges, owners, command_blocks(command), strict=True):
            what = sent_to(owner, command)
            if what is Sent.NOTHING:
                group.ask()
            else:
                group.hand_over(*((TO_PLC, block) if what is Sent.COMMAND else (CLAIM, claim)))

    def _missing(self, now: float) -> Missing:
        silent = [i for i, group in enumerate(self._exchanges) if group.newest is None]
        reasons = [self._refusal(i, now) for i in silent]
        return Missing(now, tuple(silent), tuple(reason.reason for reason in reasons))

    def _refusal(self, index: int, waited: float) -> Refusal:
        group = self._exchanges[index]
        return group.trouble or group.silence(waited)

    def _wait(self, timeout: float) -> None:
        """Until every group has answered; whoever has not, or not well, ends the link."""
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

"""The exchange with the PLC of one group: a thread of its own waits for the socket, so that nobody else must."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import Event, Thread
from typing import Any, Final, NamedTuple

from sagline.control.link import HEARTBEAT, OWNER_TIMEOUT, newer
from sagline.plc.blocks import FROM_PLC, Block, Refusal
from sagline.plc.wire import Wire, WireError

RETRY: Final = 0.2  # s between attempts to connect


class Newest(NamedTuple):
    """The newest good block of a group.

    Attributes:
        values: By name of the row.
        arrived: When it came in, on the link's clock [s].
        round_trip: From when it was asked for, and a command sent [s].
    """

    values: dict[str, Any]
    arrived: float
    round_trip: float


class Outgoing(NamedTuple):
    """What is to be written next.

    Attributes:
        block: Which.
        data: Its bytes.
        since: When it was handed over [s].
    """

    block: Block
    data: bytes
    since: float


class Group(Thread):
    """The exchange with one PLC.

    Attributes:
        number: Of the group, from 0.
        newest: Its newest good block; None before the first.
        discarded: How many blocks were no good.
        trouble: What went wrong last; None while all is well.
        settled: Set when the PLC has answered, well or not.
    """

    def __init__(self, number: int, winches: int, wire: Wire, clock: Callable[[], float]) -> None:
        """Prepare; `start` begins.

        Args:
            number: Of the group, from 0.
            winches: How many it drives.
            wire: To its PLC.
            clock: Of the link [s].
        """
        super().__init__(name=f"sagline group {number}", daemon=True)
        self.number = number
        self.newest: Newest | None = None
        self.discarded = 0
        self.trouble: Refusal | None = None
        self.settled = Event()
        self._winches = winches
        self._wire = wire
        self._clock = clock
        self._kick = Event()
        self._outgoing: deque[Outgoing] = deque(maxlen=1)  # the newest takes the place of one not yet written
        self._ending = Event()

    def hand_over(self, block: Block, data: bytes) -> None:
        """Have a block written, in place of one that was not written yet, and the PLC's read.

        Args:
            block: Which.
            data: Its bytes.
        """
        self._outgoing.append(Outgoing(block, data, self._clock()))
        self._kick.set()

    def ask(self) -> None:
        """Have the PLC's block read, and nothing written."""
        self._outgoing.clear()
        self._kick.set()

    def finish(self) -> None:
        """Stop, once what was handed over is written."""
        self._ending.set()
        self._kick.set()

    def abort(self) -> None:
        """Stop, whatever it waits for."""
        self._wire.abort()

    def silence(self, waited: float) -> Refusal:
        """What to say of a PLC that has said nothing yet.

        Args:
            waited: For how long [s].
        """
        if self._wire.reached():
            return Refusal(f"something listens there, but has answered nothing for {waited:g} s", "Check the port")
        return Refusal(
            f"no answer for {waited:g} s", "Check address and cables, and that the PLC is on and in this network"
        )

    def run(self) -> None:
        """Exchange until the end; connect anew whenever that fails."""
        while not self._ending.is_set():
            try:
                self._wire.open()
                self._serve()
            except Exception as error:  # whatever it is: nobody but this thread would connect anew
                self.trouble = error.refusal if isinstance(error, WireError) else _mishap(error)
                self.settled.set()
            finally:
                self._wire.close()
            self._ending.wait(RETRY)

    def _serve(self) -> None:
        connected = self._clock()
        while True:
            asked = self._clock()
            if self._outgoing:
                outgoing = self._outgoing.popleft()
                if asked - outgoing.since < HEARTBEAT:  # what waited longer, for a connection, is history
                    asked = outgoing.since
                    self._wire.write(outgoing.block, outgoing.data)
            if self._ending.is_set():
                return
            self._take(self._wire.read(FROM_PLC), asked, connected)
            self._kick.wait()
            self._kick.clear()

    def _take(self, data: bytes, asked: float, connected: float) -> None:
        arrived = self._clock()
        values = FROM_PLC.read(data)
        self.trouble = values if isinstance(values, Refusal) else self._strange(values)
        if isinstance(values, Refusal) or self.trouble or not self._is_news(values["counter"], arrived, connected):
            self.discarded += 1
        else:
            self.newest = Newest(values, arrived, arrived - asked)
        self.settled.set()

    def _strange(self, values: dict[str, Any]) -> Refusal | None:
        """Why a good block is not of the PLC that was expected here; None where it is."""
        told = values["group"] - 1  # in a block it is one more
        if told != self.number:
            who = f"is group {told}" if told >= 0 else "was not told which group it is"
            step = "Give the addresses in the groups' order, and each PLC its number"
            return Refusal(f"the PLC there {who}, not {self.number}", step)
        if values["winches"] != self._winches:
            return Refusal(
                f"the PLC there drives {values['winches']} winches, the robot has {self._winches} in this group",
                "Check the robot file and the address",
            )
        return None

    def _is_news(self, counter: int, arrived: float, connected: float) -> bool:
        """Whether a block is newer than the newest; where that is long ago, the PLC may have begun anew."""
        newest = self.newest
        if newest is None:
            return True
        known = newest.values["counter"]
        anew = newest.arrived < connected or arrived - newest.arrived > OWNER_TIMEOUT
        return newer(counter, known) or (anew and counter != known)


def _mishap(error: Exception) -> Refusal:
    text = " ".join(str(error).split())[:80]
    return Refusal(f"the exchange failed with {type(error).__name__} ({text})", "Report it, if it happens again")

"""Commands of a controller, each with its id and the next number."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.control.link import COUNTERS, HEARTBEAT, Command, Mode, Sample
from sagline.core.arrays import Array, Flags

VALID_FOR: Final = HEARTBEAT  # s: so long a PLC may go on with a command
MOST_OWNER: Final = 2**31


class Sender:
    """Maker of the next command.

    Attributes:
        owner: The controller's id.
        counter: Of the last command.
        command: To be sent next; None: nothing is sent.
        length: At rest, as read [m], shape (m,).
        tension: At rest, at the drums [N], shape (m,).
    """

    def __init__(self, cable_count: int, random: np.random.Generator) -> None:
        """Begin without a command."""
        self.owner = int(random.integers(1, MOST_OWNER))
        self.counter = int(random.integers(1, MOST_OWNER))
        self.command: Command | None = None
        self.length, self.tension = np.full(cable_count, np.nan), np.zeros(cable_count)
        self._enabled: Flags = np.ones(cable_count, dtype=np.bool_)
        self._disabled: Flags = ~self._enabled

    def follow(self, length: Array, rate: Array, tension: Array, enable: Flags | None) -> None:
        """Command set points; length [m], rate [m/s], tension [N] at the drums, enable (None: all), each (m,)."""
        self._send(Mode.FOLLOW, length, rate, tension, self._enabled if enable is None else enable, claims=False)

    def rest(self, mode: Mode, *, enabled: bool, claims: bool = False) -> None:
        """Command the drives to stand where they are."""
        enable = self._enabled if enabled else self._disabled
        self._send(mode, self.length, np.zeros(len(self.length)), self.tension, enable, claims)

    def nothing(self) -> None:
        """Send nothing."""
        self.command = None

    def stand_at(self, sample: Sample | None, tension: Array | None = None) -> None:
        """Set the lengths of rest to those of a sample, and the tensions [N] (m,) to those given or read."""
        if sample is not None:
            self.length, self.tension = sample.length, sample.filtered if tension is None else tension

    def _send(self, mode: Mode, length: Array, rate: Array, tension: Array, enable: Flags, claims: bool) -> None:
        self.counter = self.counter % COUNTERS + 1
        pulls = np.maximum(tension, 0.0)  # of a reading below zero; a PLC refuses to push
        self.command = Command(self.counter, self.owner, mode, VALID_FOR, length, rate, pulls, enable, claims)

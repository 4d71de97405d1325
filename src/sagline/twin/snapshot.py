"""What all PLCs of a machine say after a scan."""

from __future__ import annotations

from typing import Final, NamedTuple

from sagline.control.link import Whole
from sagline.core.arrays import Array

FIRST: Final = 2  # of the arrays of a snapshot that are of groups rather than winches

COUNTS, STATE, DRIVE_FAULT = range(3)  # rows of the second
COUNTER, OWNER, ECHO, STATUS, FAULT = range(5)  # rows of the third


class Snapshot:
    """Blocks of all groups, in a few arrays.

    Attributes:
        arrays: Length, rate, torque, tension, filtered (5, m); counts, state, winch fault (3, m); counter, owner,
            echo, status, fault (5, G); the PLCs' clocks [s] (G,).
        owners: Who has the grants, as plain numbers.
    """

    __slots__ = ("arrays", "owners")

    def __init__(self, arrays: tuple[Array, Whole, Whole, Array]) -> None:
        """Keep what there is."""
        self.arrays = arrays
        self.owners: list[int] = arrays[FIRST][OWNER].tolist()

    def counter(self, group: int) -> int:
        """Of a group's block."""
        return int(self.arrays[FIRST][COUNTER, group])

    def keep(self, group: int, part: slice, before: Snapshot) -> None:
        """Let a group say again what it said before.

        Args:
            group: Which, from 0.
            part: Its winches.
            before: What was said before.
        """
        for k, (array, old) in enumerate(zip(self.arrays, before.arrays, strict=True)):
            where = part if k < FIRST else group
            array[..., where] = old[..., where]
        self.owners[group] = before.owners[group]


class Report(NamedTuple):
    """What the block of one group holds, for a server to put it where a controller reads it.

    Attributes:
        counter: Of the blocks, at the block's beginning.
        counter_again: At its end: another one where the block is torn.
        foreign: Whether the block is of another program.
        plc_time: On the PLC's clock [s].
        owner: Who has the grant.
        echo: Counter of the last command taken.
        status: Bits of `GroupStatus`.
        fault: Code of `GroupFault`.
        length: Of the group's winches [m].
        rate: [m/s].
        torque: [N m].
        tension: [N].
        filtered: [N].
        counts: Of the encoders.
        state: Codes of `WinchState`.
        winch_fault: The drives' own codes.
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

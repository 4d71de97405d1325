"""What the rules for faults may look at: one cycle of the controller."""

from __future__ import annotations

from typing import Final, NamedTuple

from sagline.control.link import Command, Mode, Sample
from sagline.control.null_space import NullSpace
from sagline.core.arrays import Array

MOVING: Final = 1e-3  # m/s: a set point that changes faster is in motion


class Cycle(NamedTuple):
    """One cycle, after the sample came in and before the next command goes out.

    Attributes:
        sample: What the machine said last.
        before: What it had said in the cycle before; None in the first.
        command: What was sent in the cycle before; None where nothing was, by those who only read.
        tension: T_A, planned for this cycle [N], shape (m,); NaN where there is no plan, as before homing.
        gains: Row of the plan's gains at this time; None where there is none.
        correction: What the tension loop adds to the lengths of the plan [m], shape (m,).
        late: How much later than planned the cycle began [s]; 0 on the clock of an in-process machine.
        recording: Why recording has stopped; "" while it goes on, or where nothing is recorded.
    """

    sample: Sample
    before: Sample | None
    command: Command | None
    tension: Array
    gains: NullSpace | None
    correction: Array
    late: float = 0.0
    recording: str = ""

    @property
    def moving(self) -> bool:
        """Whether set points change."""
        command = self.command
        return command is not None and command.mode == Mode.FOLLOW and bool(abs(command.rate).max() > MOVING)

"""How the calculation of a vibration ended."""

from __future__ import annotations

from enum import IntEnum


class VibrationStatus(IntEnum):
    """Whether a state has linear vibrations."""

    SOLVED = 0
    UNSTABLE = 1
    NO_LENGTHS = 2
    FOLDED = 3

    @property
    def text(self) -> str:
        """What it means, and what to do."""
        return _TEXTS[self]


_TEXTS = {
    VibrationStatus.SOLVED: "all modes up to the frequency asked for are found",
    VibrationStatus.UNSTABLE: "the equilibrium is unstable: it leaves in its negative_directions; simulate it",
    VibrationStatus.NO_LENGTHS: "the pose has no answer: see the status of the plan",
    VibrationStatus.FOLDED: "a cable hangs folded or slack and has no linear vibration: its index is in slack_cables; "
    "the modes are those of the others",
}

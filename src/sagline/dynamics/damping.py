"""What takes energy out of a vibration."""

from __future__ import annotations

from dataclasses import dataclass

from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError


@dataclass(frozen=True, slots=True)
class Damping:
    """What takes energy out of a vibration; none unless told otherwise.

    Attributes:
        loss_time: Eta of the cables' stretch [s], >= 0: at the angular frequency omega EA becomes EA (1 + i omega eta)
            (Kelvin-Voigt).
        air_damping: Force on a cable against its velocity, a length [N s/m^2], >= 0.
        modal_damping: Damping ratio of every mode, on top of the others, >= 0, < 1.

    Raises:
        InvalidValueError: If a value is out of its range.

    Source:
        docs/vibration.md.
    """

    loss_time: float = 0.0
    air_damping: float = 0.0
    modal_damping: float = 0.0

    def __post_init__(self) -> None:
        """Check the values."""
        for name, unit in (("loss_time", "s"), ("air_damping", "N s/m^2"), ("modal_damping", "")):
            object.__setattr__(self, name, number(getattr(self, name), name, unit, low=0.0))
        if self.modal_damping >= 1.0:
            step = "Give the ratio, 0.01 for 1 %."
            raise InvalidValueError("modal_damping", f"{self.modal_damping:g}", "< 1", step)

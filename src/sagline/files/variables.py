"""What a variable of a file in NetCDF is: its name, its dimensions, its unit, and what its values may be."""

from __future__ import annotations

from enum import Enum, IntEnum
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

# labels along the dimensions beside rows and cable
PARTS = {
    "axis": ("x", "y", "z"),
    "quaternion_part": ("x", "y", "z", "w"),
    "wrench_part": ("force x", "force y", "force z", "moment x", "moment y", "moment z"),
    "twist_part": ("linear x", "linear y", "linear z", "angular x", "angular y", "angular z"),
    "residual_part": ("force", "moment"),
    "bracket_part": ("proved", "sufficient"),
}


class Known(Enum):
    """Where a quantity has values; elsewhere it is NaN."""

    EVERYWHERE = "at every pose"
    SOLVED = "at the solved poses alone"
    SOMEWHERE = "at any poses"


class Quantity(NamedTuple):
    """One variable of the file, and what its values may be.

    Attributes:
        name: Its name in the file.
        place: Where a result has it, as a dotted attribute.
        parts: Its dimensions after that of the rows: poses, or samples in time.
        unit: Unit as the file states it; "" for a plain number.
        long_name: What it is, in a reader's words.
        codes: The status it holds codes of, if any.
        known: Where it has values.
        low: Its lowest value.
        infinite: Whether it may be infinite.
        values: What its values are where they are no codes: float, int, bool for yes or no, or str.
    """

    name: str
    place: str
    parts: tuple[str, ...]
    unit: str
    long_name: str
    codes: type[IntEnum] | None = None
    known: Known = Known.EVERYWHERE
    low: float = -np.inf
    infinite: bool = False
    values: type[float | int | bool | str] = float

    @property
    def type(self) -> np.dtype[Any]:
        """The type of its values."""
        return np.dtype(np.int8 if self.codes is not None else object if self.values is str else self.values)

    def of(self, result: Any) -> Any:
        """The values of a result.

        Args:
            result: The result.

        Returns:
            Array, or None where it does not have it, such as a proof that a plan lacks.
        """
        return attrgetter(self.place)(result)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the variable; status codes are explained as the CF conventions want it."""
        found: dict[str, Any] = {"long_name": self.long_name}
        if self.unit:
            found["units"] = self.unit
        if self.codes is not None:
            found["flag_values"] = np.array([code.value for code in self.codes], dtype=np.int8)
            found["flag_meanings"] = " ".join(code.name.lower() for code in self.codes)
        return found

"""Where the numbers of a calibrated robot come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from types import MappingProxyType
from typing import Any

from numpy.typing import ArrayLike

from sagline.core.arguments import brief, text
from sagline.core.arrays import Array, locked, numbers
from sagline.core.errors import InvalidValueError
from sagline.robot.tolerances import deviations


@dataclass(frozen=True, slots=True, eq=False)
class Provenance:
    """The calibration that found some of a robot's numbers.

    Attributes:
        log: The log of readings that it used.
        date: When it was done, ISO 8601.
        standard_error: Name of what was found -> standard error of the robot's number, in the shape of the field and
            its SI unit; infinite where neither reading nor prior told of it. The names are those of tolerances.
        note: What else a user should know.
    """

    log: str
    date: str
    standard_error: Mapping[str, Array]
    note: str

    def __init__(
        self,
        log: str,
        date: str,
        standard_error: Mapping[str, ArrayLike] = MappingProxyType({}),
        note: str = "",
    ) -> None:
        """Check what does not need the robot; the robot checks names and shapes.

        Args:
            log: See the attributes.
            date: See the attributes.
            standard_error: See the attributes.
            note: See the attributes.

        Raises:
            InvalidValueError: If one is of the wrong kind, or the date is none.
        """
        given: Any = standard_error  # a caller without types gives anything
        if not isinstance(given, Mapping):
            allowed, step = "names of fields and standard errors", 'Give {"frame_anchors": 0.001}, in SI.'
            raise InvalidValueError("calibration: standard_error", brief(given), allowed, step)
        values = {
            "log": text(log, "calibration: log"),
            "date": _date(date),
            "standard_error": MappingProxyType({name: _numbers(name, value) for name, value in given.items()}),
            "note": text(note, "calibration: note"),
        }
        for field, value in values.items():
            object.__setattr__(self, field, value)

    def _of(self, cables: int) -> Provenance:
        """The same, every standard error in the shape of its field in a robot of so many cables."""
        errors = deviations(self.standard_error, "calibration: standard_error", cables, low=0.0)
        return Provenance(self.log, self.date, errors, self.note)

    def __reduce__(self) -> tuple[type[Provenance], tuple[Any, ...]]:
        """Pickle through the constructor."""
        return Provenance, (self.log, self.date, dict(self.standard_error), self.note)


def _numbers(name: Any, value: ArrayLike) -> Array:
    return locked(numbers(value, f"calibration: standard_error: {name if isinstance(name, str) else brief(name)}", ""))


def _date(value: Any) -> str:
    try:
        datetime.fromisoformat(value)
    except (TypeError, ValueError):
        step = 'Give it as "2026-03-01", with a time of the day behind it if need be.'
        raise InvalidValueError("calibration: date", brief(value), "a date in ISO 8601", step) from None
    return str(value)

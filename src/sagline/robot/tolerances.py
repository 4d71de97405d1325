"""Tolerances of a robot's numbers, their names, units and shapes; provenance of calibrated numbers."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from attrs import field, frozen
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, choice, text
from sagline.core.arrays import Array, checked, locked, numbers
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given_by_name, reduced
from sagline.core.results import set_fields


class _Uncertain(NamedTuple):
    """A number of a robot that may be off."""

    place: str  # where a robot has it, as a dotted attribute
    unit: str  # its unit in SI
    each: bool = True  # whether every cable has its own
    axes: bool = False  # whether it has three components, along x, y and z
    share: bool = False  # whether a file may give its tolerance as a share of it, in percent

    def shape(self, cables: int) -> tuple[int, ...]:
        """Its shape in a robot of so many cables."""
        return (*((cables,) if self.each else ()), *((3,) if self.axes else ()))


UNCERTAIN: Final[Mapping[str, _Uncertain]] = MappingProxyType(
    {
        "frame_anchors": _Uncertain("frame_anchors", "m", axes=True),
        "platform_anchors": _Uncertain("platform_anchors", "m", axes=True),
        "length_zero": _Uncertain("winches.length_zero", "m"),
        "drum_radius": _Uncertain("winches.drum_radius", "m", share=True),
        "linear_density": _Uncertain("cables.linear_density", "kg/m", share=True),
        "axial_stiffness": _Uncertain("cables.axial_stiffness", "N", share=True),
        "pulley_radius": _Uncertain("winches.pulley_radius", "m"),
        "dead_cable": _Uncertain("winches.dead_cable", "m"),
        "load_cell_gain": _Uncertain("winches.load_cell_gain", "", share=True),
        "load_cell_bias": _Uncertain("winches.load_cell_bias", "N"),
        "mass": _Uncertain("mass", "kg", each=False, share=True),
        "center_of_mass": _Uncertain("center_of_mass", "m", each=False, axes=True),
    }
)


def deviations(
    given: Any, item: str, cables: int, *, low: float = -np.inf, above: float = -np.inf
) -> Mapping[str, Array]:
    """Standard deviations of a robot's numbers, each in the shape of its field.

    given: of some names of `UNCERTAIN`: one number for all of the field, three along the axes where it has them, or the
    whole field; low: the least allowed; it may be infinite, where nothing is known. Returns the same names, in the same
    order.
    """
    if not isinstance(given, Mapping):
        allowed = "names of fields and standard deviations"
        raise InvalidValueError(item, brief(given), allowed, 'Give {"frame_anchors": 0.005}, in SI.')
    found = {}
    for name, value in given.items():
        what = UNCERTAIN[choice(name, f"{item}: field", UNCERTAIN)]
        shape, label = what.shape(cables), f"{item}: {name}"
        array = checked(value, label, what.unit, low=low, above=above, infinite=True)
        if array.shape not in ((), shape, shape[-1:] if what.axes else ()):
            ways = " or ".join(str(way) for way in dict.fromkeys(((), shape[-1:] if what.axes else (), shape)))
            raise InvalidValueError(
                label, f"of shape {array.shape}", f"shape {ways}", "Give one for all, or every one."
            )
        found[name] = locked(np.array(np.broadcast_to(array, shape)))
    return MappingProxyType(found)


def value_of(robot: object, name: str) -> Array | None:
    """The number of a robot that a tolerance is about.

    Returns its value in SI, shape () or that of the field; None where the robot does not have it.
    """
    found: Any = robot
    for part in UNCERTAIN[name].place.split("."):
        found = None if found is None else getattr(found, part)
    return None if found is None else np.asarray(found, dtype=np.float64)


def of_share(share: ArrayLike, value: Array | None, item: str) -> Array:
    """Standard deviation of a number, from a share of it.

    share: the share, shape () or that of the number; value: the number, or None where it is not known. Returns in the
    unit of the number, in its shape.
    """
    if value is None:
        raise InvalidValueError(item, "in percent", "a field that is given", f"Give {item} in its unit, or the field.")
    array = checked(share, item, "%")
    if array.shape not in ((), value.shape):
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape () or {value.shape}", "Give one for all.")
    return np.asarray(array * np.abs(value))


@frozen(eq=False, weakref_slot=False)
class Provenance:
    """The calibration that found some of a robot's numbers.

    Attributes:
        log: The log of readings that it used.
        date: When it was done, ISO 8601.
        standard_error: Name of what was found -> standard error of the robot's number, in the shape of the field and
            its SI unit; infinite with neither observations nor a prior. The names are those of tolerances.
        note: Further remarks for users.

    Raises:
        InvalidValueError: If one is of the wrong kind, or the date is none.
    """

    log: str
    date: str
    standard_error: Mapping[str, Array] = field(default=MappingProxyType({}), converter=given_by_name)
    note: str = ""

    def __attrs_post_init__(self) -> None:
        """Check what does not need the robot; the robot checks names and shapes."""
        given: Any = self.standard_error  # a caller without types gives anything
        if not isinstance(given, Mapping):
            allowed, step = "names of fields and standard errors", 'Give {"frame_anchors": 0.001}, in SI.'
            raise InvalidValueError("calibration: standard_error", brief(given), allowed, step)
        set_fields(
            self,
            log=text(self.log, "calibration: log"),
            date=_date(self.date),
            standard_error=MappingProxyType({name: _numbers(name, value) for name, value in given.items()}),
            note=text(self.note, "calibration: note"),
        )

    def _of(self, cables: int) -> Provenance:
        """The same, every standard error in the shape of its field in a robot of so many cables."""
        errors = deviations(self.standard_error, "calibration: standard_error", cables, low=0.0)
        return Provenance(self.log, self.date, errors, self.note)

    __reduce__ = reduced


def _numbers(name: Any, value: ArrayLike) -> Array:
    return locked(numbers(value, f"calibration: standard_error: {name if isinstance(name, str) else brief(name)}", ""))


def _date(value: Any) -> str:
    try:
        datetime.fromisoformat(value)
    except (TypeError, ValueError):
        step = 'Give it as "2026-03-01", with a time of the day behind it if need be.'
        raise InvalidValueError("calibration: date", brief(value), "a date in ISO 8601", step) from None
    return str(value)

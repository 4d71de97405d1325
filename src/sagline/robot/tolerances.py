"""Tolerances of a robot's quantities, and provenance of quantities that a calibration has identified."""

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
    """Description of a robot's quantity that can have a tolerance."""

    place: str  # path of the attribute in the robot, such as "cables.linear_density"
    unit: str  # SI unit of the quantity
    each: bool = True  # True if every cable has its own value
    axes: bool = False  # True for a quantity with components along x, y and z
    share: bool = False  # True if a file may state the tolerance in percent of the value

    def shape(self, cables: int) -> tuple[int, ...]:
        """Shape of the quantity in a robot with `cables` cables."""
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
    """Checked standard deviations of quantities in `UNCERTAIN`, each expanded to the shape of the quantity."""
    # given: dictionary from quantity names to deviations (infinite if unknown). A deviation is one number, three
    # numbers for the axes x, y, z, or an array of the shape of the quantity. low, above: limits of the deviations.
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
            step = "Give one value for all, or one value per entry."
            raise InvalidValueError(label, f"of shape {array.shape}", f"shape {ways}", step)
        found[name] = locked(np.array(np.broadcast_to(array, shape)))
    return MappingProxyType(found)


def value_of(robot: object, name: str) -> Array | None:
    """Value of the robot's quantity `name` in SI units; None if the robot does not have this quantity."""
    found: Any = robot
    for part in UNCERTAIN[name].place.split("."):
        found = None if found is None else getattr(found, part)
    return None if found is None else np.asarray(found, dtype=np.float64)


def of_share(share: ArrayLike, value: Array | None, item: str) -> Array:
    """Standard deviation in the unit of the quantity: relative deviation `share` times `value`."""
    if value is None:
        raise InvalidValueError(item, "in percent", "a field that is given", f"Give {item} in its unit, or the field.")
    array = checked(share, item, "%")
    if array.shape not in ((), value.shape):
        allowed = f"shape () or {value.shape}"
        raise InvalidValueError(item, f"of shape {array.shape}", allowed, "Give one value for all.")
    return np.asarray(array * np.abs(value))


@frozen(eq=False, weakref_slot=False)
class Provenance:
    """Origin of values that a calibration has identified: log, date and standard errors.

    Attributes:
        log: Text that names the winch log of the calibration.
        date: Date of the calibration as an ISO 8601 text, such as "2026-03-01".
        standard_error: Standard errors of the identified quantities, by the names of `Robot.tolerances`, in SI units,
            in the shape of the quantity; infinite without observations and prior.
        note: Further remarks for users.

    Raises:
        InvalidValueError: If a field has the wrong type, or the date is not a date.
    """

    log: str
    date: str
    standard_error: Mapping[str, Array] = field(default=MappingProxyType({}), converter=given_by_name)
    note: str = ""

    def __attrs_post_init__(self) -> None:
        """Check the fields. `Robot` also checks the names and shapes of the standard errors."""
        given: Any = self.standard_error  # a caller without type checks may pass anything
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
        """Copy in which every standard error has the shape of its quantity in a robot with `cables` cables."""
        errors = deviations(self.standard_error, "calibration: standard_error", cables, low=0.0)
        return Provenance(self.log, self.date, errors, self.note)

    __reduce__ = reduced


def _numbers(name: Any, value: ArrayLike) -> Array:
    return locked(numbers(value, f"calibration: standard_error: {name if isinstance(name, str) else brief(name)}", ""))


def _date(value: Any) -> str:
    try:
        datetime.fromisoformat(value)
    except (TypeError, ValueError):
        step = 'Give it as "2026-03-01", optionally followed by a time of day.'
        raise InvalidValueError("calibration: date", brief(value), "a date in ISO 8601", step) from None
    return str(value)

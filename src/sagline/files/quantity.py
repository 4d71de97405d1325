"""Numbers as people write them in files: plain in SI, or as text with a unit."""

from __future__ import annotations

import re
import reprlib
from functools import cache
from math import isnan
from typing import TYPE_CHECKING, Any

from sagline.errors import InvalidValueError

if TYPE_CHECKING:
    from pint import UnitRegistry

Nested = float | list["Nested"]

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = r"[^\W\d][\w\s*/^²³-]*"  # letters first; no parentheses, pint trips over some
_NUMBER_AND_UNIT = re.compile(rf"\s*({_NUMBER})(\s+1\s*/\s*{_UNIT}|\s*{_UNIT})")


def in_si(value: object, unit: str, item: str) -> Nested:
    """A quantity, or nested lists of quantities, as numbers in an SI unit.

    Args:
        value: Number (in the SI unit), text such as "22 mm^2", or lists of them.
        unit: The SI unit the result is in, "m^2" for instance; "" for none.
        item: The name a message uses.

    Returns:
        A number, or lists of numbers nested like the value. Infinities pass, ranges are the caller's to check.

    Raises:
        InvalidValueError: If something is no quantity, is not a number (NaN), or has another unit.
    """
    if isinstance(value, list | tuple):
        return [in_si(element, unit, f"{item}[{i}]") for i, element in enumerate(value)]
    number = _plain(value)
    if number is None and isinstance(value, str):
        number = _with_unit(value, unit, item)
    if number is None or isnan(number):
        raise _no_quantity(value, unit, item)
    return number


def _plain(value: object) -> float | None:
    # YAML 1.1 reads 44e3 as text, so text is tried as a number first
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):
        return None


def _with_unit(text: str, unit: str, item: str) -> float | None:
    found = _NUMBER_AND_UNIT.fullmatch(text)
    if found is None:
        return None
    factor = _factor(found[2].strip(), unit)
    if factor is None:
        raise _no_quantity(text, unit, item)
    return float(found[1]) * factor


@cache
def _factor(given: str, wanted: str) -> float | None:
    """How many of the wanted unit one of the given is; None if it is no such unit."""
    from pint.errors import PintError

    units = _registry()
    try:
        return float(units.Quantity(1.0, units.parse_units(given)).to(wanted or "dimensionless").magnitude)
    except (PintError, ValueError, TypeError, AttributeError, SyntaxError, ArithmeticError):
        return None  # pint has no common ancestor for what it cannot parse


@cache
def _registry() -> UnitRegistry[Any]:
    # takes as long to build as a whole track run: only when a file has units, and once
    from pint import UnitRegistry

    return UnitRegistry(autoconvert_offset_to_baseunit=False)


def _no_quantity(value: object, unit: str, item: str) -> InvalidValueError:
    allowed = (
        f'a number in {unit}, or text with a unit that converts to it, such as "1.5 {unit}"' if unit else "a number"
    )
    return InvalidValueError(item, reprlib.repr(value), allowed, f"Correct {item}.")

"""Quantities, poses and wrenches as text: plain numbers in SI, or texts with a unit."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Sequence
from functools import cache, lru_cache
from math import isinf, isnan
from sys import float_info
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.arrays import FARTHEST, Array
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from pint import UnitRegistry

Nested = float | list["Nested"]

LARGEST: Final = 1e50  # largest number in SI; products of a few such numbers do not overflow
REACH: Final = f"numbers up to {LARGEST:g}"
QUATERNION_TOLERANCE: Final = 1e-3  # largest deviation of a quaternion's length from 1, because files have few decimals
_LONGEST: Final = 60  # largest number of characters of a number with its unit; a float64 needs 24

_DECIMAL = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_WORD = r"[-+]?\.?(?:inf|Inf|INF)|\.?(?:nan|NaN|NAN)"  # words for infinite numbers and NaN in YAML and Python
_FACTOR = r"[A-Za-zµμΩÅ°_]+(?:[ \t]?(?:\^|\*\*)[ \t]?[-+]?[0-9]|[²³])?"  # no parentheses, because pint fails for some
_UNIT = rf"{_FACTOR}(?:(?:[ \t]?[*/·][ \t]?|[ \t]){_FACTOR}){{0,5}}"
_BLANKS = re.compile("[ \t\r\n\u00a0\u202f]+")  # the last two are no-break spaces, which programs write before units
_TORQUE = re.compile(r"\b([cmkM]?N)m\b(?![ \t]?(?:\^|\*\*))")  # Nm is read as N m; Nm^2 and Nms are ambiguous
_PLAIN = re.compile(rf"[ \t]*(?:({_DECIMAL})|{_WORD})[ \t]*")
_WITH_UNIT = re.compile(rf"[ \t]*({_DECIMAL})([ \t]+1[ \t]?/[ \t]?{_UNIT}|[ \t]*{_UNIT})[ \t]*")


def plain_number(text: str) -> float | None:
    """Read a number from a decimal text: digits 0 to 9 with optional point, sign and exponent, or inf or nan."""
    # Other notations of YAML, Python or C are not accepted, for example 1:30, 0x10, 1_000 and digits of other
    # alphabets. None if the text is not a number. Only the word inf gives infinity; 1e999 gives the largest float64.
    found = _PLAIN.fullmatch(text) if len(text) <= _LONGEST else None
    if found is None:
        return None
    if found[1] is None:
        return float(text.replace(".", ""))
    return _limit(float(text))


def within_reach(number: float) -> bool:
    """True if a number is finite and so small that products of a few such numbers do not overflow."""
    return abs(number) <= LARGEST


def in_si(value: object, unit: str, item: str) -> Nested:
    """Convert a quantity, or nested lists of quantities, to numbers in the SI unit `unit`."""
    if isinstance(value, list | tuple):
        return [in_si(element, unit, f"{item}[{i}]") for i, element in enumerate(value)]
    number = _from_text(value, unit) if isinstance(value, str) else _from_number(value)
    if number is None or isnan(number):
        wanted = f'a number in {unit}, or text with a unit that converts to it, such as "1.5 {unit}"'
        raise InvalidValueError(item, reprlib.repr(value), wanted if unit else "a number", f"Correct {item}.")
    if not (isinf(number) or within_reach(number)):
        raise InvalidValueError(item, reprlib.repr(value), f"{REACH} {unit}".rstrip(), f"Correct {item}.")
    return number


def _from_number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return float_info.max


def _from_text(text: str, unit: str) -> float | None:
    text = _BLANKS.sub(" ", text).strip()
    number = plain_number(text)
    if number is not None or not unit or len(text) > _LONGEST:
        return number
    found = _WITH_UNIT.fullmatch(text)
    factor = _factor(found[2].strip(), unit) if found else None
    return None if found is None or factor is None else _limit(float(found[1]) * factor)


def _limit(number: float) -> float:
    """Convert to float64. A number beyond the range becomes the largest float64, not infinity."""
    return max(-float_info.max, min(number, float_info.max))


@lru_cache(maxsize=1000)
def _factor(given: str, wanted: str) -> float | None:
    """Factor that converts the unit `given` to the unit `wanted`; None if the units measure different quantities."""
    from pint.errors import PintError

    units = _registry()
    try:
        texts = (_TORQUE.sub(r"(\1*m)", given), wanted)
        one, wish = (units.Quantity(1.0, units.parse_units(text)) for text in texts)
        # root units are compared; otherwise pint, in which angles are dimensionless, would convert 5 Hz to 5 rad/s
        same = one.to_root_units().units == wish.to_root_units().units
        return float(one.to(wish.units).magnitude) if same else None
    except (PintError, ValueError, TypeError, AttributeError, SyntaxError, ArithmeticError):
        return None  # any error is caught, because pint's errors have no common base class


@cache
def _registry() -> UnitRegistry[Any]:
    # built once, and only for a file with units, because building it takes as long as a run of `sagline track`
    from pint import UnitRegistry

    return UnitRegistry(autoconvert_offset_to_baseunit=False)


STRONGEST: Final = 1e12  # largest force and moment [N, N m]: larger than on any machine, and far below overflow
POSE_STEP: Final = "Give meters, and degrees about z, y and x: --pose 1,0,1.5 or --pose 1,0,1.5,10,0,0."
WRENCH_STEP: Final = (
    "Give newtons, and newton meters about the center of mass: --wrench 0,0,-50 or --wrench 0,0,-50,0,5,0."
)


def decimal_numbers(parts: Sequence[str], item: str, unit: str, largest: float) -> list[float]:
    """Read plain decimal numbers from the texts `parts`."""
    found = []
    for part in parts:
        number = plain_number(part)
        if number is None or not abs(number) <= largest:  # the condition is True also for NaN
            raise InvalidValueError(item, repr(part), f"decimal numbers up to {largest:g} {unit}", f"Correct {item}.")
        found.append(number)
    return found


def pose_of_text(text: str, item: str = "--pose", step: str = POSE_STEP) -> Pose:
    """Read a pose from "X,Y,Z" in meters, or "X,Y,Z,A,B,C" with angles about z, y and x in degrees."""
    place = _three_or_six(text, item, "m or degrees", FARTHEST, step)
    return Pose.from_euler(place[:3], *np.radians(place[3:]))


def wrench_of_text(text: str | None, item: str = "--wrench", step: str = WRENCH_STEP) -> Array | None:
    """Read a wrench from "fx,fy,fz" in N or "fx,fy,fz,mx,my,mz" in N and N m; None if the text is None."""
    return None if text is None else np.array(_three_or_six(text, item, "N or N m", STRONGEST, step))


def _three_or_six(text: str, item: str, unit: str, largest: float, step: str) -> list[float]:
    """Read three or six numbers separated by commas. Three numbers are completed by three zeros."""
    parts = text.split(",", maxsplit=6)
    if len(parts) not in (3, 6):
        raise InvalidValueError(item, repr(text), "three or six numbers", step)
    whole = decimal_numbers(parts, item, unit, largest)
    return whole + [0.0] * (6 - len(whole))

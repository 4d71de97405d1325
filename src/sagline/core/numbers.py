"""Numbers as text, with unit prefixes instead of exponents, and without digits that are only rounding."""

from __future__ import annotations

import re
from math import floor, isfinite, log10
from typing import SupportsFloat

ROUNDING = 1e-12  # relative to the size of the operands; a smaller difference is a rounding error
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
POWERS = {prefix: power for power, prefix in PREFIXES.items()}
# unit -> power of ten of its largest usual prefix; other units use all prefixes
HIGHEST = {"m": 3, "g": 3, "s": 0, "rad": 0}
LONGEST_PLAIN = 1e7  # a number without a prefix that exceeds this limit is written with a power of ten
SPACE = "\N{NO-BREAK SPACE}"
TIGHT = ("", "°")  # units written without a space before them

# first unit of a product, with its prefix; powers of a unit get no prefix, because it would be hard to read
_scaled = re.compile(r"([pnµmkMG]?)(rad|Pa|m|g|s|N|J|W)(?![\w²³⁴⁻^])")
_superscript = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def n(
    value: SupportsFloat,
    form: str = ".4g",
    unit: str = "",
    *,
    uncertainty: SupportsFloat | None = None,
    size: SupportsFloat = 0.0,
) -> str:
    """Number with its unit, for display.

    A number from 0.1 to 1000 keeps the given unit. Any other number gets the prefix with which it is between 1 and
    1000, or a power of ten if no such prefix exists. The minus sign is U+2212. No line break is possible at the space
    before a unit.

    value: the number, in the unit; a number that is not finite is written as "–"; form: format of the digits, as in
    `format`; not used with an uncertainty; unit: its unit, such as "mm", "kg/m", "%"; "" if dimensionless; uncertainty:
    standard uncertainty in the unit, or None; its two digits are written in parentheses after the value: 43.98(10)
    means 43.98 ± 0.10; size: size of the operands if the value is a difference, in the unit; a value up to `ROUNDING`
    times the size is written as "0 (rounding)".

    Source:
        ISO 80000-1:2022, 7.2 (prefixes); JCGM 100:2008, 7.2.2 (uncertainty in parentheses).
    """
    number = float(value)
    if not isfinite(number):
        return "–"
    if number != 0.0 and abs(number) <= ROUNDING * abs(float(size)):
        return "0 (rounding)"
    error = None if uncertainty is None else float(uncertainty)
    if error is not None and not (isfinite(error) and error > 0.0):
        return f"{n(number, form, unit)}, uncertainty unknown"
    if error is None:
        power, symbol = prefixed_unit(number, form, unit)
        digits = _digits(number * 10.0**power, form)
    else:
        power, symbol = prefixed_unit(max(abs(number), error), ".15g", unit)
        digits = _with_uncertainty(number * 10.0**power, error * 10.0**power)
    return f"{digits}{'' if symbol in TIGHT else SPACE}{symbol}".replace(" ", SPACE)


def plus_minus(value: SupportsFloat, error: SupportsFloat, unit: str = "", *, prefixed: bool = True) -> str:
    """Number with its standard error, both rounded to two significant digits of the error: "512 ± 12 kN".

    error: in the unit; infinite or NaN if unknown; prefixed: False to write no unit, in a column of a table.
    """
    number, own = float(value), float(error)
    if not (isfinite(number) and isfinite(own) and own > 0.0):
        text = n(number, ".6g", unit if prefixed else "")
        return f"{text} ± 0" if own == 0.0 else f"{text}, not told"
    power, symbol = prefixed_unit(max(abs(number), own), ".15g", unit) if prefixed else (0, "")
    places = 1 - int(f"{own * 10.0**power:.1e}".partition("e")[2])
    both = (round(each * 10.0**power, places) for each in (number, own))
    digits = " ± ".join(_digits(each, f",.{max(places, 0)}f") for each in both)
    return f"{digits}{'' if symbol in TIGHT else SPACE}{symbol}".replace(" ", SPACE)


def counted(count: int, noun: str) -> str:
    """The number `count` with its noun, "1 pose" or "1,200 poses"; noun: in the singular."""
    return f"{count:,} {noun}{'' if count == 1 else 'es' if noun.endswith(('ch', 'x')) else 's'}"


def prefixed_unit(number: float, form: str, unit: str) -> tuple[int, str]:
    """Power of ten that converts a number into its most readable unit, and this unit."""
    found = _scaled.match(unit)
    if found is None or number == 0.0 or _reads_well(number, form, 0.1):
        return 0, unit
    prefix, base = found[1], found[2]
    highest = HIGHEST.get(base, max(PREFIXES))
    own = POWERS[prefix]
    power = 3 * floor((log10(abs(number)) + own) / 3.0)
    power = min(max(power, min(PREFIXES)), highest)
    if power < highest and not _reads_well(number * 10.0 ** (own - power), form, 0.0):
        power += 3  # rounded up to 1000
    return own - power, f"{PREFIXES[power]}{base}{unit[found.end() :]}"


def _reads_well(number: float, form: str, least: float) -> bool:
    return abs(number) >= least and abs(float(format(number, form).replace(",", ""))) < 1e3


def _digits(number: float, form: str) -> str:
    text = format(number, form)
    mantissa, _, exponent = text.partition("e")
    if exponent and abs(number) < LONGEST_PLAIN and int(exponent) > 0:
        mantissa, exponent = format(float(text.replace(",", "")), "+,.0f" if "+" in form else ",.0f"), ""
    if not any(digit in "123456789" for digit in mantissa):
        mantissa = mantissa.lstrip("+-")  # a zero does not have a sign
    mantissa = mantissa.replace("-", "−")
    return f"{mantissa}{SPACE}×{SPACE}10{str(int(exponent)).translate(_superscript)}" if exponent else mantissa


def _with_uncertainty(number: float, error: float) -> str:
    """`number`, rounded to the last of two digits of its uncertainty `error`, then the uncertainty."""
    places = 1 - int(f"{error:.1e}".partition("e")[2])
    if places <= 0:
        shown = f"({round(error, places):.0f})"
    elif f"{error:.{places}f}".startswith("0"):
        shown = "(" + f"{error:.{places}f}".lstrip("0.") + ")"
    else:
        shown = f"({error:.{places}f})"  # the uncertainty is 1 or more, so its decimal point is written
    return _digits(round(number, places), f",.{max(places, 0)}f") + shown

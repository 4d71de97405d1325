"""Numbers as text, with unit prefixes in place of exponents, and without digits that are only rounding errors."""

from __future__ import annotations

import re
from math import floor, isfinite, log10
from typing import SupportsFloat

ROUNDING = 1e-12  # a difference is a rounding error if it is below this share of its operands
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
POWERS = {prefix: power for power, prefix in PREFIXES.items()}
# unit: power of ten of its largest usual prefix; a unit that is not listed uses all prefixes
HIGHEST = {"m": 3, "g": 3, "s": 0, "rad": 0}
LONGEST_PLAIN = 1e7  # a larger number without a prefix is written with a power of ten
SPACE = "\N{NO-BREAK SPACE}"
TIGHT = ("", "°")  # units that are written without a space before them

# Prefix and first unit of a product. A power of a unit gets no prefix, because it would be hard to read.
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
    """Text of a number with its unit."""
    # A number from 0.1 to 1000 keeps the unit. Any other number gets a prefix that makes it a number between 1 and
    # 1000, or a power of ten if no such prefix exists. The minus sign is U+2212. The space before a unit is a no-break
    # space. The argument `form` is a format of the digits, as in the function `format`. `unit` is a text such as "mm",
    # "kg/m" or "%", or "" for a dimensionless number. Two digits of the standard `uncertainty` are written in
    # parentheses: 43.98(10) means 43.98 ± 0.10. If the value is a difference, `size` is the size of its operands; a
    # value up to `ROUNDING` times `size` is written as "0 (rounding)". A number that is not finite is written as "–".
    # Source: ISO 80000-1:2022, 7.2 (prefixes); JCGM 100:2008, 7.2.2 (uncertainty in parentheses).
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
    """Text of a number with its standard error, rounded to two significant digits of the error: "512 ± 12 kN"."""
    # error: standard error in the unit, infinite or NaN if unknown; prefixed: False to omit the unit, as in a table.
    number, own = float(value), float(error)
    if not (isfinite(number) and isfinite(own) and own > 0.0):
        text = n(number, ".6g", unit if prefixed else "")
        return f"{text} ± 0" if own == 0.0 else f"{text} ± unknown"
    power, symbol = prefixed_unit(max(abs(number), own), ".15g", unit) if prefixed else (0, "")
    places = 1 - int(f"{own * 10.0**power:.1e}".partition("e")[2])
    both = (round(each * 10.0**power, places) for each in (number, own))
    digits = " ± ".join(_digits(each, f",.{max(places, 0)}f") for each in both)
    return f"{digits}{'' if symbol in TIGHT else SPACE}{symbol}".replace(" ", SPACE)


def counted(count: int, noun: str) -> str:
    """Text of a number with a noun, such as "1 pose" or "1,200 poses"; noun: the singular."""
    return f"{count:,} {noun}{'' if count == 1 else 'es' if noun.endswith(('ch', 'x')) else 's'}"


def prefixed_unit(number: float, form: str, unit: str) -> tuple[int, str]:
    """Unit with the most readable prefix for `number`, and power of ten by which the number is multiplied."""
    found = _scaled.match(unit)
    if found is None or number == 0.0 or _reads_well(number, form, 0.1):
        return 0, unit
    prefix, base = found[1], found[2]
    highest = HIGHEST.get(base, max(PREFIXES))
    own = POWERS[prefix]
    power = 3 * floor((log10(abs(number)) + own) / 3.0)
    power = min(max(power, min(PREFIXES)), highest)
    if power < highest and not _reads_well(number * 10.0 ** (own - power), form, 0.0):
        power += 3  # rounding has given 1000
    return own - power, f"{PREFIXES[power]}{base}{unit[found.end() :]}"


def _reads_well(number: float, form: str, least: float) -> bool:
    return abs(number) >= least and abs(float(format(number, form).replace(",", ""))) < 1e3


def _digits(number: float, form: str) -> str:
    text = format(number, form)
    mantissa, _, exponent = text.partition("e")
    if exponent and abs(number) < LONGEST_PLAIN and int(exponent) > 0:
        mantissa, exponent = format(float(text.replace(",", "")), "+,.0f" if "+" in form else ",.0f"), ""
    if not any(digit in "123456789" for digit in mantissa):
        mantissa = mantissa.lstrip("+-")  # zero is written without a sign
    mantissa = mantissa.replace("-", "−")
    return f"{mantissa}{SPACE}×{SPACE}10{str(int(exponent)).translate(_superscript)}" if exponent else mantissa


def _with_uncertainty(number: float, error: float) -> str:
    """Text of a number with its uncertainty in parentheses, both rounded to two digits of the uncertainty `error`."""
    places = 1 - int(f"{error:.1e}".partition("e")[2])
    if places <= 0:
        shown = f"({round(error, places):.0f})"
    elif f"{error:.{places}f}".startswith("0"):
        shown = "(" + f"{error:.{places}f}".lstrip("0.") + ")"
    else:
        shown = f"({error:.{places}f})"  # an uncertainty of 1 or more is written with its decimal point
    return _digits(round(number, places), f",.{max(places, 0)}f") + shown

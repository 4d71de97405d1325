"""Numbers as text: prefixes of units instead of exponents, and no digits that are rounding errors."""

from __future__ import annotations

import re
from math import floor, isfinite, log10
from typing import SupportsFloat

ROUNDING = 1e-12  # of the size of what a number is the difference of: what is smaller is rounding
PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
POWERS = {prefix: power for power, prefix in PREFIXES.items()}
HIGHEST = {"m": 3, "g": 3, "s": 0, "rad": 0}  # largest usual prefix; of other units all
LONGEST_PLAIN = 1e7  # from here on a number without a prefix is written with a power of ten
SPACE = "\N{NO-BREAK SPACE}"
TIGHT = ("", "°")  # units that stand close

# the first unit of a product, with its prefix; one that is raised to a power has no prefix that reads well
_scaled = re.compile(r"([fpnµmkMG]?)(rad|Pa|m|g|s|N|J|W)(?![\w²³⁴⁻^])")
_superscript = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def n(
    value: SupportsFloat,
    form: str = ".4g",
    unit: str = "",
    *,
    uncertainty: SupportsFloat | None = None,
    size: SupportsFloat = 0.0,
) -> str:
    """A number for a reader, with its unit.

    From 0.1 to 1000 it stays in the unit it is given in; beyond that the unit takes the prefix with which it is between
    1 and 1000, and where there is none a power of ten is written out. A minus is a true one, a space before a unit
    does not break.

    value: the number, in the unit; "–" where it is not finite; form: how its digits are formatted, as in
    `format`; not used with an uncertainty; unit: its unit, such as "mm", "kg/m", "%"; "" for none; uncertainty:
    standard uncertainty, in the unit, written behind the last digits of the value to two digits: 43.98(10) is 43.98 ±
    0.10. None for none; size: of what the value is a difference, in the unit: a value that is `ROUNDING` of it is "0
    (rounding)".

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
        power, symbol = _prefixed(number, form, unit)
        digits = _digits(number * 10.0**power, form)
    else:
        power, symbol = _prefixed(max(abs(number), error), ".15g", unit)
        digits = _with_uncertainty(number * 10.0**power, error * 10.0**power)
    return f"{digits}{'' if symbol in TIGHT else SPACE}{symbol}".replace(" ", SPACE)


def plus_minus(value: SupportsFloat, error: SupportsFloat, unit: str = "", *, prefixed: bool = True) -> str:
    """A number with its standard error, both to the two digits of the error that count: "512 ± 12 kN".

    error: its standard error, in the unit; not finite: unknown; prefixed: whether
    the unit takes the prefix it reads best with; in a column of a table none does.
    """
    number, own = float(value), float(error)
    if not (isfinite(number) and isfinite(own) and own > 0.0):
        text = n(number, ".6g", unit if prefixed else "")
        return f"{text} ± 0" if own == 0.0 else f"{text}, not told"
    power, symbol = _prefixed(max(abs(number), own), ".15g", unit) if prefixed else (0, "")
    places = 1 - int(f"{own * 10.0**power:.1e}".partition("e")[2])
    both = (round(each * 10.0**power, places) for each in (number, own))
    digits = " ± ".join(_digits(each, f",.{max(places, 0)}f") for each in both)
    return f"{digits}{'' if symbol in TIGHT else SPACE}{symbol}".replace(" ", SPACE)


def counted(count: int, noun: str) -> str:
    """A number of things, "1 pose" or "1,200 poses".

    noun: one of them; several have an s, or es.
    """
    return f"{count:,} {noun}{'' if count == 1 else 'es' if noun.endswith(('ch', 'x')) else 's'}"


def _prefixed(number: float, form: str, unit: str) -> tuple[int, str]:
    """The power of ten that takes a number into the unit it reads best in, and that unit."""
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
        mantissa = mantissa.lstrip("+-")  # no zero has a sign
    mantissa = mantissa.replace("-", "−")
    return f"{mantissa}{SPACE}×{SPACE}10{str(int(exponent)).translate(_superscript)}" if exponent else mantissa


def _with_uncertainty(number: float, error: float) -> str:
    """The value to the last digit of an uncertainty of two digits, and that uncertainty."""
    places = 1 - int(f"{error:.1e}".partition("e")[2])
    if places <= 0:
        shown = f"({round(error, places):.0f})"
    elif f"{error:.{places}f}".startswith("0"):
        shown = "(" + f"{error:.{places}f}".lstrip("0.") + ")"
    else:
        shown = f"({error:.{places}f})"  # it reaches over the decimal point, which is then written
    return _digits(round(number, places), f",.{max(places, 0)}f") + shown

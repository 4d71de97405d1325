"""Printed numbers, parsed by another program: the text is the number rounded to the printed digits."""

import re
from decimal import Decimal

import numpy as np
import pytest

from sagline.core.numbers import n, plus_minus

PREFIX = {"p": -12, "n": -9, "µ": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
UNITS = ("m", "mm", "N", "kN", "kg", "kg/m", "N m", "m/s²", "rad", "s", "N/s", "mm/m", "m²/s⁴", "%", "°", "")
FORMS = (".4g", ".2g", ".3g", ".1f", "+.3g", ",.2f")
TEXT = re.compile(r"([+−]?)([\d,]+(?:\.\d+)?)(?:\u00a0×\u00a010([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?(?:\u00a0(?=\S))?(\S.*)?")
POWER = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def read(text: str, unit: str) -> tuple[Decimal, Decimal, Decimal]:
    """Value in the unit, half a unit of its last digit, and the printed mantissa."""
    found = TEXT.fullmatch(text)
    assert found is not None, text
    sign, digits, power, shown = found.groups()
    mantissa = Decimal(digits.replace(",", ""))
    exponent = int(power.translate(POWER)) if power else 0
    exponent += shift((shown or "").replace("\u00a0", " "), unit)
    last = Decimal(1).scaleb(-len(digits.partition(".")[2]))
    scale = Decimal(1).scaleb(exponent)
    return (-1 if sign == "−" else 1) * mantissa * scale, last / 2 * scale, mantissa


def shift(shown: str, unit: str) -> int:
    """Power of ten from the printed unit to the given unit."""
    if shown == unit:
        return 0
    own, base = (
        ("k", unit[1:]) if unit.startswith(("kg", "kN")) else (unit[0], unit[1:]) if unit[:2] == "mm" else ("", unit)
    )
    prefix = shown.removesuffix(base)
    assert prefix in PREFIX, (shown, unit)
    return PREFIX[prefix] - PREFIX[own]


def cases(count: int) -> list[tuple[float, str, str]]:
    random = np.random.default_rng(20)
    size = 10.0 ** random.uniform(-14.0, 11.0, count)
    value = random.choice([-1.0, 1.0], count) * size
    edges = (0.0999999, 0.1, 0.99999, 1.0, 999.4, 999.6, 999.96, 1000.0, 1e-3, 9.9999e-4, 1e6, 999_999.9, 1e7)
    forms, units = random.choice(FORMS, count), random.choice(UNITS, count)
    return [*zip(value.tolist(), forms.tolist(), units.tolist(), strict=True)] + [
        (edge, form, unit) for edge in edges for form in FORMS for unit in UNITS
    ]


def check(value: float, form: str, unit: str) -> None:
    text = n(value, form, unit)
    assert not re.search(r"\de|[-]| {1}", text), text  # no exponents, hyphens or breaking spaces
    found, half, mantissa = read(text, unit)
    rounded = form.endswith("g") and found != 0  # trailing zeros of n significant digits may be omitted
    digits = int(re.findall(r"\.(\d)", form)[0])
    slack = max(half, abs(found) * Decimal(10) ** (1 - digits) / 2) if rounded else half
    assert abs(found - Decimal(value)) <= slack * Decimal("1.0001"), (value, text)
    power_free = unit in ("m²/s⁴", "%", "°", "")
    smallest, largest = 1e-9, 1e2 if unit in ("rad", "s", "kg", "kg/m") else 1e5
    if not power_free and rounded and smallest < abs(value) < largest:
        assert Decimal("0.1") <= mantissa < 1000, (value, text)


def test_the_printed_text_is_the_number() -> None:
    for case in cases(2000):
        check(*case)


@pytest.mark.soak
def test_the_printed_text_is_the_number_for_any_number() -> None:
    for case in cases(100_000):
        check(*case)


@pytest.mark.parametrize(
    ("value", "form", "unit", "text"),
    [
        (43980.0, ".4g", "N", "43.98 kN"),
        (0.067, ".4g", "kg/m", "67 g/m"),
        (9.8963e-5, "+.2g", "mm", "+99 nm"),
        (0.51, ".2g", "mm", "0.51 mm"),
        (150.0, ".3g", "N", "150 N"),
        (999.96, ".3g", "N", "1 kN"),
        (5000.0, ".4g", "kg", "5000 kg"),
        (7200.0, ".4g", "s", "7200 s"),
        (2e-3, ".3g", "m²", "0.002 m²"),
        (12345.6, ".4g", "", "12,350"),
        (3.8715e7, ".5g", "", "3.8715 × 10⁷"),
        (-1e-6, ".2g", "", "−1 × 10⁻⁶"),
        (-0.001, ".2f", "", "0.00"),
        (30.0, ".4g", "°", "30°"),
        (float("nan"), ".3g", "N", "–"),
        (float("inf"), ".3g", "N", "–"),
        (0.0, "+.3g", "mm", "0 mm"),
    ],
)
def test_numbers_by_hand(value: float, form: str, unit: str, text: str) -> None:
    assert n(value, form, unit).replace("\u00a0", " ") == text


@pytest.mark.parametrize(
    ("value", "uncertainty", "unit", "text"),
    [
        (4.398e4, 1.04e2, "N", "43.98(10) kN"),
        (0.06652, 0.00032, "kg/m", "66.52(32) g/m"),
        (4.706e4, 2.8e3, "N", "47.1(2.8) kN"),
        (-0.4304e-3, 0.28e-3, "m", "−430(280) µm"),
        (9.81, 0.0996, "m/s²", "9.81(10) m/s²"),
        (470.0, 25.0, "", "470(25)"),
        (999.99, 0.02, "N", "999.990(20) N"),
        (0.0, 0.3, "m", "0.00(30) m"),
        (2.0, float("inf"), "N", "2 N, uncertainty unknown"),
    ],
)
def test_uncertainties_by_hand(value: float, uncertainty: float, unit: str, text: str) -> None:
    """Two digits of the uncertainty after the digits of the value, as 100.021 47(35) in JCGM 100:2008, 7.2.2."""
    assert n(value, unit=unit, uncertainty=uncertainty).replace("\u00a0", " ") == text


def test_printed_uncertainties_are_parsed_exactly() -> None:
    random = np.random.default_rng(7)
    for value, ratio in zip(10.0 ** random.uniform(-9, 6, 500), 10.0 ** random.uniform(-6, 1.5, 500), strict=True):
        error = value * ratio
        found = re.fullmatch(r"([\d,.]+)\(([\d.]+)\)\u00a0(\S+)", n(value, unit="N", uncertainty=error))
        assert found is not None
        digits, bracket = found[1].replace(",", ""), found[2]
        scale, places = 10.0 ** PREFIX[found[3].removesuffix("N")], len(digits.partition(".")[2])
        told = float(bracket) * (1.0 if "." in bracket or not places else 10.0**-places) * scale
        assert told == pytest.approx(error, rel=0.0501)
        assert float(digits) * scale == pytest.approx(value, abs=0.051 * error)


def test_values_of_rounding_are_printed_as_rounding() -> None:
    assert n(-7.1054e-15, ".5g", "N", size=490.5) == "0 (rounding)"
    assert n(4.2e-11, ".3g", "mm", size=16e3) == "0 (rounding)"
    assert n(1e-6, ".3g", "N", size=490.5) == "1\u00a0µN"  # small, and not caused by rounding
    assert n(0.0, ".3g", "N", size=490.5) == "0\u00a0N"  # exactly


@pytest.mark.parametrize(
    ("value", "error", "unit", "text"),
    [
        (511_880.0, 12_300.0, "N", "512 ± 12 kN"),
        (-7.17611, 0.00123, "m", "−7.1761 ± 0.0012 m"),
        (0.0123, 0.00096, "m", "12.30 ± 0.96 mm"),
        (0.0004, 0.0196, "m", "0 ± 20 mm"),
        (1.0, 0.0995, "", "1.00 ± 0.10"),  # 0.0995 is printed as 0.10 with two digits
        (1.0, 3456.0, "s", "0 ± 3,500 s"),
        (5.0, float("inf"), "kg", "5 kg ± unknown"),
        (5.0, 0.0, "kg", "5 kg ± 0"),
    ],
)
def test_a_number_with_its_error_is_rounded_to_the_error(value: float, error: float, unit: str, text: str) -> None:
    assert plus_minus(value, error, unit) == text.replace(" ", "\u00a0") or (
        plus_minus(value, error, unit).replace("\u00a0", " ") == text
    )


def test_numbers_of_a_column_have_no_prefix() -> None:
    assert plus_minus(0.0123, 0.00096, prefixed=False) == "0.01230\u00a0±\u00a00.00096"

import subprocess
import sys
from math import inf, isinf, isnan

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from sagline import InvalidValueError
from sagline.files.quantity import in_si, plain_number, within_reach
from tests.effort import least_seconds
from tests.refusal import refused
from tests.tiers import extended


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (5, "m", 5.0),
        ("44e3", "N", 44e3),  # YAML 1.1 reads this as text
        ("22 mm^2", "m^2", 22e-6),
        ("22 mm²", "m^2", 22e-6),
        ("2 GPa", "Pa", 2e9),
        ("67 g/m", "kg/m", 0.067),
        ("67\u00a0g/m", "kg/m", 0.067),
        ("67\n g/m\n", "kg/m", 0.067),
        ("0.067 kg/m", "kg/m", 0.067),
        ("3 kg m^2", "kg*m^2", 3.0),
        ("-1.5e2 cm", "m", -1.5),
        ("1 ft", "m", 0.3048),
        ("1001 1/s", "1/s", 1001.0),
        ("100 Hz", "1/s", 100.0),
        ("5 N*m/m", "N", 5.0),
        ("1 lbf", "N", 4.4482216152605),
        ("20 Nm", "N m", 20.0),
        ("20Nm", "N*m", 20.0),
        ("2 cNm", "N m", 0.02),
        ("0.5 kNm", "N m", 500.0),
        ("3 Nm/rad", "N m/rad", 3.0),
        ("2 1/Nm", "1/(N*m)", 2.0),  # the whole text below the line
        ("5 nm", "m", 5e-9),
        ("180 deg", "rad", 3.141592653589793),
        ("980.665 cm/s^2", "m/s^2", 9.80665),
        (float("inf"), "N", float("inf")),
    ],
)
def test_quantities_in_si(value: object, unit: str, expected: ArrayLike) -> None:
    assert in_si(value, unit, "x") == pytest.approx(expected, rel=1e-15)


def test_nested_lists_keep_their_structure() -> None:
    assert in_si([[1, "1 mm"], ["2 km"]], "m", "x") == [[1.0, 0.001], [2000.0]]


@given(st.floats(allow_nan=False).filter(lambda number: within_reach(number) or isinf(number)))
def test_plain_numbers_are_unchanged(number: float) -> None:
    assert in_si(number, "kg", "x") == number
    assert in_si(repr(number), "kg", "x") == number


@pytest.mark.parametrize(
    ("value", "unit", "parts"),
    [
        ("5 kg", "m", ("x", "'5 kg'", 'a number in m, or text with a unit that converts to it, such as "1.5 m"')),
        ("5 kg", "N", ("x", "'5 kg'")),
        ("5 furlongz", "m", ("x", "'5 furlongz'")),
        ("5 %%", "m", ("x", "'5 %%'")),
        ("1001/s", "1/s", ("x", "'1001/s'")),
        ("5 m)", "m", ("x", "'5 m)'")),
        ("5 m", "", ("x", "'5 m'", "a number")),
        ("long", "m", ("x", "'long'")),
        ("", "m", ("x", "''")),
        ("nan", "m", ("x", "'nan'")),
        (float("nan"), "m", ("x", "nan")),
        (True, "m", ("x", "True")),
        (None, "m", ("x", "None")),
        ({"a": 1}, "m", ("x", "{'a': 1}")),
        (10**400, "m", ("x", "100000000000000000...0000000000000000000")),
        ([[1.0], [2.0, "3 s"]], "m", ("x[1][1]", "'3 s'")),
        ("5 __import__('os')", "m", ("x", "\"5 __import__('os')\"")),
    ],
)
def test_invalid_quantities_are_named(value: object, unit: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        in_si(value, unit, "x")


@pytest.mark.parametrize("value", [1e51, "1e51", "1e400", -1e60, "1e49 km", "-1e300 m"])
def test_numbers_out_of_range_are_refused(value: object) -> None:
    with refused("x", kind=InvalidValueError) as caught:
        in_si(value, "m", "x")
    assert caught.value.allowed
    assert within_reach(1e50)
    assert within_reach(-5e-324)
    assert not within_reach(inf)
    assert not within_reach(float("nan"))


@pytest.mark.parametrize(
    ("text", "number"),
    [
        (" 010 ", 10.0),
        ("+1.5e-3", 1.5e-3),
        ("5.", 5.0),
        (".5", 0.5),
        ("-0", 0.0),
        ("inf", inf),
        ("-.inf", -inf),
        ("1e999", 1.7976931348623157e308),
    ],
)
def test_plain_numbers(text: str, number: float) -> None:
    assert plain_number(text) == number


@pytest.mark.parametrize(
    "text",
    ["", " ", "1:30", "1_0", "0x10", "0b1", "1e", "e1", ".", "+", "1 0", "1,5", "٣", "１", "²", "1+1j", "infinity",
     "INF.", "1e1e1", "--1", "1d3", "9" * 61],
)  # fmt: skip
def test_other_values_than_plain_numbers(text: str) -> None:
    assert plain_number(text) is None
    with pytest.raises(InvalidValueError):
        in_si(text, "m", "x")


def test_nan_is_refused() -> None:
    assert isnan(plain_number(".nan") or 0.0)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("5 Hz", "rad/s"),  # pint reads both as 1/s
        ("5 rad/s", "1/s"),
        ("5 rpm", "1/s"),
        ("0.5 rad", ""),
        ("5 N*m/rad", "N*m"),
        ("12 kg/m*", "kg/m"),
        ("5 m**9**9**9", "m"),
        ("5 m^10", "m"),
        ("5 m^-", "m"),
        ("5 /s", "1/s"),
        ("5 m*m*m*m*m*m*m*m/m*m*m*m*m*m*m", "m"),
        ("5 " + "m*" * 3000 + "m/m" * 3000, "m"),
        ("5 " + "a" * 50_000, "m"),
        ("5 m\n", "kg"),
        ("5 degC", "m"),
        ("5 dB", "N"),
        ("5 nm", "N m"),
        ("5 NM", "N m"),
        ("5 Nm", "m"),
        ("5 Nms", "N m"),  # seconds, or a multiple of Nm
        ("5 Nms", "N m s"),
        ("5 Nm^2", "N m^2"),
        ("5 Nm²", "N m^2"),
    ],
)
def test_invalid_units_are_reported_at_once(text: str, unit: str) -> None:
    with refused("x", kind=InvalidValueError) as caught:
        in_si(text, unit, "x")
    assert least_seconds(lambda: in_si(text, unit, "x"), 1.0) < 1.0
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(("text", "value"), [("30 rpm", 3.141592653589793), ("0.5 turn/s", 3.141592653589793)])
def test_angles_are_a_dimension(text: str, value: float) -> None:
    assert in_si(text, "rad/s", "x") == pytest.approx(value, rel=1e-15)
    assert in_si("20°", "rad", "x") == pytest.approx(0.3490658503988659, rel=1e-15)


@extended
def test_plain_numbers_do_not_load_pint() -> None:
    code = """
import sys
from sagline.files.quantity import in_si

in_si([1, "2e3"], "m", "x")
print("pint" in sys.modules)
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "False\n"

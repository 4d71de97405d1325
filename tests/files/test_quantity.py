import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from sagline.errors import InvalidValueError
from sagline.files.quantity import in_si


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (5, "m", 5.0),
        ("44e3", "N", 44e3),  # YAML 1.1 reads this as text
        ("22 mm^2", "m^2", 22e-6),
        ("22 mm²", "m^2", 22e-6),
        ("2 GPa", "Pa", 2e9),
        ("67 g/m", "kg/m", 0.067),
        ("0.067 kg/m", "kg/m", 0.067),
        ("3 kg m^2", "kg*m^2", 3.0),
        ("-1.5e2 cm", "m", -1.5),
        ("1 ft", "m", 0.3048),
        ("1001 1/s", "1/s", 1001.0),
        ("100 Hz", "1/s", 100.0),
        ("5 N*m/m", "N", 5.0),
        ("1 lbf", "N", 4.4482216152605),
        ("180 deg", "rad", 3.141592653589793),
        ("980.665 cm/s^2", "m/s^2", 9.80665),
        (float("inf"), "N", float("inf")),
    ],
)
def test_quantities_in_si(value: object, unit: str, expected: ArrayLike) -> None:
    assert in_si(value, unit, "x") == pytest.approx(expected, rel=1e-15)


def test_lists_keep_their_nesting() -> None:
    assert in_si([[1, "1 mm"], ["2 km"]], "m", "x") == [[1.0, 0.001], [2000.0]]


@given(st.floats(-1e18, 1e18) | st.sampled_from([float("inf"), float("-inf")]))
def test_plain_numbers_pass_bit_for_bit(number: float) -> None:
    assert in_si(number, "kg", "x") == number
    assert in_si(repr(number), "kg", "x") == number


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("5 kg", "m", "x is '5 kg'; allowed: a number in m, or text with a unit that converts to it"),
        ("5 kg", "N", "x is '5 kg'"),
        ("5 furlongz", "m", "x is '5 furlongz'"),
        ("5 %%", "m", "x is '5 %%'"),
        ("1001/s", "1/s", "x is '1001/s'"),
        ("5 m)", "m", "x is "),
        ("5 m", "", "x is '5 m'; allowed: a number\\."),
        ("long", "m", "x is 'long'"),
        ("", "m", "x is ''"),
        ("nan", "m", "x is 'nan'"),
        (float("nan"), "m", "x is nan"),
        (True, "m", "x is True"),
        (None, "m", "x is None"),
        ({"a": 1}, "m", "x is {'a': 1}"),
        (10**400, "m", "x is 1000"),
        ([[1.0], [2.0, "3 s"]], "m", "x\\[1\\]\\[1\\] is '3 s'"),
        ("5 __import__('os')", "m", "x is "),
    ],
)
def test_what_is_no_quantity_is_named(value: object, unit: str, message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        in_si(value, unit, "x")


def test_plain_numbers_do_not_load_pint() -> None:
    code = """
import sys
from sagline.files.quantity import in_si

in_si([1, "2e3"], "m", "x")
print("pint" in sys.modules)
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "False\n"

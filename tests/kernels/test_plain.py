"""Kernels in plain Python: the numbers of compiled code where Python would raise an exception, and errors it shows."""

from __future__ import annotations

import math
import sys
import traceback
from typing import Any

import numpy as np
import pytest

from sagline.kernels.plain import plain

SCALE = 2.0


def entry(function: Any) -> Any:
    return function


def operations(a: Any, b: Any, out: Any) -> None:
    """All operators that `plain` replaces."""
    out[0] = a / b
    out[1] = a // b
    out[2] = a % b
    out[3] = b**-2
    out[4] = a
    out[4] /= b


def functions(x: float, out: Any) -> None:
    out[0] = math.sqrt(x)
    out[1] = math.log(x)
    out[2] = math.exp(-1e3 * x)
    out[3] = math.sinh(1e3 * x)
    out[4] = math.cosh(1e3 * x)
    out[5] = math.atanh(x)


def doubled(codes: Any) -> int:
    total = 0
    for code in codes:
        total += code + codes[0]
    return 2 * total


@entry
def scaled(value: float, pair: Any) -> Any:
    """Products of numbers, one of which may be of NumPy."""
    return SCALE * value * pair[0] * pair[1][0]


def outside(values: Any) -> Any:
    return values[0] + values[values.size]


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        (1.0, 0.0, [math.inf, math.inf, math.nan, math.inf, math.inf]),
        (1.0, -0.0, [-math.inf, -math.inf, math.nan, math.inf, -math.inf]),
        (-1e-300, 0.0, [-math.inf, -math.inf, math.nan, math.inf, -math.inf]),
        (0.0, 0.0, [math.nan, math.nan, math.nan, math.inf, math.nan]),
        (math.nan, 0.0, [math.nan, math.nan, math.nan, math.inf, math.nan]),
        (7, 0, [math.inf, 0.0, 0.0, math.inf, math.inf]),
        (-7, 2, [-3.5, -4.0, 1.0, 0.25, -3.5]),
        (1.5, 1e-200, [1.5e200, 1.5e200 // 1.0, 1.5 % 1e-200, math.inf, 1.5e200]),
    ],
)
def test_operators_give_the_numbers_of_compiled_code(a: float, b: float, expected: list[float]) -> None:
    out = np.zeros(5)
    plain(operations)(a, b, out)
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (-1.0, [math.nan, math.nan, math.inf, -math.inf, math.inf, -math.inf]),
        (0.0, [0.0, -math.inf, 1.0, 0.0, 1.0, 0.0]),
        (4.0, [2.0, math.log(4.0), 0.0, math.inf, math.inf, math.nan]),
    ],
)
def test_functions_give_the_numbers_of_compiled_code(x: float, expected: list[float]) -> None:
    out = np.zeros(6)
    plain(functions)(x, out)
    np.testing.assert_array_equal(out, expected)


def test_complex_numbers_divided_by_zero_are_nan() -> None:
    out = np.zeros(5, dtype=complex)
    plain(operations_of_complex)(1.0 + 2.0j, 0.0, out)
    assert np.isnan(out[0].real)
    assert np.isnan(out[0].imag)


def operations_of_complex(a: complex, b: float, out: Any) -> None:
    out[0] = a / b


def test_elements_of_arrays_are_integers_of_python() -> None:
    assert plain(doubled)(np.array([100, 100], dtype=np.int8)) == 800


def test_an_entry_takes_numbers_of_numpy_without_warnings() -> None:
    pair = (np.float64(1e200), (np.float64(1e200),))
    assert plain(scaled)(np.float64(1.0), pair) == math.inf


def test_a_plain_kernel_sees_the_names_of_its_module(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = plain(scaled)
    monkeypatch.setattr(sys.modules[__name__], "SCALE", 5.0)
    assert kernel(1.0, (1.0, (1.0,))) == 5.0
    assert kernel.__qualname__ == "scaled"
    assert "_number" not in globals()


def test_an_index_outside_raises_an_error_at_its_line() -> None:
    with pytest.raises(IndexError) as error:
        plain(outside)(np.zeros(3))
    last = traceback.extract_tb(error.tb)[-1]
    assert last.filename == __file__
    assert "values[values.size]" in str(last.line)

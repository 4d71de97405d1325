"""Checks of the arrays that a caller gives."""

from __future__ import annotations

import numpy as np
import pytest

from sagline import InvalidValueError
from sagline.core.arrays import checked, kernel_input, locked, number
from tests.refusal import refused


def test_a_callers_array_is_copied_and_locked() -> None:
    given = np.arange(3.0)
    array = checked(given, "x", "m")
    given[0] = 9.0
    assert array[0] == 0.0
    assert not array.flags.writeable


def test_an_immutable_array_is_not_copied() -> None:
    ours = locked(np.arange(3.0))
    assert checked(ours, "x", "m") is ours
    assert checked(ours[1:], "x", "m").base is ours


def test_a_locked_view_of_writable_memory_is_copied() -> None:
    memory = np.arange(3.0)
    view = locked(memory.view())
    array = checked(view, "x", "m")
    memory[0] = 9.0
    assert array[0] == 0.0


def test_a_locked_array_over_foreign_memory_is_copied() -> None:
    memory = bytearray(np.arange(3.0).tobytes())
    array = checked(locked(np.frombuffer(memory)), "x", "m")
    memory[:8] = np.float64(9.0).tobytes()
    assert array[0] == 0.0


@pytest.mark.parametrize("value", [[1.0, 2.0], 3, np.float32(1.5), np.arange(6.0).reshape(2, 3).T, [[1, 2]], True])
def test_all_numbers_become_float64_in_c_order(value: object) -> None:
    array = checked(value, "x", "m")  # type: ignore[arg-type]
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    np.testing.assert_array_equal(array, np.asarray(value))


def test_kernel_input_keeps_the_shape_of_a_single_value() -> None:
    assert kernel_input(3.0, ()).shape == ()
    wide = kernel_input(np.arange(2.0), (3, 2))
    assert wide.flags.c_contiguous
    assert not wide.flags.writeable
    np.testing.assert_array_equal(wide, [[0, 1]] * 3)


@pytest.mark.parametrize(
    ("value", "limits", "parts"),
    [
        ([1.0, np.nan], {}, ("x[1]", "nan m", "finite")),
        ([1.0, np.inf], {}, ("x[1]", "inf m", "finite")),
        (-np.inf, {"infinite": True, "low": 0.0}, ("x", "-inf m", ">= 0 m")),
        ([[0.0, -1.0]], {"low": 0.0}, ("x[0, 1]", "-1 m", ">= 0 m, finite")),
        (0.0, {"above": 0.0}, ("x", "0 m", "> 0 m, finite")),
        ([1.0, 2.0], {"shape": (3,)}, ("x", "of shape (2,)", "shape (..., 3)")),
        ("near", {}, ("x", "'near'", "numbers")),
    ],
)
def test_invalid_arrays_are_named(value: object, limits: dict[str, object], parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        checked(value, "x", "m", **limits)  # type: ignore[arg-type]


def test_infinity_is_accepted_as_no_limit() -> None:
    assert checked(np.inf, "x", "m", infinite=True) == np.inf


@pytest.mark.parametrize(
    ("value", "parts"),
    [
        ([1.0 + 2.0j], ("x", "complex: (1+2j)", "numbers, not complex")),
        (np.array([1.0 + 0.0j]), ("x", "complex: (1+0j)", "numbers, not complex")),
        (["1.5"], ("x", "'1.5'", "numbers")),
        ([None, 1.0], ("x", "None", "numbers")),
        ([[1.0], [1.0, 2.0]], ("x", "[[1.0], [1.0, 2.0]]", "numbers")),
        (np.array(["2020-01-01"], dtype="datetime64[D]"), ("x", "dates: datetime.date(2020, 1, 1)")),
        (np.ma.MaskedArray([1.0, 2.0], mask=[False, True]), ("x[1]", "masked", "a number")),
        (10**400, ("x", "100000000000000000...0000000000000000000", "numbers")),
        (1e60, ("x", "1e+60 m", "up to 1e+50 m, of either sign, finite")),
        (np.broadcast_to(1.0, 10**13), ("the memory for x", "8e+04 GB")),
    ],
)
def test_values_that_are_not_plain_numbers_are_refused(value: object, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        checked(value, "x", "m")  # type: ignore[arg-type]


class InMillimeters:
    units = "mm"

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        return np.array([1.0])


def test_an_array_with_a_unit_is_accepted_only_with_the_expected_unit() -> None:
    with refused("x", allowed="numbers in m", kind=InvalidValueError):
        checked(InMillimeters(), "x", "m")
    np.testing.assert_array_equal(checked(InMillimeters(), "x", "mm"), [1.0])


def test_a_divisor_is_not_nearly_zero() -> None:
    with refused("mass", "1e-60 kg", "> 0 kg, 1e-50 to 1e+50 kg, finite", kind=InvalidValueError):
        number(1e-60, "mass", "kg", above=0.0)
    assert number(1e-60, "force", "N", low=0.0) == 1e-60


def test_nan_is_accepted_for_missing_numbers() -> None:
    np.testing.assert_array_equal(checked([1.0, np.nan], "x", "m", missing=True), [1.0, np.nan])
    with refused("x[1]", "inf m", "finite", kind=InvalidValueError):
        checked([np.nan, np.inf], "x", "m", missing=True)

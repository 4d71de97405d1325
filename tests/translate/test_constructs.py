"""Each construct of the subset gives the same numbers in Python and in C."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tiers import extended
from tests.translate import constructs
from tests.translate.library import Entry, compiled_c
from tools.translate.program import translate
from tools.translate.types import ArrayType, Element, Scalar

pytestmark = extended
ARRAY = ArrayType(Element.FLOAT, 1)
TYPES = (Scalar.FLOAT, Scalar.FLOAT, Scalar.INT, Scalar.INT, ARRAY)
SIZE = 20
NUMBERS = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.5, -7.0, 1e-300, 1e300, math.nan, math.inf, -math.inf]),
    st.floats(-100.0, 100.0),
)
INTEGERS = st.integers(-30, 30)
Kernel = Callable[..., None]
UNITS = {constructs.operators: 1, constructs.functions: 2}  # units of the last place: NumPy's power, and its functions


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    kernels = (*constructs.KERNELS, constructs.remainders, constructs.whole_divisions)
    text = translate([(kernel, TYPES, kernel.__name__) for kernel in kernels])
    assert text == translate([(kernel, TYPES, kernel.__name__) for kernel in kernels])
    return compiled_c(text, tmp_path_factory.mktemp("c"), "-O2", "-DSL_CHECK", "-fsanitize=undefined")


def results(kernel: Kernel, entry: Entry, *numbers: Any) -> tuple[list[float], list[float]]:
    """What Python and C write."""
    with np.errstate(all="ignore"):
        expected, found = np.zeros(SIZE), np.zeros(SIZE)
        kernel(*(np.float64(each) if isinstance(each, float) else each for each in numbers), expected)
    entry(*numbers, found)
    return expected.tolist(), found.tolist()


def assert_equal(expected: list[float], found: list[float], units: int) -> None:
    """Equal with the sign of zero, or within so many units of the last place."""
    for k, (one, other) in enumerate(zip(expected, found, strict=True)):
        if math.isnan(one) or one == 0.0 or math.isinf(one):
            assert str(one) == str(other) or (math.isnan(one) and math.isnan(other)), k
        else:
            assert abs(one - other) <= units * math.ulp(one), k


@pytest.mark.parametrize("kernel", constructs.KERNELS, ids=lambda each: each.__name__)
@settings(max_examples=300, deadline=None, derandomize=True)
@given(x=NUMBERS, y=NUMBERS, i=INTEGERS, j=INTEGERS)
def test_python_and_c_give_the_same_numbers(library: Any, kernel: Kernel, x: float, y: float, i: int, j: int) -> None:
    entry = Entry(library, kernel.__name__, TYPES)
    assert_equal(*results(kernel, entry, x, y, i, j), UNITS.get(kernel, 0))


@settings(max_examples=500, deadline=None, derandomize=True)
@given(x=NUMBERS, y=NUMBERS.filter(lambda each: each != 0.0))
def test_remainders_of_floats_have_the_sign_of_the_divisor(library: Any, x: float, y: float) -> None:
    entry, found = Entry(library, "remainders", TYPES), np.zeros(SIZE)
    entry(x, y, 0, 0, found)
    expected = [x % y, x // y] if math.isfinite(x) else [math.nan, math.nan]
    assert_equal(expected, found[:2].tolist(), units=0)


def test_integers_divided_by_zero_give_what_numba_gives(library: Any) -> None:
    entry, by_numba = (
        Entry(library, "whole_divisions", TYPES),
        numba.njit(error_model="numpy")(constructs.whole_divisions),
    )
    for i in (-7, 0, 7):
        for j in (-3, -1, 0, 2):
            expected, found = np.zeros(SIZE), np.zeros(SIZE)
            by_numba(0.0, 0.0, i, j, expected)
            entry(0.0, 0.0, i, j, found)
            assert_equal(expected.tolist(), found.tolist(), units=0)


def test_an_array_that_is_too_small_ends_the_entry_with_a_code(library: Any) -> None:
    entry = Entry(library, "views", TYPES)
    assert entry.code(1.0, 2.0, 1, 2, np.zeros(11))[0] == 1
    assert entry.code(1.0, 2.0, 1, 2, np.zeros(SIZE))[0] == 0

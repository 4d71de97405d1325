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

from sagline.kernels.plain import plain
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
PLAIN: dict[Kernel, Kernel] = {kernel: plain(kernel) for kernel in constructs.KERNELS}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    text = translate([(kernel, TYPES, kernel.__name__) for kernel in PLAIN])
    assert text == translate([(kernel, TYPES, kernel.__name__) for kernel in PLAIN])
    return compiled_c(text, tmp_path_factory.mktemp("c"), "-O2", "-DSL_CHECK", "-fsanitize=undefined")


def results(kernel: Kernel, entry: Entry, *numbers: Any) -> tuple[list[float], list[float]]:
    """Outputs of plain Python and of C."""
    expected, found = np.zeros(SIZE), np.zeros(SIZE)
    PLAIN[kernel](*numbers, expected)
    entry(*numbers, found)
    return expected.tolist(), found.tolist()


def assert_equal(expected: list[float], found: list[float]) -> None:
    """Equal to the last bit, including the sign of zero."""
    for k, (one, other) in enumerate(zip(expected, found, strict=True)):
        assert str(one) == str(other), k


@pytest.mark.parametrize("kernel", PLAIN, ids=lambda each: each.__name__)
@settings(max_examples=300, deadline=None, derandomize=True)
@given(x=NUMBERS, y=NUMBERS, i=INTEGERS, j=INTEGERS)
def test_python_and_c_give_the_same_numbers(library: Any, kernel: Kernel, x: float, y: float, i: int, j: int) -> None:
    assert_equal(*results(kernel, Entry(library, kernel.__name__, TYPES), x, y, i, j))


def test_integer_division_by_zero_agrees_with_numba(library: Any) -> None:
    entry = Entry(library, "whole_divisions", TYPES)
    by_numba = numba.njit(error_model="numpy")(constructs.whole_divisions)
    for i in (-7, 0, 7):
        for j in (-3, -1, 0, 2):
            expected, found = np.zeros(SIZE), np.zeros(SIZE)
            by_numba(0.0, 0.0, i, j, expected)
            entry(0.0, 0.0, i, j, found)
            assert_equal(expected.tolist(), found.tolist())


def test_an_array_that_is_too_small_ends_the_entry_with_a_code(library: Any) -> None:
    entry = Entry(library, "views", TYPES)
    assert entry.code(1.0, 2.0, 1, 2, np.zeros(11))[0] == 1
    assert entry.code(1.0, 2.0, 1, 2, np.zeros(SIZE))[0] == 0

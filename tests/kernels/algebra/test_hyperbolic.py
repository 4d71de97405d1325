"""Hyperbolic functions compared with 80-bit arithmetic."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sagline.kernels.algebra import functions
from tests.kernels.compiled import from_python

sinhc = from_python(functions.sinhc)
cosh = from_python(functions.cosh)
sinh_excess = from_python(functions.sinh_excess)
atanhc = from_python(functions.atanhc)

ARGUMENTS = np.concatenate((np.geomspace(1e-9, 2.0, 400), np.linspace(1.99, 2.01, 41), np.linspace(2.0, 300.0, 200)))


def test_sinhc_and_cosh_on_both_sides_of_the_switch() -> None:
    wide = ARGUMENTS.astype(np.longdouble)
    for function, exact in (
        (sinhc, np.sinh(wide) / wide),
        (cosh, np.cosh(wide)),
    ):
        found = np.array([function(h) for h in ARGUMENTS])
        # outside of the polynomials, the rounding of the C library contributes
        assert float(np.max(np.abs(found / exact - 1))) < 6e-16


def test_sinh_excess_is_accurate_where_the_difference_is_not() -> None:
    for h in (1e-8, 1e-4, 0.03, 0.7, 1.9):
        exact = sum(np.longdouble(h) ** k / np.longdouble(math.factorial(k)) for k in range(3, 41, 2))
        assert abs(float(sinh_excess(h) / exact) - 1.0) < 5e-16
    assert sinh_excess(1e-8) != math.sinh(1e-8) - 1e-8


@pytest.mark.parametrize("u", [0.0, 1e-9, 0.0999, 0.1001, 0.3, 0.5])
def test_atanhc(u: float) -> None:
    exact = 1.0 if u == 0.0 else float(np.arctanh(np.longdouble(u)) / np.longdouble(u))
    assert abs(atanhc(u) / exact - 1.0) < 5e-16

"""Least squares between limits, against SciPy's and its own conditions of optimality."""

import math

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from sagline.arrays import Array
from sagline.kernels.algebra.bounded_least_squares import bounded_least_squares
from tests.kernels.compiled import from_python, memory

solve = from_python(bounded_least_squares)


def solved(matrix: Array, right: Array, low: Array, high: Array) -> tuple[Array, Array]:
    n, m = matrix.shape
    x, residual = np.full(m, np.nan), np.full(n, np.nan)
    assert solve(matrix, right, low, high, memory(), x, residual)
    assert (low <= x).all()
    assert (x <= high).all()
    np.testing.assert_allclose(residual, right - matrix @ x, atol=1e-12 * max(1.0, np.abs(right).max()))
    return x, residual


@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 4), (2, 3), (2, 4), (3, 2), (3, 6), (6, 8), (6, 12), (6, 4)])
def test_scipy_agrees(n: int, m: int) -> None:
    rng = np.random.default_rng(10 * n + m)
    met = set()
    for size in (0.3, 1.0, 5.0, 30.0):
        for _ in range(25):
            matrix, right = rng.normal(size=(n, m)), size * rng.normal(size=n)
            low, high = -rng.uniform(0, 2, m), rng.uniform(0, 2, m)
            high[rng.uniform(size=m) < 0.2] = math.inf
            x, residual = solved(matrix, right, low, high)
            found = lsq_linear(matrix, right, (low, high), method="bvls", tol=1e-14)
            assert np.linalg.norm(residual) == pytest.approx(np.linalg.norm(found.fun), abs=1e-9)
            gradient = matrix.T @ residual
            small = 1e-9 * max(1.0, size)
            at_low, at_high = x <= low, x >= high
            assert (gradient[at_low] <= small).all()
            assert (gradient[at_high] >= -small).all()
            np.testing.assert_allclose(gradient[~(at_low | at_high)], 0.0, atol=small)
            met |= {"low"} if at_low.any() else set()
            met |= {"high"} if at_high.any() else set()
            met |= {"free"} if not (at_low | at_high).all() else set()
    assert met == {"low", "high", "free"}


def test_what_is_in_reach_leaves_nothing() -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        matrix = rng.normal(size=(6, 8))
        inside = rng.uniform(1.0, 2.0, 8)
        _, residual = solved(matrix, matrix @ inside, np.ones(8), np.full(8, 2.0))
        np.testing.assert_allclose(residual, 0.0, atol=1e-12)

"""The least change of a wrench, by hand and compared with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from sagline.core.arrays import Array
from sagline.kernels.tension import least_change as kernels
from sagline.kernels.tension.least_change import TensionChange
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.demands import change_from, demand_of, weightless

least_change = from_python(kernels.least_change)


def search(matrix: Array, right: Array, low: Array, high: Array, soft: int) -> tuple[float, TensionChange]:
    change = change_from(0.5 * (low + high), len(right))
    left = least_change(weightless(low, high), demand_of(matrix, right, soft), np.stack((low, high)), change, memory())
    return left, change


def test_by_hand() -> None:
    # two cables along x and y with forces of 1 to 2 N; required: (5, 0.5) N, three too much and half too little
    left, change = search(np.eye(2), np.array([5.0, 0.5]), np.ones(2), np.full(2, 2.0), 2)
    assert left == pytest.approx(np.hypot(3.0, 0.5), rel=1e-12)
    np.testing.assert_allclose(change.tau, [2.0, 1.0], rtol=1e-12)
    np.testing.assert_allclose(change.residual, [3.0, -0.5], rtol=1e-12)
    np.testing.assert_allclose(change.direction, np.array([3.0, -0.5]) / np.hypot(3.0, 0.5), rtol=1e-9)
    # a moment that no force supplies
    assert search(np.eye(2), np.array([1.5, 9.0]), np.ones(2), np.full(2, 2.0), 1)[0] == np.inf


def test_the_moment_is_supplied_and_the_force_is_reduced() -> None:
    # two cables up at x = -1 and x = 1: force t1 + t2, moment t1 - t2; required 10 N and 1 N m, each at most 2 N
    matrix = np.array([[1.0, 1.0], [1.0, -1.0]])
    left, change = search(matrix, np.array([10.0, 1.0]), np.zeros(2), np.full(2, 2.0), 1)
    assert left == pytest.approx(7.0, rel=1e-12)
    np.testing.assert_allclose(change.tau, [2.0, 1.0], rtol=1e-12)
    # along (1, y): the second cable, between its limits, contributes zero, so y = 1; the first one is at its limit
    np.testing.assert_allclose(change.direction, [1.0, 1.0], rtol=1e-9)
    assert search(matrix, np.array([3.0, 1.0]), np.zeros(2), np.full(2, 2.0), 1)[0] == pytest.approx(0.0, abs=1e-12)


def test_forces_agree_with_least_squares() -> None:
    rng = np.random.default_rng(1)
    for _ in range(60):
        matrix, right = rng.normal(size=(3, 5)), rng.normal(size=3) * 30.0
        low, high = rng.uniform(1, 2, 5), rng.uniform(3, 9, 5)
        found = lsq_linear(matrix, right, (low, high), method="bvls", tol=1e-14)
        left, change = search(matrix, right, low, high, 3)
        assert left == pytest.approx(float(np.linalg.norm(found.fun)), abs=1e-8)
        if left > 1e-6:  # the direction is a proof: the cables supply at most the used force along it
            along = change.direction @ matrix
            gap = change.direction @ right - np.maximum(along * low, along * high).sum()
            assert gap == pytest.approx(left, rel=1e-7)


def test_dependent_moments_are_reported() -> None:
    matrix = np.array([[1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0]])
    left, _ = search(matrix, np.array([1.0, 2.0, 4.0]), np.zeros(3), np.ones(3), 1)
    assert np.isnan(left)

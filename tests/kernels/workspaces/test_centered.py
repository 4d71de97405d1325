"""Centered tensions compared with the minimum by scipy, and infeasible demands."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.optimize import minimize

from sagline.core.arrays import Array
from sagline.kernels.workspaces import box_tensions
from sagline.kernels.workspaces.box_tensions import Centered
from tests.kernels.compiled import from_python

find_center = from_python(box_tensions._find_center)
SMOOTHING = 0.01


def _search(low: Array, high: Array, right: Array) -> Centered:
    m, n = low.size, right.size
    below, above, give = np.empty((3, m))
    return Centered(
        low, high, np.full(m, np.nan), below, above, give, right, np.empty(n), np.empty((n, n)), np.empty(n)
    )


def _cost(matrix: Array, right: Array, low: Array, high: Array, tau: Array) -> float:
    inside = (tau > low).all() and (tau < high).all()
    barrier = -np.log(tau - low).sum() - np.log(high - tau).sum() if inside else np.inf
    return float(0.5 * np.sum((right - matrix @ tau) ** 2) + SMOOTHING * barrier)


def test_centered_tensions_agree_with_another_minimizer() -> None:
    rng = np.random.default_rng(3)
    for m, n in ((8, 6), (4, 3), (7, 2)):
        matrix = rng.normal(size=(n, m))
        low, high = rng.uniform(0, 1, m), rng.uniform(2, 9, m)
        right = matrix @ rng.uniform(low + 0.2, high - 0.2)
        search = _search(low, high, right)
        square = find_center(matrix, SMOOTHING, search)
        np.testing.assert_allclose(right - matrix @ search.tau, search.left, atol=1e-12)
        assert square == np.sum(search.left**2)

        cost = partial(_cost, matrix, right, low, high)
        best = minimize(cost, 0.5 * (low + high), method="Nelder-Mead", options={"maxfev": 40000, "fatol": 1e-13})
        assert cost(search.tau) < best.fun + 0.05 * SMOOTHING * m


def test_an_infeasible_demand_gives_the_distance() -> None:
    # a box of forces 1 to 2 along two axes; the point (5, 0.5) is nearest to its corner (2, 1)
    search = _search(np.ones(2), np.full(2, 2.0), np.array([5.0, 0.5]))
    square = find_center(np.eye(2), 1e-8, search)
    np.testing.assert_allclose(search.tau, [2.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(search.left, [3.0, -0.5], atol=1e-6)
    assert abs(square - 9.25) < 1e-5

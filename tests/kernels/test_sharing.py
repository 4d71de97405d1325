"""Null space, polygon, linear program and projection on bare arrays, against NumPy and SciPy."""

import numpy as np
import pytest
from sagline.kernels.algebra.projection import project
from scipy.optimize import linprog

from sagline.kernels import tables
from sagline.kernels.algebra.householder import factorize, minimum_norm, orthogonal_factor, pseudo_inverse
from sagline.kernels.algebra.linear_program import LP_EMPTY, LP_SOLVED, LP_UNBOUNDED, lowest_point
from sagline.kernels.sharing.polygon import SPARE_CORNERS, feasible_polygon, nearest_point
from sagline.kernels.sharing.shortfall import wrench_shortfall
from sagline.kernels.sharing.walk import walk_polygon


@pytest.mark.parametrize(("n", "m"), [(6, 8), (6, 7), (6, 6), (2, 4), (3, 9)])
def test_pseudo_inverse_and_null_space(n: int, m: int) -> None:
    rng = np.random.default_rng(1)
    matrix, right = rng.normal(size=(n, m)), rng.normal(size=n)
    reduced, balance = matrix.copy(), np.zeros((tables.BALANCE_ROWS, 6))
    assert factorize(reduced, balance)
    q, inverse, work = np.empty((m + 1, m)), np.empty((n, m)), np.empty((tables.WORK_ROWS, m))
    orthogonal_factor(reduced, balance, q)
    pseudo_inverse(reduced, balance, q, inverse)
    np.testing.assert_allclose(inverse.T, np.linalg.pinv(matrix), atol=1e-13)
    np.testing.assert_allclose(matrix @ q[:m, n:], 0.0, atol=1e-14)
    np.testing.assert_allclose(q[:m].T @ q[:m], np.eye(m), atol=1e-14)
    balance[tables.RIGHT, :n] = right
    minimum_norm(inverse, balance, work)
    np.testing.assert_allclose(work[tables.START], np.linalg.pinv(matrix) @ right, atol=1e-13)


def test_lost_rank_is_seen() -> None:
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(6, 8))
    matrix[4] = matrix[1] - 2 * matrix[3]
    assert not factorize(matrix.copy(), np.zeros((tables.BALANCE_ROWS, 6)))


def problem(rng: np.random.Generator, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    work = np.zeros((tables.WORK_ROWS, 8))
    null = np.linalg.qr(rng.normal(size=(8, 2)))[0].T.copy()
    work[tables.START] = rng.normal(size=8) * 3 * scale
    work[tables.LOW] = -rng.uniform(0, 5, 8) * scale
    work[tables.HIGH] = rng.uniform(0, 5, 8) * scale
    return work, null


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_cut_and_walked_polygons_are_the_same_set(scale: float) -> None:
    rng = np.random.default_rng(3)
    counts = []
    for _ in range(300):
        work, null = problem(rng, scale)
        corners, walked = np.empty((2, 16 + SPARE_CORNERS, 2))
        labels, names = np.empty((2, 16 + SPARE_CORNERS), dtype=np.int64)
        count, steps = feasible_polygon(work, null, corners, labels), walk_polygon(work, null, walked, names)
        assert count == steps
        counts.append(count)
        rows = np.concatenate((null.T, -null.T))
        start = work[tables.START]
        sides = np.concatenate((start - work[tables.LOW], work[tables.HIGH] - start))
        found = linprog(np.zeros(2), A_ub=-rows, b_ub=sides / scale, bounds=(None, None))
        assert (count > 0) == (found.status == 0)
        assert sorted(names[:steps]) == sorted(labels[:count])
        for corner in walked[:steps]:
            assert np.abs(corners[:count] - corner).sum(axis=1).min() < 1e-9 * scale
    assert counts.count(0) > 30
    assert max(counts) >= 6


def test_nearest_point_of_a_square() -> None:
    square = np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]])
    assert nearest_point(square, 4, 3.0, 0.25) == (1.0, 0.25)
    assert nearest_point(square, 4, -2.0, -5.0) == (-1.0, -1.0)


def solve(rows: np.ndarray, sides: np.ndarray, cost: np.ndarray) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    count, d = rows.shape
    space, ends = np.vstack((rows, np.zeros((d, d)))), np.append(sides, np.zeros(d))
    point, basis, weights = np.empty(d), np.empty(d + 1, dtype=np.int64), np.empty(d + 1)
    outcome = lowest_point(space, ends, count, cost, 1e6, 1e-12, point, np.empty((d, d)), basis, weights)
    return outcome, point, basis, weights


@pytest.mark.parametrize("d", [1, 2, 3, 6, 12])
def test_linear_program(d: int) -> None:
    rng = np.random.default_rng(4)
    outcomes = []
    for _ in range(150):
        rows, sides, cost = rng.normal(size=(3 * d + 3, d)), rng.normal(size=3 * d + 3) - 0.3, rng.normal(size=d)
        outcome, point, basis, weights = solve(rows, sides, cost)
        found = linprog(cost, A_ub=-rows, b_ub=-sides, bounds=(None, None))
        outcomes.append(outcome)
        assert outcome == {0: LP_SOLVED, 2: LP_EMPTY, 3: LP_UNBOUNDED}[found.status]
        if outcome == LP_SOLVED:
            assert cost @ point == pytest.approx(found.fun, rel=1e-8, abs=1e-9)
            assert (rows @ point >= sides - 1e-9).all()
        if outcome == LP_EMPTY:
            named = basis < len(rows)
            assert (weights >= 0).all()
            np.testing.assert_allclose(weights[named] @ rows[basis[named]], 0.0, atol=1e-8)
            assert weights[named] @ sides[basis[named]] > 0
    assert LP_SOLVED in outcomes
    assert LP_EMPTY in outcomes


@pytest.mark.parametrize("d", [2, 5, 15])
def test_projection_keeps_the_optimality_conditions(d: int) -> None:
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(100):
        rows, sides, target = rng.normal(size=(3 * d, d)), rng.normal(size=3 * d) - 0.7, rng.normal(size=d) * 3
        point = np.empty(d)
        verdict = linprog(np.zeros(d), A_ub=-rows, b_ub=-sides, bounds=(None, None)).status == 0
        assert project(rows, sides, len(rows), target, 1e-12, point) == verdict
        if verdict:
            found += 1
            gaps = rows @ point - sides
            assert gaps.min() > -1e-9
            active = rows[gaps < 1e-8]
            pushes = np.linalg.lstsq(active.T, point - target, rcond=None)[0] if len(active) else np.zeros(0)
            np.testing.assert_allclose(active.T @ pushes, point - target, atol=1e-7)
            assert (pushes > -1e-7).all()
    assert found > 20


def test_shortfall_by_hand() -> None:
    # two cables along x and y that pull with 1 to 2 N; needed: (5, 0.5) N, three too much and half too little
    assert wrench_shortfall(np.eye(2), np.array([5.0, 0.5]), np.ones(2), np.full(2, 2.0), 2) == pytest.approx(
        np.hypot(3.0, 0.5)
    )
    # a moment that no force supplies
    matrix = np.array([[1.0, 1.0], [0.0, 0.0]])
    assert wrench_shortfall(matrix, np.array([2.0, 1.0]), np.zeros(2), np.ones(2), 1) == np.inf

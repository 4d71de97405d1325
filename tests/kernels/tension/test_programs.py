"""Lowest sum and lowest maximum compared with linear programs of SciPy, and ties with DAQP."""

import math

import daqp
import numpy as np
import pytest
from scipy.optimize import linprog

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.algebra.programs import LP_EMPTY, LP_GAVE_UP, LP_SOLVED, LP_UNBOUNDED
from sagline.kernels.codes import POSE_INFEASIBLE, POSE_NOT_CONVERGED, POSE_SOLVED, POSE_UNBOUNDED
from sagline.kernels.tension import nearest as p
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import Problem, basis_of, nearness, random_problem
from tests.tiers import wide

status_of = from_python(p.program_status)
share_lowest_sum = from_python(p.share_lowest_sum)
share_lowest_maximum = from_python(p.share_lowest_maximum)


def moved_by(problem: Problem, size: float, rng: np.random.Generator) -> Problem:
    """The same rows with other limits, as in the next iteration."""
    bounds = problem.bounds.copy()
    bounds[START] += size * rng.uniform(-1, 1, bounds.shape[1])
    return problem._replace(bounds=bounds)


@pytest.mark.parametrize(("m", "r"), wide([(8, 2), (5, 1), (12, 6)]))
def test_lowest_sum_in_several_iterations(m: int, r: int) -> None:
    rng = np.random.default_rng(m)
    outcomes = []
    for _ in range(40):
        problem, near, basis = random_problem(rng, m, r, open_share=0.2), nearness(r), basis_of(r)
        cost = problem.null.sum(axis=1)
        for size in (0.0, 1e-3, 3.0, 60.0, 0.0):
            moved = moved_by(problem, size, rng)
            found = moved.program(cost)
            status = share_lowest_sum(*moved, near, basis, memory())
            outcomes.append(status)
            assert status == {0: POSE_SOLVED, 2: POSE_INFEASIBLE, 3: POSE_UNBOUNDED}[found.status]
            if status == POSE_SOLVED:
                assert cost @ near.point == pytest.approx(found.fun, abs=1e-6)
                assert moved.keeps_limits(moved.tensions(near.point), 1e-8)
            else:
                assert basis.labels[0] == -1
    assert outcomes.count(POSE_SOLVED) > 60
    assert POSE_INFEASIBLE in outcomes


@pytest.mark.parametrize(("m", "r"), wide([(8, 2), (5, 1), (12, 6)]))
def test_lowest_maximum_in_several_iterations(m: int, r: int) -> None:
    rng = np.random.default_rng(m)
    outcomes = []
    for _ in range(40):
        problem, near, basis = random_problem(rng, m, r, open_share=0.2), nearness(r), basis_of(r + 1)
        offset = rng.normal(size=m) * 10.0
        for size in (0.0, 1e-3, 3.0, 60.0, 0.0):
            moved = moved_by(problem, size, rng)
            status = share_lowest_maximum(moved.bounds, offset, moved.null, near, basis, memory())
            outcomes.append(status)
            assert status == (POSE_SOLVED if moved.is_feasible else POSE_INFEASIBLE)
            if status == POSE_SOLVED:
                least = lowest_maximum(moved, offset)
                assert (moved.tensions(near.point) + offset).max() == pytest.approx(least, abs=1e-6)
                assert moved.keeps_limits(moved.tensions(near.point), 1e-8)
            else:
                assert basis.labels[0] == -1
    assert outcomes.count(POSE_SOLVED) > 60
    assert POSE_INFEASIBLE in outcomes


def lowest_maximum(problem: Problem, offset: Array) -> float:
    bounds, null = problem
    r, m = null.shape
    finite = np.isfinite(bounds[HIGH])
    rows = np.concatenate((-null.T, null.T[finite], null.T))
    last = np.concatenate((np.zeros(m + finite.sum()), -np.ones(m)))
    start = bounds[START]
    sides = np.concatenate((start - bounds[LOW], (bounds[HIGH] - start)[finite], -start - offset))
    found = linprog(np.eye(r + 1)[r], A_ub=np.column_stack((rows, last)), b_ub=sides, bounds=(None, None))
    assert found.status == 0
    return float(found.fun)


def nearest_of(problem: Problem, rows: Array, sides: Array, reference: Array) -> Array:
    """The feasible point with rows x <= sides nearest to a reference, by DAQP."""
    bounds, null = problem
    m = null.shape[1]
    high = np.concatenate((np.minimum(bounds[HIGH] - bounds[START], 1e30), sides))
    low = np.concatenate((bounds[LOW] - bounds[START], np.full(len(sides), -1e30)))
    every = np.concatenate((null.T, rows))
    sense = np.zeros(m + len(sides), dtype=np.int32)
    point, _, flag, _ = daqp.solve(np.eye(len(null)), -reference, every, high, low, sense, primal_tol=1e-11)
    assert flag == 1
    return np.asarray(point)


def tied_sum(rng: np.random.Generator) -> Problem:
    """The sum is constant along one direction: an edge of the polygon is optimal."""
    null = np.array([[0.5, 0.5, 0.5, 0.5, 0.0, 0.0], [0.5, -0.5, 0.5, -0.5, 0.0, 0.0]])
    start = np.append(np.zeros(4), [3.0, 4.0])
    return Problem(np.array([start, np.append(rng.uniform(1, 2, 4), [0.0, 0.0]), np.full(6, 50.0)]), null)


def test_a_tied_sum_is_nearest_to_the_reference() -> None:
    rng = np.random.default_rng(1)
    for _ in range(30):
        problem, near, basis = tied_sum(rng), nearness(2, rng.normal(size=2) * 5.0), basis_of(2)
        for size in (0.0, 1e-3, 0.3):
            moved = moved_by(problem, size, rng)
            near.point[:] = math.nan
            assert share_lowest_sum(*moved, near, basis, memory()) == POSE_SOLVED
            cost = problem.null.sum(axis=1)
            least = moved.program(cost).fun
            expected = nearest_of(moved, cost[None], np.array([least + 1e-8]), near.reference)
            np.testing.assert_allclose(near.point, expected, atol=1e-6)


def test_a_tied_maximum_is_nearest_to_the_reference() -> None:
    rng = np.random.default_rng(2)
    null = np.array([[1.0, 0.0, 0.0, 0.6], [0.0, 1.0, 0.0, 0.8]])
    for _ in range(30):
        # the third cable has the largest tension at every point
        bounds = np.array([[0.0, 0.0, 40.0, 5.0], rng.uniform(1, 3, 4), [20.0, 25.0, 60.0, 70.0]])
        problem, near, basis = Problem(bounds, null), nearness(2, rng.normal(size=2) * 15.0), basis_of(3)
        offset = np.array([1.0, -1.0, 2.0, 3.0])
        for size in (0.0, 1e-3, 0.3):
            moved = moved_by(problem, size, rng)
            near.point[:] = math.nan
            assert share_lowest_maximum(moved.bounds, offset, null, near, basis, memory()) == POSE_SOLVED
            least = lowest_maximum(moved, offset)
            sides = least - offset - moved.bounds[START] + 1e-9
            expected = nearest_of(moved, null.T, sides, near.reference)
            np.testing.assert_allclose(near.point, expected, atol=1e-6)


def test_meanings_of_outcomes() -> None:
    meanings = {LP_SOLVED: POSE_SOLVED, LP_EMPTY: POSE_INFEASIBLE, LP_UNBOUNDED: POSE_UNBOUNDED}
    for outcome, status in {**meanings, LP_GAVE_UP: POSE_NOT_CONVERGED}.items():
        assert status_of(outcome) == status

"""Least p-norms compared with SciPy and with the conditions of optimality."""

import numpy as np
import pytest
from scipy.optimize import minimize, nnls

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW
from sagline.kernels.codes import POSE_INFEASIBLE, POSE_SOLVED
from sagline.kernels.tension import nearest
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import Problem, nearness, random_problem
from tests.tiers import wide

share_by_norm = from_python(nearest.share_by_norm)


def size_at(problem: Problem, offset: Array, p: float, point: Array) -> float:
    return float(np.linalg.norm(problem.tensions(point) + offset, p))


def assert_least(problem: Problem, offset: Array, p: float, point: Array) -> None:
    """The slope of the norm is a combination of inward normals of active limits (Karush, Kuhn, Tucker)."""
    bounds, null = problem
    tensions = problem.tensions(point)
    assert problem.keeps_limits(tensions, 1e-8)
    largest = np.abs(tensions + offset).max()
    shares = (np.abs(tensions + offset) / largest) ** (p - 1.0) * np.sign(tensions + offset)
    slope = null @ shares
    normals = [null[:, i] for i in np.flatnonzero(tensions < bounds[LOW] + 1e-6)]
    normals += [-null[:, i] for i in np.flatnonzero(tensions > bounds[HIGH] - 1e-6)]
    if normals:
        weights, left = nonnegative(np.array(normals).T, slope)
        assert (weights >= 0.0).all()
        assert left < 1e-5
    else:
        assert np.abs(slope).max() < 1e-5


def nonnegative(matrix: Array, right: Array) -> tuple[Array, float]:
    weights, left = nnls(matrix, right)
    return weights, float(left)


@pytest.mark.parametrize("p", [2.0, 4.0, 7.0, 50.0])
@pytest.mark.parametrize(("m", "r"), wide([(8, 2), (7, 1), (9, 3)]))
def test_the_least_norm_in_several_iterations(m: int, r: int, p: float) -> None:
    rng = np.random.default_rng(m)
    lost = 0
    for trial in range(15):
        problem, offset = random_problem(rng, m, r, feasible=trial % 5 > 0), rng.normal(size=m) * 5.0
        near, known = nearness(r), np.zeros(1, dtype=np.int64)
        for size in (0.0, 1e-3, 3.0, 40.0, 0.0):
            moved = problem._replace(bounds=problem.bounds + size * rng.uniform(-1, 1, m) * [[1.0], [0.0], [0.0]])
            status = share_by_norm(p, moved.bounds, offset, moved.null, near, known, memory())
            assert status == (POSE_SOLVED if moved.is_feasible else POSE_INFEASIBLE)
            assert known[0] == (status == POSE_SOLVED)
            lost += status != POSE_SOLVED
            if status == POSE_SOLVED:
                assert_least(moved, offset, p, near.point)
    assert lost > 0


def test_scipy_finds_nothing_smaller() -> None:
    rng = np.random.default_rng(1)
    for p in (2.0, 6.0):
        for _ in range(8):
            problem, offset = random_problem(rng, 8, 2), np.zeros(8)
            near = nearness(2)
            known = np.zeros(1, dtype=np.int64)
            status = share_by_norm(p, problem.bounds, offset, problem.null, near, known, memory())
            assert status == POSE_SOLVED
            inside = problem.null @ (problem.bounds[1:].mean(axis=0) - problem.bounds[0])
            limits = [
                {"type": "ineq", "fun": lambda x, q=problem: q.tensions(x) - q.bounds[LOW]},
                {"type": "ineq", "fun": lambda x, q=problem: q.bounds[HIGH] - q.tensions(x)},
            ]
            found = minimize(
                lambda x, q=problem, p=p: size_at(q, np.zeros(8), p, x),
                inside, constraints=limits, method="SLSQP", options={"ftol": 1e-13, "maxiter": 300},
            )  # fmt: skip
            assert size_at(problem, offset, p, near.point) <= found.fun * (1 + 1e-9)


def test_a_single_exponent() -> None:
    problem = random_problem(np.random.default_rng(2), 8, 2)
    near = nearness(2)
    status = share_by_norm(2.0, problem.bounds, np.zeros(8), problem.null, near, np.zeros(1, dtype=np.int64), memory())
    assert status == POSE_SOLVED
    near.reference[:] = problem.null @ -problem.bounds[0]  # of the least 2-norm: START, or its projection
    assert_least(problem, np.zeros(8), 2.0, near.point)

"""Tension distribution nearest to a reference, compared with DAQP and by hand."""

import math

import daqp
import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.codes import CHORD_TENSION, CLOSEST, MINIMUM_NORM, POSE_INFEASIBLE, POSE_SOLVED, QUADRATIC_PROGRAM
from sagline.kernels.tension import nearest as n
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import Problem, nearness, random_problem
from tests.tiers import wide

share_nearest = from_python(n.share_nearest)
refer = from_python(n.set_reference)
set_point = from_python(n.set_point)
satisfies_limits = from_python(n.satisfies_limits)
new_nearness = from_python(n.new_reference_point)


def by_daqp(problem: Problem, reference: Array) -> Array:
    bounds, null = problem
    high = np.minimum(bounds[HIGH] - bounds[START], 1e30)
    sense = np.zeros(null.shape[1], dtype=np.int32)
    low = bounds[LOW] - bounds[START]
    point, _, flag, _ = daqp.solve(np.eye(len(null)), -reference, null.T.copy(), high, low, sense, primal_tol=1e-11)
    assert flag == 1
    return problem.tensions(point)


@pytest.mark.parametrize(("m", "r"), wide([(8, 2), (7, 1), (9, 3), (21, 15)]))
def test_iterations_agree_with_daqp(m: int, r: int) -> None:
    rng = np.random.default_rng(m)
    met = 0
    for _ in range(40):
        problem = random_problem(rng, m, r, open_share=0.2)
        near = nearness(r, rng.normal(size=r) * 100.0)
        for size in (0.0, 1e-6, 1.0, 20.0):  # iterations: START moves with the sag forces
            moved = problem._replace(bounds=problem.bounds + size * rng.uniform(-1, 1, m) * [[1.0], [0.0], [0.0]])
            tension = np.full(m, np.nan)
            status = share_nearest(*moved, near, tension)
            assert (status == POSE_SOLVED) == moved.is_feasible
            if status == POSE_SOLVED:
                np.testing.assert_allclose(tension, by_daqp(moved, near.reference), atol=1e-6)
                assert moved.keeps_limits(tension)
                met += near.held.labels[0] > 0
            else:
                assert status == POSE_INFEASIBLE
                assert near.held.labels[0] == 0
    assert met > 40


def test_a_feasible_reference_is_the_solution_without_active_limits() -> None:
    problem = random_problem(np.random.default_rng(1), 8, 2)
    near = nearness(2, np.array([1e4, 1e4]))
    tension = np.full(8, np.nan)
    assert share_nearest(*problem, near, tension) == POSE_SOLVED
    assert near.held.labels[0] > 0
    inside = near.point.copy()
    near.reference[:] = problem.null @ (problem.bounds[1:].mean(axis=0) - problem.bounds[START])
    assert share_nearest(*problem, near, tension) == POSE_SOLVED
    assert near.held.labels[0] == 0
    assert np.abs(tension - problem.tensions(inside)).max() > 1.0
    np.testing.assert_allclose(tension, problem.tensions(near.reference), atol=1e-11)


def test_no_redundant_cable() -> None:
    bounds = np.array([[5.0, 7.0], [5.0, 6.0], [9.0, 7.0]])
    null, tension = np.zeros((0, 2)), np.full(2, np.nan)
    assert share_nearest(bounds, null, nearness(0), tension) == POSE_SOLVED
    np.testing.assert_array_equal(tension, [5.0, 7.0])
    for miss, status in ((1e-13, POSE_SOLVED), (1e-6, POSE_INFEASIBLE)):
        off = bounds + np.array([[-miss, miss], [0.0, 0.0], [0.0, 0.0]])
        assert share_nearest(off, null, nearness(0), tension) == status


@pytest.mark.parametrize("method", [MINIMUM_NORM, CLOSEST, QUADRATIC_PROGRAM])
def test_the_reference_in_coordinates_of_the_null_space(method: int) -> None:
    rng = np.random.default_rng(2)
    problem = random_problem(rng, 8, 2)
    weight, (goal, previous, offset) = rng.uniform(0.5, 2.0, 8), rng.normal(size=(3, 8))
    distribution = n.Distribution(method, 0.0, CHORD_TENSION, weight, goal)
    near = nearness(2, previous=previous)
    refer(distribution, offset, problem.null, near)
    wanted = previous if method == CLOSEST else goal
    np.testing.assert_allclose(near.reference, problem.null @ (weight * (wanted - offset)), atol=1e-14)
    near = nearness(2, previous=np.full(8, math.nan))
    refer(distribution, offset, problem.null, near)
    np.testing.assert_allclose(near.reference, problem.null @ (weight * (goal - offset)), atol=1e-14)


def test_limits_are_satisfied_on_both_sides() -> None:
    bounds = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, math.inf]])
    for tension, slack, kept in (
        ([1.0, 9e9], 0.0, True),
        ([2.0, 1.0], 0.0, True),
        ([2.1, 1.0], 0.0, False),
        ([2.1, 1.0], 0.2, True),
        ([0.9, 1.0], 0.0, False),
        ([1.0, 0.9], 0.2, True),
        ([1.0, math.nan], 0.2, False),
    ):
        assert satisfies_limits(bounds, np.array(tension), slack) == kept


def test_tensions_of_a_point() -> None:
    problem = random_problem(np.random.default_rng(3), 8, 3)
    point, tension = np.array([1.0, -2.0, 3.0]), np.full(8, np.nan)
    set_point(*problem, point, tension)
    np.testing.assert_allclose(tension, problem.tensions(point), rtol=1e-14)
    near, rest = new_nearness(memory(100, 20), np.zeros(8), 3)
    assert near.point.shape == near.reference.shape == (3,)
    assert rest.numbers.size == 100 - 6 - (12 + 16 + 8)
    assert rest.counters.size == 20 - 5

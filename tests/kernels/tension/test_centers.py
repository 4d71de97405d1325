"""The analytic center compared with its condition, and its initial points."""

import math

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.codes import POSE_INFEASIBLE, POSE_NOT_CONVERGED, POSE_SOLVED, POSE_UNBOUNDED
from sagline.kernels.tension import other_methods as c
from tests.kernels.compiled import from_python
from tests.kernels.tension.problems import Problem, random_problem, room_of
from tests.tiers import wide

share_at_center = from_python(c.share_at_center)
is_inside = from_python(c._keeps_limits_inside)
deepest_point = from_python(c.deepest_point)


def push(problem: Problem, point: Array) -> tuple[float, float]:
    """Slope of the sum of logarithms of all distances to limits, and the size of its terms."""
    tensions = problem.tensions(point)
    terms = problem.null * (1.0 / (tensions - problem.bounds[LOW]) - 1.0 / (problem.bounds[HIGH] - tensions))
    return float(np.abs(terms.sum(axis=1)).max()), float(np.abs(terms).max())


@pytest.mark.parametrize(("m", "r"), wide([(8, 2), (7, 1), (9, 3), (14, 8)]))
def test_the_center_in_several_iterations(m: int, r: int) -> None:
    rng = np.random.default_rng(m)
    lost = 0
    for trial in range(25):
        problem = random_problem(rng, m, r, feasible=trial % 5 > 0)
        room, point = room_of(m, r), np.full(r, np.nan)
        for size in (0.0, 1e-3, 3.0, 40.0, 0.0):
            moved = problem._replace(bounds=problem.bounds + size * rng.uniform(-1, 1, m) * [[1.0], [0.0], [0.0]])
            status = share_at_center(*moved, point, room)
            assert status == (POSE_SOLVED if moved.is_feasible else POSE_INFEASIBLE)
            assert room.known[0] == (status == POSE_SOLVED)
            lost += status != POSE_SOLVED
            if status == POSE_SOLVED:
                assert is_inside(*moved, point)
                left, terms = push(moved, point)
                assert left < 1e-8 * terms
    assert lost > 0


@pytest.mark.parametrize("r", [1, 2, 3])
def test_infinite_limits_are_ignored_and_the_set_must_be_bounded(r: int) -> None:
    rng = np.random.default_rng(1)
    ends = set()
    for trial in range(60):
        problem = random_problem(rng, r + 3, r, open_share=0.2 if trial % 2 else 0.9)
        point = np.full(r, np.nan)
        status = share_at_center(*problem, point, room_of(r + 3, r))
        if problem.is_endless:
            ends.add(False)
            # for polyhedra the search can find the deepest point of such a set, from which Newton's steps have no end
            assert status == POSE_UNBOUNDED or (r > 2 and status == POSE_NOT_CONVERGED)
        elif status == POSE_SOLVED:
            ends.add(True)
            left, terms = push(problem, point)
            assert left < 1e-8 * terms
    assert ends == {True, False}


def test_the_deepest_point_by_a_linear_program() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        problem = random_problem(rng, 9, 3)
        point = np.full(3, np.nan)
        assert deepest_point(*problem, room_of(9, 3), point) == POSE_SOLVED
        tensions = problem.tensions(point)
        depth = np.minimum(tensions - problem.bounds[LOW], problem.bounds[HIGH] - tensions).min()
        for size, there in ((-1e-4, True), (1e-4, False)):  # narrower limits leave just one point
            shrunk = problem.bounds + np.array([[0.0], [depth + size], [-depth - size]])
            assert problem._replace(bounds=shrunk).is_feasible == there


def test_an_infeasible_previous_center_is_discarded() -> None:
    problem = random_problem(np.random.default_rng(3), 8, 2)
    room, point = room_of(8, 2), np.full(2, np.nan)
    assert share_at_center(*problem, point, room) == POSE_SOLVED
    expected = point.copy()
    point[:] = 1e5
    room.known[0] = 1
    assert share_at_center(*problem, point, room) == POSE_SOLVED
    np.testing.assert_allclose(point, expected, atol=1e-6)


def test_a_set_without_interior_keeps_the_point() -> None:
    null = np.array([[1.0, 0.0], [0.0, 1.0]])
    bounds = np.array([[0.0, 0.0], [2.0, -1.0], [2.0, 1.0]])
    point = np.full(2, np.nan)
    assert share_at_center(bounds, null, point, room_of(2, 2)) == POSE_SOLVED
    assert point[0] == pytest.approx(2.0, abs=1e-11)
    assert -1.0 <= point[1] <= 1.0
    assert not is_inside(bounds, null, point)
    bounds[HIGH, 0] = math.inf
    bounds[START, 0] = 0.0
    assert not is_inside(bounds, null, np.array([2.0, 0.0]))
    assert is_inside(bounds, null, np.array([2.1, 0.0]))
    assert not is_inside(bounds, null, np.array([2.1, 1.0]))

"""The polygon walk compared with corners by brute force."""

import numpy as np
import pytest

from sagline.kernels.tension.on_polygon import _most_independent, _walk_polygon
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import area_of, brute_corners, corner_room, random_problem
from tests.tiers import wide

walk = from_python(_walk_polygon)
independent = from_python(_most_independent)


@pytest.mark.parametrize("m", wide([4, 3, 8, 16]))
def test_corners_by_brute_force(m: int) -> None:
    rng = np.random.default_rng(m)
    empty = 0
    for trial in range(40):
        problem = random_problem(rng, m, 2, feasible=trial % 4 > 0)
        corners, labels = corner_room(m)
        count = walk(*problem, memory(), corners, labels)
        assert (count > 0) == problem.is_feasible
        empty += count == 0
        if count > 0:
            found = corners[:count]
            expected = brute_corners(problem)
            assert len(expected) == count
            for corner in expected:
                assert np.abs(found - corner).max(axis=1).min() < 1e-7
            assert area_of(found) > 0.0
            for k in range(count):
                tensions = problem.tensions(found[k])
                for label in (labels[k - 1 if k else count - 1], labels[k]):
                    assert tensions[label // 2] == pytest.approx(problem.bounds[1 + label % 2, label // 2], abs=1e-8)
    assert empty >= (0 if m == 3 else 1)


def test_most_independent_cables_span_the_largest_parallelogram() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        null = rng.normal(size=(2, 7))
        a, b = independent(null)
        areas = np.abs(np.outer(null[0], null[1]) - np.outer(null[1], null[0]))
        assert areas[a, b] == pytest.approx(areas.max(), rel=1e-15)


def test_a_cable_that_the_null_space_does_not_move() -> None:
    null = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    bounds = np.array([[0.0, 0.0, 0.0], [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    corners, labels = corner_room(3)
    assert walk(bounds, null, memory(), corners, labels) == 4
    bounds[0, 2] = 1.1
    assert walk(bounds, null, memory(), corners, labels) == 0

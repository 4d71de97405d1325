"""The feasible polygon compared with linear programs, the polygon walk, and its corners by brute force."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.tension import on_polygon
from sagline.kernels.tension import polygon as p
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import Problem, area_of, brute_corners, corner_room, random_problem
from tests.tiers import extended, wide

feasible_polygon = from_python(p.feasible_polygon)
polygon_again = from_python(p.polygon_again)
nearest_corner_point = from_python(p.nearest_corner_point)
nearest_on_side = from_python(p.nearest_on_side)
widest_pair = from_python(p._widest_pair)
walk_polygon = from_python(on_polygon._walk_polygon)


def polygon_of(problem: Problem) -> tuple[Array, Indices]:
    corners, labels = corner_room(problem.null.shape[1])
    count = feasible_polygon(*problem, corners, labels)
    return corners[:count], labels[:count]


def scattered(rng: np.random.Generator, scale: float = 1.0) -> Problem:
    """Eight cables whose bounds often have no common point."""
    null = np.linalg.qr(rng.normal(size=(8, 2)))[0].T.copy()
    start = rng.normal(size=8) * 3 * scale
    return Problem(np.array([start, -rng.uniform(0, 5, 8) * scale, rng.uniform(0, 5, 8) * scale]), null)


@pytest.mark.parametrize("scale", wide([1.0, 1e-3, 1e6]))
def test_cut_and_walked_polygons_are_the_same_set(scale: float) -> None:
    rng = np.random.default_rng(3)
    counts = []
    for _ in range(300):
        problem = scattered(rng, scale)
        bounds, null = problem
        walked, names = corner_room(8)
        corners, labels = polygon_of(problem)
        count, steps = len(corners), walk_polygon(bounds, null, memory(), walked, names)
        assert count == steps
        counts.append(count)
        rows = np.concatenate((null.T, -null.T))
        sides = np.concatenate((bounds[START] - bounds[LOW], bounds[HIGH] - bounds[START]))
        found = linprog(np.zeros(2), A_ub=-rows, b_ub=sides / scale, bounds=(None, None))
        assert (count > 0) == (found.status == 0)
        assert sorted(names[:steps]) == sorted(labels)
        for corner in walked[:steps]:
            assert np.abs(corners - corner).sum(axis=1).min() < 1e-9 * scale
    assert counts.count(0) > 30
    assert max(counts) >= 6


def test_nearest_point_of_a_square() -> None:
    square = np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]])
    assert nearest_corner_point(square, 4, 3.0, 0.25) == (1.0, 0.25)
    assert nearest_corner_point(square, 4, -2.0, -5.0) == (-1.0, -1.0)
    assert nearest_corner_point(square, 4, 0.25, -5.0) == (0.25, -1.0)
    assert nearest_corner_point(square, 4, 0.25, 5.0) == (0.25, 1.0)
    assert nearest_on_side(1.0, 2.0, 1.0, 2.0, 5.0, 5.0) == (1.0, 2.0)


def assert_polygon(problem: Problem, corners: Array, labels: Indices) -> None:
    """Counter-clockwise; each corner is on the edges before and after it, and within all limits."""
    bounds, null = problem
    m, count = null.shape[1], len(corners)
    assert area_of(corners) >= -1e-9
    assert len(set(labels)) == count
    for k, corner in enumerate(corners):
        tensions = problem.tensions(corner)
        assert problem.keeps_limits(tensions, 1e-8)
        for label in (labels[k - 1], labels[k]):
            if label < 2 * m:
                assert tensions[label // 2] == pytest.approx(bounds[LOW + label % 2, label // 2], abs=1e-8)


@pytest.mark.parametrize("m", wide([8, 3, 4, 6, 14, 24]))
def test_corners_by_brute_force(m: int) -> None:
    rng = np.random.default_rng(m)
    signs, sizes = set(), []
    for trial in range(40):
        problem = random_problem(rng, m, 2, feasible=trial % 4 > 0)
        signs.add(widest_pair(problem.null)[2] > 0.0)
        corners, labels = polygon_of(problem)
        assert (len(corners) > 0) == problem.is_feasible
        sizes.append(len(corners))
        if len(corners):
            expected = brute_corners(problem)
            assert len(expected) == len(corners)
            for corner in expected:
                assert np.abs(corners - corner).max(axis=1).min() < 1e-7
            assert_polygon(problem, corners, labels)
    assert signs == {True, False}  # the first four corners in either orientation
    assert max(sizes) >= min(m, 5)


@extended
def test_infinite_limits_end_at_a_labeled_box() -> None:
    rng = np.random.default_rng(7)
    ended = set()
    for trial in range(200):
        problem = random_problem(rng, 6, 2, feasible=trial % 8 > 0, open_share=0.7)
        corners, labels = polygon_of(problem)
        assert (len(corners) > 0) == problem.is_feasible
        if not len(corners):
            continue
        assert_polygon(problem, corners, labels)
        far = np.eye(2)[[0, 1, 0, 1]] * [[1.0], [1.0], [-1.0], [-1.0]]
        closed = all(problem.program(way).status == 0 for way in (*far, np.array([1.0, 1.0]), np.array([-1.0, -1.0])))
        ended.add(bool((labels < 12).all()))
        assert (labels < 12).all() == closed
        near = brute_corners(problem)  # all finite corners are included
        for corner in near:
            assert np.abs(corners - corner).max(axis=1).min() < 1e-6
    assert ended == {True, False}


def test_sets_that_are_a_segment_or_a_point() -> None:
    null = np.array([[1.0, 0.0, 0.6], [0.0, 1.0, 0.8]])
    bounds = np.array([[0.0, 0.0, 0.0], [2.0, -1.0, -9.0], [2.0, 1.0, 9.0]])
    corners, _ = polygon_of(Problem(bounds, null))
    assert len(corners) > 1
    np.testing.assert_allclose(corners[:, 0], 2.0, atol=1e-12)
    assert sorted({round(y, 9) for y in corners[:, 1]}) == [-1.0, 1.0]
    bounds[LOW, 2] = bounds[HIGH, 2] = 1.2  # x = 2 and 0.6 x + 0.8 y = 1.2: y = 0
    corners, _ = polygon_of(Problem(bounds, null))
    assert len(corners) > 0
    np.testing.assert_allclose(corners, [[2.0, 0.0]] * len(corners), atol=1e-10)
    bounds[LOW, 2] = bounds[HIGH, 2] = 2.1  # y = 1.125: infeasible
    assert len(polygon_of(Problem(bounds, null))[0]) == 0


def test_reversed_limits_give_an_empty_set() -> None:
    rng = np.random.default_rng(8)
    for i in range(6):  # the widest two among them
        problem = random_problem(rng, 6, 2)
        for k in range(6):
            bounds = problem.bounds.copy()
            bounds[LOW, k] = bounds[HIGH, k] + 1e-3 * (1 + i)
            assert len(polygon_of(problem._replace(bounds=bounds))[0]) == 0


def test_a_cable_that_the_null_space_does_not_move() -> None:
    null = np.array([[1.0, 0.0, 0.0, 0.6], [0.0, 1.0, 0.0, 0.8]])
    bounds = np.array([[0.0] * 4, [-1.0] * 4, [1.0] * 4])
    assert len(polygon_of(Problem(bounds, null))[0]) > 3
    for start in (1.1, -1.1):
        bounds[START, 2] = start
        assert len(polygon_of(Problem(bounds, null))[0]) == 0


@pytest.mark.parametrize("m", [4, 8, 12])
def test_the_same_edges_again_or_false(m: int) -> None:
    rng = np.random.default_rng(20 + m)
    kept, changed = 0, 0
    for _ in range(150):
        problem = random_problem(rng, m, 2)
        corners, labels = corner_room(m)
        count = feasible_polygon(*problem, corners, labels)
        for size in (1e-9, 0.1, 2.0, 30.0):
            moved = problem._replace(bounds=problem.bounds + size * rng.uniform(-1, 1, (3, m)))
            expected, names = polygon_of(moved)
            found, sides = corners.copy(), labels.copy()
            if polygon_again(*moved, found, sides, count):
                kept += 1
                np.testing.assert_allclose(found[:count], sorted_like(expected, names, labels[:count]), atol=1e-7)
                np.testing.assert_array_equal(sides, labels)
            else:
                changed += 1
                assert size > 1e-9
                # other edges: cut off, absent, or the set is empty
                assert sorted(names) != sorted(labels[:count])
                again = feasible_polygon(*moved, found, sides)
                np.testing.assert_array_equal(found[:again], expected)
    assert kept > 150
    assert changed > 100


def sorted_like(corners: Array, names: Indices, labels: Indices) -> Array:
    """Corners in the order of the edges of another list."""
    assert sorted(names) == sorted(labels)
    return np.asarray(corners[[list(names).index(label) for label in labels]])


def test_an_unbounded_polygon_is_never_reused() -> None:
    null = np.array([[0.5, 0.5, 0.5, 0.5], [0.5, -0.5, 0.5, -0.5]])  # all tensions grow along the first axis
    problem = Problem(np.array([[0.0] * 4, [1.0, 2.0, 3.0, 4.0], [math.inf] * 4]), null)
    corners, labels = corner_room(4)
    count = feasible_polygon(*problem, corners, labels)
    assert (labels[:count] >= 8).any()
    assert not polygon_again(*problem, corners, labels, count)

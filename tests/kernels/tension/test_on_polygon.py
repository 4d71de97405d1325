"""Centroid, interval and optima by the polygon walk, compared with brute force."""

import math

import numpy as np
import pytest

from sagline.kernels import codes
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.codes import CENTROID, POLYGON_WALK, POSE_INFEASIBLE, POSE_SOLVED, POSE_UNBOUNDED
from sagline.kernels.tension import on_polygon as o
from tests.kernels.compiled import from_python
from tests.kernels.tension.problems import Problem, area_of, brute_corners, nearness, random_problem, room_of
from tests.tiers import wide

distribute_on_polygon = from_python(o.distribute_on_polygon)
feasible_interval = from_python(o.feasible_interval)
centroid = from_python(o.centroid)
lowest_corner = from_python(o._lowest_corner)

WALKS = [codes.WALK_SUM, codes.WALK_NORM, codes.WALK_CENTROID]


def test_centroid_of_a_triangle_and_a_trapezoid() -> None:
    corners = np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 7.0], [np.nan, np.nan]])
    np.testing.assert_allclose(centroid(corners, 3), (2.0, 3.0), rtol=1e-15)
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [2.0, 3.0], [0.0, 3.0]])  # y = h (a + 2b)/(3 (a + b))
    np.testing.assert_allclose(centroid(corners, 4), (14.0 / 9.0, 4.0 / 3.0), rtol=1e-15)
    # no area: the middle of the corners
    np.testing.assert_allclose(centroid(np.array([[0.0, 0.0], [2.0, 2.0], [2.0, 2.0], [0.0, 0.0]]), 4), (1.0, 1.0))


def test_the_interval_of_one_redundant_cable() -> None:
    rng = np.random.default_rng(1)
    empty = 0
    for trial in range(100):
        problem = random_problem(rng, 5, 1, feasible=trial % 3 > 0)
        first, last = feasible_interval(*problem)
        found = [problem.program(np.array([sign])) for sign in (1.0, -1.0)]
        assert (first <= last) == (found[0].status == 0)
        empty += first > last
        if first <= last:
            np.testing.assert_allclose([first, last], [found[0].fun, -found[1].fun], atol=1e-7)
    assert empty > 10


def test_an_unbounded_interval_and_one_of_a_point() -> None:
    null = np.array([[0.6, 0.8, 0.0]])
    bounds = np.array([[0.0, 0.0, 0.0], [1.2, 0.8, -1.0], [math.inf, math.inf, 1.0]])
    np.testing.assert_allclose(feasible_interval(bounds, null), (2.0, math.inf))
    bounds[HIGH, 0] = 1.2 * (1.0 - 4e-13)  # crossed by rounding only
    first, last = feasible_interval(bounds, null)
    assert first == last == pytest.approx(2.0)
    bounds[HIGH, 0], bounds[START, 2] = 3.0, 1.1  # a cable that the null space does not move
    first, last = feasible_interval(bounds, null)
    assert first > last


def expected_point(problem: Problem, method: int, parameter: float, reference: np.ndarray) -> np.ndarray:
    """The chosen point by brute force: of all corners, of many points of the boundary, or of many triangles."""
    corners = brute_corners(problem)
    middle = corners.mean(axis=0)
    corners = corners[np.argsort(np.arctan2(*(corners - middle).T[::-1]))]
    if method == POLYGON_WALK and parameter == codes.WALK_SUM:
        return np.asarray(min(corners, key=lambda corner: problem.tensions(corner).sum()))
    if method == POLYGON_WALK and parameter == codes.WALK_NORM:
        if problem.keeps_limits(problem.tensions(reference), 0.0):
            return reference
        share = np.linspace(0.0, 1.0, 20001)[:, None]
        border = np.concatenate(
            [a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        )
        return np.asarray(border[np.linalg.norm(border - reference, axis=1).argmin()])
    triangles = [(middle, a, b) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    areas = [area_of(np.array(t)) for t in triangles]
    return np.asarray(np.average([np.mean(t, axis=0) for t in triangles], axis=0, weights=areas))


@pytest.mark.parametrize(("method", "parameter"), wide([(CENTROID, 0.0), *((POLYGON_WALK, walk) for walk in WALKS)]))
def test_the_chosen_point_in_several_iterations(method: int, parameter: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(25):
        problem = random_problem(rng, 8, 2)
        near, room = nearness(2, rng.normal(size=2) * 30.0), room_of(8, 2)
        for size in (0.0, 1e-3, 3.0, 25.0):
            moved = problem._replace(bounds=problem.bounds + size * rng.uniform(-1, 1, 8) * [[1.0], [0.0], [0.0]])
            status = distribute_on_polygon(method, parameter, *moved, near, room)
            assert (status == POSE_SOLVED) == moved.is_feasible
            if status != POSE_SOLVED:
                assert status == POSE_INFEASIBLE
                assert room.known[0] == 0
                continue
            expected = expected_point(moved, method, parameter, near.reference)
            tolerance = 0.02 if parameter == codes.WALK_NORM and method == POLYGON_WALK else 1e-6
            np.testing.assert_allclose(near.point, expected, atol=tolerance)
            assert moved.keeps_limits(moved.tensions(near.point), 1e-9)
            assert room.known[0] > 2


@pytest.mark.parametrize(("method", "parameter"), [(CENTROID, 0.0)] + [(POLYGON_WALK, walk) for walk in WALKS])
def test_one_redundant_cable(method: int, parameter: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(25):
        problem = random_problem(rng, 5, 1)
        near, room = nearness(1, rng.normal(size=1) * 100.0), room_of(5, 1)
        assert distribute_on_polygon(method, parameter, *problem, near, room) == POSE_SOLVED
        assert room.known[0] == 0
        ends = [problem.program(np.array([sign])).fun * sign for sign in (1.0, -1.0)]
        if method == POLYGON_WALK and parameter == codes.WALK_SUM:
            expected = ends[0] if problem.null.sum() > 0.0 else ends[1]
        elif method == POLYGON_WALK and parameter == codes.WALK_NORM:
            expected = float(np.clip(near.reference[0], *ends))
        else:
            expected = 0.5 * (ends[0] + ends[1])
        assert near.point[0] == pytest.approx(expected, abs=1e-7)


def test_the_centroid_of_an_unbounded_set() -> None:
    for r in (1, 2):
        problem = random_problem(np.random.default_rng(4), 4, r)
        null = np.array([[0.5, 0.5, 0.5, 0.5], [0.5, -0.5, 0.5, -0.5]])[:r].copy()
        bounds = problem.bounds.copy()
        bounds[START], bounds[HIGH] = 0.0, math.inf
        assert distribute_on_polygon(CENTROID, 0.0, bounds, null, nearness(r), room_of(4, r)) == POSE_UNBOUNDED
        bounds[LOW] = 0.0
        bounds[HIGH] = 1.0
        assert distribute_on_polygon(CENTROID, 0.0, bounds, null, nearness(r), room_of(4, r)) == POSE_SOLVED


def test_tied_sums_choose_the_point_of_the_edge_nearest_to_the_reference() -> None:
    # tensions x, y and 1 - x - y among others: the sum of the first three is constant
    null = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    bounds = np.array([[0.0, 0.0, 0.0], [-1.0, -1.0, -5.0], [1.0, 1.0, 5.0]])
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for goal, expected in (((0.25, 3.0), (0.25, -1.0)), ((7.0, 3.0), (1.0, -1.0)), ((-7.0, -3.0), (-1.0, -1.0))):
        for turn in range(4):
            found = lowest_corner(bounds, null, np.roll(square, turn, axis=0).copy(), 4, *goal)
            np.testing.assert_allclose(found, expected, atol=1e-15)

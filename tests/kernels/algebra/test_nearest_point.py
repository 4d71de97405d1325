"""The nearest point within bounds: optimality, DAQP, and warm starts from other problems."""

import math

import daqp
import numpy as np
import pytest
from scipy.optimize import linprog

from sagline.core.arrays import Array
from sagline.kernels.algebra import programs as n
from tests.kernels.compiled import from_python, memory

nearest_point = from_python(n.nearest_point)
new_held = from_python(n.new_active_set)


def held_for(d: int) -> n.ActiveSet:
    held: n.ActiveSet = new_held(memory(), d)[0]
    held.labels[0] = 0
    return held


def point_of(rows: Array, bounds: Array, target: Array, held: n.ActiveSet | None = None) -> Array:
    """The point, if it exists."""
    point = solve(rows, bounds, target, held)
    assert point is not None
    return point


def solve(rows: Array, bounds: Array, target: Array, held: n.ActiveSet | None = None) -> Array | None:
    """The point, from a cold start unless `held` is given; None if there is none."""
    held = held_for(target.size) if held is None else held
    point = np.full(target.size, np.nan)
    return point if nearest_point(rows, bounds, target, 1e-12, held, point) else None


def one_sided(rows: Array, sides: Array) -> tuple[Array, Array]:
    """rows x >= sides as bounds."""
    return rows.T.copy(), np.array([np.zeros_like(sides), sides, np.full_like(sides, math.inf)])


def two_sided(rng: np.random.Generator, d: int) -> tuple[Array, Array, Array]:
    """Rows, bounds with a common point, and a target."""
    k = 2 * d + 2
    rows, inside = rng.normal(size=(d, k)), rng.normal(size=d)
    start = rng.normal(size=k)
    middle = start + inside @ rows
    bounds = np.array([start, middle - rng.uniform(0.0, 1.0, k), middle + rng.uniform(0.0, 1.0, k)])
    bounds[2, rng.uniform(size=k) < 0.2] = math.inf
    return rows, bounds, inside + 3.0 * rng.normal(size=d)


def by_daqp(rows: Array, bounds: Array, target: Array) -> Array:
    d, k = rows.shape
    high = np.minimum(bounds[2] - bounds[0], 1e30)
    found, _value, flag, _info = daqp.solve(
        np.eye(d), -target, rows.T.copy(), high, bounds[1] - bounds[0], np.zeros(k, dtype=np.int32), primal_tol=1e-11
    )
    assert flag == 1
    return np.asarray(found)


@pytest.mark.parametrize("d", [2, 5, 15])
def test_projection_satisfies_the_optimality_conditions(d: int) -> None:
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(100):
        rows, sides, target = rng.normal(size=(3 * d, d)), rng.normal(size=3 * d) - 0.7, rng.normal(size=d) * 3
        verdict = linprog(np.zeros(d), A_ub=-rows, b_ub=-sides, bounds=(None, None)).status == 0
        point = solve(*one_sided(rows, sides), target)
        assert (point is not None) == verdict
        if point is not None:
            found += 1
            gaps = rows @ point - sides
            assert gaps.min() > -1e-9
            active = rows[gaps < 1e-8]
            pushes = np.linalg.lstsq(active.T, point - target, rcond=None)[0] if len(active) else np.zeros(0)
            np.testing.assert_allclose(active.T @ pushes, point - target, atol=1e-7)
            assert (pushes > -1e-7).all()
    assert found > 20


@pytest.mark.parametrize("d", range(1, 16))
def test_daqp_agrees(d: int) -> None:
    rng = np.random.default_rng(d)
    for _ in range(30):
        rows, bounds, target = two_sided(rng, d)
        point = solve(rows, bounds, target)
        assert point is not None
        np.testing.assert_allclose(point, by_daqp(rows, bounds, target), atol=1e-8)


@pytest.mark.parametrize("d", [1, 2, 3, 6, 15])
def test_a_start_from_a_neighbor_gives_the_same_solution(d: int) -> None:
    rng = np.random.default_rng(100 + d)
    stood = 0
    for _ in range(60):
        rows, bounds, target = two_sided(rng, d)
        held = held_for(d)
        assert solve(rows, bounds, target, held) is not None
        before = set(held.labels[1 : 1 + held.labels[0]])
        for size in (1e-9, 1e-3, 0.3):  # the next limits are on the same sides, then partly on others
            moved = bounds + size * rng.uniform(-1, 1, bounds.shape) * [[1], [0], [0]]
            goal = target + size * rng.normal(size=d)
            cold, warm = solve(rows, moved, goal), solve(rows, moved, goal, held)
            assert (cold is None) == (warm is None)
            if cold is not None:
                assert warm is not None
                np.testing.assert_allclose(warm, cold, atol=2e-11)
        stood += len(before)
    assert stood > 20


@pytest.mark.parametrize("d", [1, 2, 3, 6])
def test_a_start_from_wrong_bounds_is_discarded(d: int) -> None:
    rng = np.random.default_rng(200 + d)
    for _ in range(150):
        rows, bounds, target = two_sided(rng, d)
        rows[:, -1] = rows[:, -2]  # bounds that depend on each other
        bounds[:, -1] = bounds[:, -2]
        held = held_for(d)
        count = int(rng.integers(1, d + 1))
        finite = [label for label in range(2 * rows.shape[1]) if label % 2 == 0 or bounds[2, label // 2] < math.inf]
        held.labels[0] = count
        held.labels[1 : 1 + count] = rng.choice(finite, count, replace=bool(rng.integers(2)))
        cold, warm = solve(rows, bounds, target), solve(rows, bounds, target, held)
        assert cold is not None
        assert warm is not None
        np.testing.assert_allclose(warm, cold, atol=2e-11)
        np.testing.assert_allclose(cold, by_daqp(rows, bounds, target), atol=1e-8)


def test_held_bounds_are_active_at_the_point() -> None:
    rng = np.random.default_rng(3)
    for _ in range(100):
        rows, bounds, target = two_sided(rng, 3)
        held = held_for(3)
        point = solve(rows, bounds, target, held)
        assert point is not None
        value = bounds[0] + point @ rows
        pull = target - point
        for place, label in enumerate(held.labels[1 : 1 + held.labels[0]]):
            sign = 1.0 if label % 2 == 0 else -1.0
            assert value[label // 2] == pytest.approx(bounds[1 + label % 2, label // 2], abs=1e-12)
            pull = pull + held.pushes[n.PUSH, place] * sign * rows[:, label // 2]
        np.testing.assert_allclose(pull, 0.0, atol=1e-12)  # the multipliers keep the point from its target


def test_a_target_inside_is_the_solution_without_active_bounds() -> None:
    rows, bounds = np.eye(2), np.array([[0.0, 0.0], [-1.0, -1.0], [1.0, math.inf]])
    held = held_for(2)
    np.testing.assert_array_equal(point_of(rows, bounds, np.array([0.5, 9.0]), held), [0.5, 9.0])
    assert held.labels[0] == 0
    np.testing.assert_array_equal(point_of(rows, bounds, np.array([3.0, -9.0]), held), [1.0, -1.0])
    assert sorted(held.labels[1:3]) == [1, 2]
    np.testing.assert_array_equal(point_of(rows, bounds, np.array([0.5, 9.0]), held), [0.5, 9.0])


def test_an_empty_set_discards_held_bounds() -> None:
    rows = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    bounds = np.array([[0.0, 0.0, 0.0], [0.0, 1.5, 0.0], [1.0, 2.0, 1.0]])  # x <= 1 and x >= 1.5
    held = held_for(2)
    assert solve(rows, bounds, np.array([5.0, 5.0]), held) is None
    assert held.labels[0] == 0
    bounds[2, 0] = 1.6
    np.testing.assert_allclose(point_of(rows, bounds, np.array([5.0, 5.0]), held), [1.6, 1.0], atol=1e-15)


def test_bounds_of_zero_width_given_twice() -> None:
    rows = np.array([[1.0, 2.0, 0.6], [0.0, 0.0, 0.8]])
    bounds = np.array([[0.0, 0.0, 0.0], [2.0, 4.0, -1.0], [2.0, 4.0, 1.0]])  # x = 2, given twice
    np.testing.assert_allclose(point_of(rows, bounds, np.array([7.0, 9.0])), [2.0, -0.25], atol=1e-14)

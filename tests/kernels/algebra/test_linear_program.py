"""Linear programs over bounds compared with SciPy, from cold and warm starts."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from sagline.core.arrays import Array
from sagline.kernels.algebra import programs as lp
from sagline.kernels.algebra.programs import LP_EMPTY, LP_SOLVED, LP_UNBOUNDED
from tests.kernels.compiled import from_python, memory

lowest_point = from_python(lp.lowest_point)
new_basis = from_python(lp.new_basis)


def basis_for(d: int) -> lp.Basis:
    basis: lp.Basis = new_basis(memory(), d)[0]
    basis.labels[0] = -1
    return basis


def solve(rows: Array, bounds: Array, cost: Array, basis: lp.Basis | None = None) -> tuple[int, Array, lp.Basis]:
    basis = basis_for(cost.size) if basis is None else basis
    point = np.full(cost.size, np.nan)
    return lowest_point(rows, bounds, cost, 0.0, basis, point), point, basis


def by_scipy(rows: Array, bounds: Array, cost: Array) -> tuple[int, float]:
    finite = np.isfinite(bounds[2])
    sides = np.concatenate((bounds[0] - bounds[1], (bounds[2] - bounds[0])[finite]))
    found = linprog(cost, A_ub=np.concatenate((-rows.T, rows.T[finite])), b_ub=sides, bounds=(None, None))
    return {0: LP_SOLVED, 2: LP_EMPTY, 3: LP_UNBOUNDED}[found.status], found.fun


def assert_proof(rows: Array, bounds: Array, cost: Array, basis: lp.Basis, empty: bool) -> None:
    """The weights of a basis give the cost from its normals, or zero together with the contradicting bound."""
    d, k = rows.shape
    count = d + 1 if empty else d
    labels, weights = basis.labels[:count], basis.weights[:count]
    named = labels < 2 * k
    assert (weights >= 0.0).all()
    signs = np.where(labels[named] % 2 == 0, 1.0, -1.0)
    total = rows[:, labels[named] // 2] @ (weights[named] * signs)
    if empty:
        low, high = bounds[1] - bounds[0], bounds[0] - bounds[2]
        sides = np.where(labels[named] % 2 == 0, low[labels[named] // 2], high[labels[named] // 2])
        np.testing.assert_allclose(total, 0.0, atol=1e-8)
        assert weights[named] @ sides > 0.0
    else:
        np.testing.assert_allclose(total, cost, atol=1e-8)


@pytest.mark.parametrize("d", [1, 2, 3, 6, 12])
def test_linear_program(d: int) -> None:
    rng = np.random.default_rng(4)
    outcomes = []
    for _ in range(150):
        rows, sides, cost = rng.normal(size=(3 * d + 3, d)), rng.normal(size=3 * d + 3) - 0.3, rng.normal(size=d)
        space, bounds = rows.T.copy(), np.array([np.zeros_like(sides), sides, np.full_like(sides, math.inf)])
        outcome, point, basis = solve(space, bounds, cost)
        found = linprog(cost, A_ub=-rows, b_ub=-sides, bounds=(None, None))
        outcomes.append(outcome)
        assert outcome == {0: LP_SOLVED, 2: LP_EMPTY, 3: LP_UNBOUNDED}[found.status]
        if outcome == LP_SOLVED:
            assert cost @ point == pytest.approx(found.fun, rel=1e-8, abs=1e-9)
            assert (rows @ point >= sides - 1e-9).all()
        if outcome != LP_UNBOUNDED:
            assert_proof(space, bounds, cost, basis, outcome == LP_EMPTY)
    assert LP_SOLVED in outcomes
    assert LP_EMPTY in outcomes


def random_program(rng: np.random.Generator, d: int) -> tuple[Array, Array, Array]:
    k = 2 * d + 3
    bounds = np.array([rng.normal(size=k), -rng.uniform(0.1, 2, k), rng.uniform(0.1, 2, k)])
    bounds[2, rng.uniform(size=k) < 0.15] = math.inf
    return rng.normal(size=(d, k)), bounds, rng.normal(size=d)


@pytest.mark.parametrize("d", [1, 2, 3, 7])
def test_the_bounds_of_the_last_solution_are_a_good_start(d: int) -> None:
    rng = np.random.default_rng(40 + d)
    outcomes = []
    for _ in range(60):
        rows, bounds, cost = random_program(rng, d)
        outcome, _, basis = solve(rows, bounds, cost)
        if outcome != LP_SOLVED:
            continue
        for size in (0.0, 1e-6, 0.1, 3.0):
            moved = bounds + size * rng.uniform(-1, 1, bounds.shape) * [[1], [0], [0]]
            if size == 3.0:  # infinite limits that become finite; the reverse would remove an active bound
                moved[2] = np.minimum(moved[2], 4.0)
            verdict, cold, _ = solve(rows, moved, cost)
            assert verdict == by_scipy(rows, moved, cost)[0]
            outcome, warm, basis = solve(rows, moved, cost, basis)
            outcomes.append(outcome)
            assert outcome == verdict
            if outcome != LP_SOLVED:
                break
            np.testing.assert_allclose(warm, cold, atol=1e-11 * max(1.0, np.abs(cold).max()))
            assert_proof(rows, moved, cost, basis, False)
    assert outcomes.count(LP_SOLVED) > 30


def test_after_an_empty_set_the_start_is_discarded() -> None:
    rows, cost = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([1.0, 1.0])
    bounds = np.array([[0.0, 0.0, 0.0], [0.0, 1.5, 0.0], [1.0, 2.0, 1.0]])  # x <= 1 and x >= 1.5
    outcome, _, basis = solve(rows, bounds, cost)
    assert outcome == LP_EMPTY
    assert {1, 2} <= set(basis.labels)
    assert_proof(rows, bounds, cost, basis, True)
    basis.labels[0] = -1
    bounds[2, 0] = 1.6
    outcome, point, _ = solve(rows, bounds, cost, basis)
    assert outcome == LP_SOLVED
    np.testing.assert_allclose(point, [1.5, 0.0], atol=1e-15)


def test_a_solution_at_the_box_is_unbounded() -> None:
    rows, bounds = np.eye(2), np.array([[0.0, 0.0], [1.0, 1.0], [math.inf, 2.0]])
    outcome, _, basis = solve(rows, bounds, np.array([-1.0, -1.0]))
    assert outcome == LP_UNBOUNDED
    assert (basis.labels[:2] >= 4).sum() == 1
    outcome, point, basis = solve(rows, bounds, np.array([1.0, -1.0]))
    assert outcome == LP_SOLVED
    np.testing.assert_array_equal(point, [1.0, 2.0])
    assert sorted(basis.labels[:2]) == [0, 3]
    # all points of an edge are equally good; the box determines one for any signs of the cost
    one_strip = np.array([[1.0], [1.0]]), np.array([[0.0], [-2.0], [2.0]])
    for sign in (1.0, -1.0):
        outcome, point, basis = solve(*one_strip, np.array([-sign, -sign]))
        assert outcome == LP_SOLVED
        np.testing.assert_allclose(sorted(sign * point), [-2.0, 4.0], atol=1e-14)
        outcome, again, basis = solve(*one_strip, np.array([-sign, -sign]), basis)
        np.testing.assert_allclose(again, point, atol=1e-14)
    # a cost that is constant along an unbounded direction: solved, with a tie
    outcome, point, basis = solve(rows[:, :1].copy(), bounds[:, :1].copy(), np.array([1.0, 0.0]))
    assert outcome == LP_SOLVED
    assert point[0] == 1.0
    assert basis.weights[list(basis.labels[:2]).index(3)] == 0.0


@pytest.mark.parametrize("d", [2, 3, 5])
def test_many_bounds_through_one_corner(d: int) -> None:
    rng = np.random.default_rng(50 + d)
    for _ in range(40):
        rows = rng.integers(-2, 3, (d, 8 * d)).astype(np.float64)
        bounds = np.zeros((3, 8 * d))
        bounds[1] = -rng.integers(0, 2, 8 * d)
        bounds[2] = rng.integers(0, 2, 8 * d)
        cost = rng.integers(-1, 2, d).astype(np.float64)
        outcome, point, basis = solve(rows, bounds, cost)
        verdict, least = by_scipy(rows, bounds, cost)
        assert outcome == verdict
        if outcome == LP_SOLVED:
            assert cost @ point == pytest.approx(least, abs=1e-10)
            assert_proof(rows, bounds, cost, basis, False)
    # the construction of Klee and Minty for long programs: all corners of a cube are visited
    squeezed = np.eye(d) + np.triu(np.full((d, d), 0.3), 1)
    outcome, point, _ = solve(squeezed, np.array([np.zeros(d), np.zeros(d), np.ones(d)]), -squeezed.sum(axis=1))
    assert outcome == LP_SOLVED
    np.testing.assert_allclose(point @ squeezed, 1.0, atol=1e-12)

"""Closed forms of tension distribution, step by step in NumPy."""

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.codes import CLOSED_FORM, IMPROVED_CLOSED_FORM, PUNCTURE
from sagline.kernels.tension.other_methods import _share_near_middle
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.problems import Problem, random_problem
from tests.tiers import extended

share = from_python(_share_near_middle)


def closed_form(problem: Problem) -> Array:
    """Tensions nearest to the middle of the limits."""
    bounds, null = problem
    middle = 0.5 * (bounds[LOW] + bounds[HIGH])
    return np.asarray(bounds[START] + null.T @ (null @ (middle - bounds[START])))


def improved(problem: Problem) -> Array | None:
    """Move the worst cable to its limit and the others to the nearest tensions, until all limits are satisfied."""
    bounds, null = problem
    tensions = closed_form(problem)
    held: list[int] = []
    for _ in range(len(null) + 1):
        miss = np.maximum(bounds[LOW] - tensions, tensions - bounds[HIGH])
        if miss.max() <= 1e-9:
            return tensions
        if len(held) == len(null):
            return None
        worst = int(miss.argmax())
        held.append(worst)
        goal = tensions[held].copy()
        goal[-1] = bounds[LOW, worst] if tensions[worst] < bounds[LOW, worst] else bounds[HIGH, worst]
        step = np.linalg.lstsq(null[:, held].T, goal - tensions[held], rcond=None)[0]
        tensions = tensions + step @ null
    return None


@pytest.mark.parametrize(("m", "r"), [(7, 1), (8, 2), (10, 4)])
def test_closed_and_improved_closed_form(m: int, r: int) -> None:
    rng = np.random.default_rng(m)
    kept = {True: 0, False: 0}
    for trial in range(120):
        problem = random_problem(rng, m, r)
        if trial % 2:
            shift = rng.normal(size=m) * 20.0  # within the row space, in which START must remain
            problem.bounds[START] += shift - problem.null.T @ (problem.null @ shift)
        tension = np.full(m, np.nan)
        first = closed_form(problem)
        assert share(CLOSED_FORM, *problem, memory(), tension) == problem.keeps_limits(first, 1e-10)
        np.testing.assert_allclose(tension, first, atol=1e-10)
        expected = improved(problem)
        found = share(IMPROVED_CLOSED_FORM, *problem, memory(), tension)
        assert found == (expected is not None)
        kept[found] += 1
        if expected is not None:
            np.testing.assert_allclose(tension, expected, atol=1e-8)
    assert min(kept.values()) > 5


@extended
def test_puncture_moves_towards_the_minimum_norm_up_to_the_limits() -> None:
    rng = np.random.default_rng(3)
    for _ in range(80):
        problem = random_problem(rng, 8, 2)
        tension = np.full(8, np.nan)
        there = improved(problem)
        if not share(PUNCTURE, *problem, memory(), tension):
            assert there is None
            continue
        assert there is not None
        start = problem.bounds[START]
        shares = np.linspace(0.0, 1.0, 200001)[:, None]
        way = start + shares * (there - start)
        inside = ((way >= problem.bounds[LOW] - 1e-9) & (way <= problem.bounds[HIGH] + 1e-9)).all(axis=1)
        np.testing.assert_allclose(tension, way[inside.argmax()], atol=2e-5 * np.abs(there - start).max())
        assert problem.keeps_limits(tension, 1e-9)


def test_puncture_is_the_minimum_norm_if_it_is_feasible() -> None:
    problem = random_problem(np.random.default_rng(4), 8, 2)
    problem.bounds[LOW], problem.bounds[HIGH] = problem.bounds[START] - 1.0, problem.bounds[START] + 9.0
    tension = np.full(8, np.nan)
    assert share(PUNCTURE, *problem, memory(), tension)
    np.testing.assert_array_equal(tension, problem.bounds[START])

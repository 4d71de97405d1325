"""Capacity margins compared with linear programs along many directions."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import linprog

from sagline.core.arrays import Array
from sagline.kernels.tension import margin
from tests.kernels.compiled import from_python, memory
from tests.tiers import wide

capacity_margin = from_python(margin.zonotope_margin)
next_choice = from_python(margin._next_choice)
extend = from_python(margin._extend_frame)
complete = from_python(margin._complete_frame)
support = from_python(margin._zonotope_reach)


@pytest.mark.parametrize(("count", "m"), [(1, 4), (2, 5), (5, 8), (3, 3), (0, 2)])
def test_all_choices_in_order(count: int, m: int) -> None:
    chosen = np.arange(count)
    found = [tuple(chosen)]
    for _ in range(100):
        before = chosen.copy()
        changed = next_choice(chosen, m)
        if changed < 0:
            break
        assert changed == int((before != chosen).argmax())  # the previous columns are still in the frame
        found.append(tuple(chosen))
    assert found == list(itertools.combinations(range(m), count))


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_frames_of_a_choice_are_completed_by_the_normal(n: int) -> None:
    rng = np.random.default_rng(n)
    matrix = rng.normal(size=(n, 8))
    frame, triangle = np.full((n, n), np.nan), np.full((n, n), np.nan)
    chosen, held = np.arange(n - 1), 0
    for _ in range(40):
        held = extend(matrix, chosen, held, frame, triangle)
        assert held == n - 1
        complete(frame, triangle)
        np.testing.assert_allclose(frame @ frame.T, np.eye(n), atol=1e-14)
        np.testing.assert_allclose(frame[n - 1] @ matrix[:, chosen], 0.0, atol=1e-13)
        changed = next_choice(chosen, 8)
        if changed < 0:
            break
        held = min(held, changed)


def test_dependent_columns_span_no_face() -> None:
    matrix = np.random.default_rng(1).normal(size=(4, 6))
    matrix[:, 1] = -2.0 * matrix[:, 0]
    frame, triangle = np.full((4, 4), np.nan), np.full((4, 4), np.nan)
    assert extend(matrix, np.array([0, 1, 2]), 0, frame, triangle) == 1
    assert extend(matrix, np.array([0, 2, 3]), 1, frame, triangle) == 3


def test_the_largest_force_along_a_normal() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        matrix, normal = rng.normal(size=(3, 6)), rng.normal(size=3)
        low, high = rng.uniform(0, 1, 6), rng.uniform(1, 5, 6)
        ends = np.array([normal @ matrix * low, normal @ matrix * high])
        expected = ends.max(axis=0).sum(), -ends.min(axis=0).sum()
        np.testing.assert_allclose(support(matrix, low, high, normal), expected, rtol=1e-13)
    high[2] = math.inf
    forward, backward = support(matrix, low, high, normal)
    assert (forward if normal @ matrix[:, 2] > 0.0 else backward) == math.inf
    assert math.isfinite(backward if normal @ matrix[:, 2] > 0.0 else forward)
    matrix[:, 2] -= normal * (normal @ matrix[:, 2]) / (normal @ normal)  # in the face, its limits have no effect
    assert np.isfinite(support(matrix, low, high, normal)).all()


def reach(matrix: Array, needed: Array, low: Array, high: Array, way: Array) -> float:
    found = linprog(
        np.append(np.zeros(len(low)), -1.0),
        A_eq=np.column_stack((matrix, -way)),
        b_eq=needed,
        bounds=[*zip(low, high, strict=True), (0, None)],
    )
    assert found.status == 0
    return float(-found.fun)


@pytest.mark.parametrize(("n", "m", "translations"), wide([(3, 4, 1), (2, 4, 2), (3, 5, 2)]))
def test_the_least_reach_of_all_directions(n: int, m: int, translations: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(5):
        matrix = rng.normal(size=(n, m))
        low, high = rng.uniform(0, 1, m), rng.uniform(3, 9, m)
        needed = matrix @ (0.5 * (low + high))
        found = capacity_margin(matrix, needed, low, high, translations, memory())
        angles = np.linspace(0.0, 2.0 * np.pi, 361) if translations == 2 else np.array([0.0, np.pi])
        ways = np.zeros((len(angles), n))
        ways[:, 0] = np.cos(angles)
        if translations == 2:
            ways[:, 1] = np.sin(angles)
        least = min(reach(matrix, needed, low, high, way) for way in ways)
        assert found <= least * (1 + 1e-9)
        assert found >= least * (1 - (1e-3 if translations == 2 else 1e-9))


def test_outside_the_margin_is_negative() -> None:
    # a square of forces 0..2 N; 1 N beyond its right side
    assert capacity_margin(np.eye(2), np.array([3.0, 1.0]), np.zeros(2), np.full(2, 2.0), 2, memory()) == -1.0
    assert capacity_margin(np.eye(2), np.array([0.5, 1.0]), np.zeros(2), np.full(2, 2.0), 2, memory()) == 0.5

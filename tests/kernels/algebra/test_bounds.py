"""Bounds and their labels, compared with plain NumPy."""

import math

import numpy as np

from sagline.core.arrays import Array
from sagline.kernels.algebra import bounds as s
from tests.kernels.compiled import from_python

largest_bound = from_python(s.largest_bound)
box_radius = from_python(s.box_radius)
inward = from_python(s.inward)
side_of = from_python(s.side_of)
most_violated_bound = from_python(s.most_violated_bound)


def test_largest_number_does_not_count_infinite_limits() -> None:
    limits = np.array([[1.0, -2.0], [0.5, 0.0], [3.0, math.inf]])
    assert largest_bound(limits) == 3.0
    limits[s.START, 1] = -7.0
    assert largest_bound(limits) == 7.0
    limits[s.LOW, 0] = -8.0
    assert largest_bound(limits) == 8.0
    assert box_radius(8.0, limits) == 8e4
    limits[s.HIGH, 1] = 9.0
    assert largest_bound(limits) == 9.0
    assert box_radius(9.0, limits) == 36.0


def test_the_box_contains_the_intersection_of_orthonormal_bounds() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        k = 5
        limits = np.array([rng.normal(size=k), -rng.uniform(0, 1, k), rng.uniform(0, 1, k)])
        # |x| = |x . rows| <= sqrt(k) for orthonormal rows, times the largest distance of a bound from START
        far = math.sqrt(k) * np.abs(limits[1:] - limits[0]).max()
        assert far <= box_radius(largest_bound(limits), limits)


def violations(rows: Array, limits: Array, point: Array) -> Array:
    """Violation of each bound by label."""
    value = limits[s.START] + point @ rows
    return np.column_stack((limits[s.LOW] - value, value - limits[s.HIGH])).ravel()


def test_the_most_violated_bound_is_named() -> None:
    rng = np.random.default_rng(2)
    names = set()
    for _ in range(300):
        d, k = int(rng.integers(1, 6)), int(rng.integers(1, 7))
        rows, point = rng.normal(size=(d, k)), rng.normal(size=d)
        limits = np.array([rng.normal(size=k), -rng.uniform(0, 2, k), rng.uniform(0, 2, k)])
        limits[s.HIGH, rng.uniform(size=k) < 0.2] = math.inf
        gaps = violations(rows, limits, point)
        slack = float(rng.choice([0.0, 0.5]))
        expected = int(np.argmax(gaps)) if gaps.max() > slack else -1
        assert most_violated_bound(rows, limits, point, slack, False) == expected
        names.add(expected)
        ahead = np.flatnonzero(gaps > slack)
        assert most_violated_bound(rows, limits, point, slack, True) == (ahead[0] if len(ahead) else -1)
    assert names >= {-1, 0, 1, 2, 3}


def test_normals_point_inward_and_sides_are_distances() -> None:
    rng = np.random.default_rng(3)
    rows, point = rng.normal(size=(3, 4)), rng.normal(size=3)
    limits = np.array([rng.normal(size=4), -rng.uniform(0, 2, 4), rng.uniform(0, 2, 4)])
    for label, gap in enumerate(violations(rows, limits, point)):
        reached = inward(label) * rows[:, label // 2] @ point
        np.testing.assert_allclose(side_of(limits, label) - reached, gap, atol=1e-15)

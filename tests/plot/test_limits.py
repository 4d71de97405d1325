"""Triangles divided where the limit changes: areas of regions agree with exact ones."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from sagline.core.arrays import Array, Indices
from sagline.plot.geometry import Find, cut_at_limits

LINE = np.array([1.0, 0.6]), 0.8  # a boundary that meets no grid point


def sides(points: Array) -> Indices:
    return np.asarray(points @ LINE[0] > LINE[1], dtype=np.int64)


def quarters(points: Array) -> Indices:
    """Four squares around the middle."""
    across, up = points.T > 0.5
    return np.asarray(2 * across + up, dtype=np.int64)


def areas(corners: Array, codes: Indices, count: int) -> Array:
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    each = 0.5 * np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
    return np.asarray(np.bincount(codes, each, minlength=count), dtype=np.float64)


@pytest.mark.parametrize(("find", "exact"), [(sides, [0.5, 0.5]), (quarters, [0.25] * 4)])
def test_regions_have_their_areas(find: Find, exact: list[float]) -> None:
    points = np.random.default_rng(3).uniform(0.0, 1.0, (60, 2))
    points = np.concatenate((points, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]))
    triangles = Delaunay(points).simplices
    codes = find(points)
    corners, limits = cut_at_limits(points, triangles, codes, find)
    assert areas(corners, limits, len(exact)).sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(areas(corners, limits, len(exact)), exact, atol=0.01)


def test_triangles_of_one_limit_are_not_divided() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    corners, limits = cut_at_limits(points, np.array([[0, 1, 2]]), np.array([4, 4, 4]), sides)
    np.testing.assert_array_equal(corners, points[None])
    assert limits.tolist() == [4]

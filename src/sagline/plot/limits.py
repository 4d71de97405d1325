"""Division of triangles where the limit of a workspace changes, so that regions of one limit have smooth borders."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from sagline.core.arrays import Array, Indices

BISECTIONS: Final = 5  # number of bisections that locate a border on an edge
Find = Callable[[Array], Indices]


def cut_at_limits(points: Array, triangles: Indices, limit: Indices, find: Find) -> tuple[Array, Indices]:
    """Divide triangles so that each part has a single limit.

    `points`: (V, d); `triangles`: (T, 3); `limit`: code of the limit at each point (V,); `find`: function that gives
    the codes of points (n, d). Returns the corners (U, 3, d) and the codes (U,).
    """
    codes = limit[triangles]
    mixed = (codes != codes[:, :1]).any(axis=1)
    corners, whole = [points[triangles[~mixed]]], [codes[~mixed, 0]]
    if mixed.any():
        triangles = triangles[mixed]
        edges = np.sort(np.stack((triangles, np.roll(triangles, -1, axis=1)), axis=2), axis=2)  # (T, 3, 2)
        pairs, place = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        borders = _borders(points[pairs], limit[pairs], find)[place.reshape(-1, 3)]
        for tips, middles, own in _pieces(points[triangles], borders, limit[triangles]):
            corners.append(np.stack((tips, *middles), axis=1))
            whole.append(own)
    return np.concatenate(corners), np.concatenate(whole)


def _borders(ends: Array, codes: Indices, find: Find) -> Array:
    """Points of the edges `ends` (E, 2, d) at which the limit changes, by bisection; middles of all other edges."""
    ends = ends.copy()
    change = np.flatnonzero(codes[:, 0] != codes[:, 1])
    for _ in range(BISECTIONS):
        middle = 0.5 * (ends[change, 0] + ends[change, 1])
        there = np.where(find(middle) == codes[change, 0], 0, 1)
        ends[change, there] = middle
    return np.asarray(0.5 * (ends[:, 0] + ends[:, 1]))


def _pieces(tips: Array, borders: Array, codes: Indices) -> list[tuple[Array, tuple[Array, Array], Indices]]:
    """Six parts of each triangle, between its corners, the borders on its edges and a common point."""
    # If a triangle has two limits, the common point is midway between both borders, so that the border is straight.
    changes = codes != np.roll(codes, -1, axis=1)
    weight = changes[:, :, None] / changes.sum(axis=1)[:, None, None]
    common = (weight * borders).sum(axis=1)
    return [
        (tips[:, k], pair, codes[:, k])
        for k in range(3)
        for pair in ((borders[:, k], common), (common, borders[:, k - 1]))
    ]

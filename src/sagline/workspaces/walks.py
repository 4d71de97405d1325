"""Walks between the components of a set on a grid: paths of positions in the set, closer together than nodes.

A thin part of a set can be between the nodes of a grid; then the inside nodes form several components although the set
is connected. Such a part is found by a path from one component to another, along the nodes with the highest values.
Positions of the path that are outside the set are moved into it, across the path. The path is divided until all
positions are in the set and close together.
"""

from __future__ import annotations

from heapq import heappop, heappush
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Indices
from sagline.workspaces.grid import Grid, Level, level_values

FINE: Final = 32  # neighboring positions of a walk are closer than the cell's longest edge divided by this number
MOST_WALKS: Final = 256  # largest number of components for which walks are searched
_MOST_NODES: Final = 4096  # largest number of nodes that are examined
_MOST_DIVISIONS: Final = 24  # largest number of divisions of a path; a successful walk takes 6 to 8
_TRIALS: Final = 40  # largest number of steps of a position toward the set
_SMALLEST: Final = 1e-4  # smallest step, relative to the distance between neighboring positions

_NEIGHBORS: Final = np.array([offset for offset in product((-1, 0, 1), repeat=3) if any(offset)])
_DIRECTIONS: Final = _NEIGHBORS / np.linalg.norm(_NEIGHBORS, axis=1)[:, None]

Labels = NDArray[np.int32]
_Node = tuple[int, int, int]


def labels_of(level: Level, grid: Grid) -> tuple[Labels, int, tuple[Array, ...]]:
    """Component label of each node (0 outside, 1 to count inside), the count, and the walks that were found."""
    from scipy.ndimage import binary_erosion, label  # the import takes a fifth of a second

    nodes, count = label(grid.inside)  # as in the net, nodes are connected along the axes
    if count < 2:
        return nodes, count, ()
    low, high = (np.array([axis[end] for axis in grid.axes]) for end in (0, -1))

    def in_box(positions: Array) -> Array:
        return level(np.clip(positions, low, high))

    sizes, names, walks = np.bincount(nodes.ravel(), minlength=count + 1), np.arange(count + 1), []
    around = np.argwhere(nodes.astype(np.bool_) & ~binary_erosion(nodes, np.ones((3, 3, 3))))  # nodes on the surface
    labels = nodes[tuple(around.T)]
    for one in (1 + np.argsort(sizes[1:], kind="stable"))[:-1][:MOST_WALKS].tolist():
        chain = _widest_path(grid.values, nodes, around[labels == one], np.flatnonzero(names != names[one]))
        walk = None if chain is None else _walk(in_box, grid.positions(chain), grid.step)
        if chain is not None and walk is not None:
            walks.append(walk)
            names[names == names[one]] = names[nodes[tuple(chain[-1])]]
    kept, place = np.unique(names, return_inverse=True)
    return place.astype(np.int32)[nodes], len(kept) - 1, tuple(walks)


def _widest_path(values: Array, labels: Labels, start: Indices, ends: Indices) -> Indices | None:
    """Path (K, 3) from node `start` to another component, with the highest possible lowest value; None if not found."""
    shape, others = values.shape, set(ends.tolist()) - {0}
    before: dict[_Node, _Node | None] = dict.fromkeys((x, y, z) for x, y, z in start.tolist())
    waiting: list[tuple[float, _Node]] = [(-np.inf, node) for node in before]
    for _ in range(_MOST_NODES + 2 * len(start)):
        if not waiting:
            break
        _, node = heappop(waiting)
        if labels[node] in others:
            chain = [node]
            while (back := before[chain[-1]]) is not None:
                chain.append(back)
            return np.array(chain[::-1])
        for dx, dy, dz in _NEIGHBORS.tolist():
            near = node[0] + dx, node[1] + dy, node[2] + dz
            in_grid = all(0 <= place < size for place, size in zip(near, shape, strict=True))
            if in_grid and near not in before and values[near] > -np.inf:
                before[near] = node
                heappush(waiting, (-values[near], near))
    return None


def _walk(level: Level, path: Array, step: Array) -> Array | None:
    """Closely spaced positions (K, 3) in the set along `path`. The ends of `path` are in the set. None if not found."""
    turn = np.random.default_rng(0)
    path, at = path.copy(), level_values(level, path).copy()
    if len(path) > 2:
        along = path[2:] - path[:-2]
        path[1:-1], at[1:-1] = _moved_inside(level, path[1:-1], at[1:-1], along, turn)
        path = path[at >= 0.0]
    share = 0.5
    for _ in range(_MOST_DIVISIONS):
        along = np.diff(path, axis=0)
        k = np.flatnonzero(np.linalg.norm(along, axis=1) > step.max() / FINE)
        if not len(k):
            return path
        between = path[k] + share * along[k]
        between, at = _moved_inside(level, between, level_values(level, between), along[k], turn)
        found = at >= 0.0
        path = np.insert(path, k[found] + 1, between[found], axis=0)
        share = 0.5 if found.all() else turn.uniform(0.2, 0.8)  # try another position after a division has failed
    return None


def _moved_inside(
    level: Level, points: Array, at_points: Array, along: Array, turn: np.random.Generator
) -> tuple[Array, Array]:
    """`points` (N, 3), moved across the directions `along` (N, 3) until `level` is nonnegative; values (N,) there."""
    points, at_points = points.copy(), at_points.copy()
    size = np.linalg.norm(along, axis=1)
    unit = along / np.maximum(size, np.finfo(np.float64).tiny)[:, None]
    step = 0.5 * size
    for _ in range(_TRIALS):
        k = np.flatnonzero((at_points < 0.0) & (step > _SMALLEST * size))
        if not len(k):
            break
        tried = Rotation.random(rng=turn).apply(_DIRECTIONS)
        across = tried - (unit[k] @ tried.T)[:, :, None] * unit[k, None]
        places = points[k, None] + step[k, None, None] * across
        values = level_values(level, places.reshape(-1, 3)).reshape(len(k), -1)
        best = values.argmax(axis=1)
        found = values[np.arange(len(k)), best]
        better = found > at_points[k]
        points[k[better]] = places[np.arange(len(k)), best][better]
        at_points[k] = np.maximum(found, at_points[k])
        step[k[~better]] *= 0.5
    return points, at_points

"""Proofs that no path in the box of a workspace connects two of its components."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Final

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.workspaces.pose_box_proof import OUTSIDE
from sagline.robot.pose import Pose
from sagline.robot.reach import ROUNDING
from sagline.workspaces.criterion import Criterion
from sagline.workspaces.levels import Levels
from sagline.workspaces.proof import Prover, check_provable
from sagline.workspaces.surface import Components

PARTS: Final = (1, 2, 4)  # numbers of parts into which each edge of a cell is divided; they are tried in this order
MOST_CELLS: Final = 1 << 25  # largest number of parts; they take 33 MB
MOST_BOXES: Final = 60_000  # largest number of boxes; their proofs take about a second
MOST_LAYERS: Final = 16  # largest number of layers of cells around a component
_AROUND: Final = np.array(list(product((-1, 0, 1), repeat=3)))

Exclude = Callable[[Array, Array], Flags]
"""A function of centers (N, 3) and half edges (3,) of boxes [m]: True (N,) if no position of a box is in the set."""


def separated(components: Components, exclude: Exclude | None) -> Flags:
    """Mask (K,): True for a component that a closed layer of excluded boxes separates from all other components."""
    # A search starts at each component and continues outward until it meets excluded cells. The component is separated
    # if the search ends before it reaches another component. If not, the search is repeated with smaller cells.
    found = np.zeros(components.count, dtype=np.bool_)
    if exclude is not None:
        search = _Search(components, exclude)
        found[1:] = [search.is_enclosed(k) for k in range(1, components.count)]  # the first component is the largest
        found[0] = found[1:].all()
    return locked(found)


class _Search:
    """Searches that start at components. One limit applies to the number of boxes of all searches together."""

    def __init__(self, components: Components, exclude: Exclude) -> None:
        self._components, self._exclude = components, exclude
        self._left = MOST_BOXES
        cells = components.nodes.size
        self._parts = [parts for parts in PARTS if parts**3 * cells <= MOST_CELLS]

    def is_enclosed(self, one: int) -> bool:
        """True if the search from a component ends before it reaches another component."""
        nodes = self._components.nodes
        own, others = np.argwhere(nodes == one), np.argwhere((nodes >= 0) & (nodes != one))
        distance, nearest = KDTree(others).query(own)
        start, end = own[distance.argmin()], others[nearest[distance.argmin()]]
        return any(
            self._excluded(self._on_line(start, end, parts), parts).any() and self._is_enclosed(one, parts)
            for parts in self._parts
        )

    def _on_line(self, start: Indices, end: Indices, parts: int) -> Indices:
        """Cells (K, 3) that the line between the nodes `start` and `end` crosses."""
        shares = np.linspace(0.0, 1.0, 2 + 2 * parts * int(np.abs(end - start).max()))[1:-1, None]
        cells = np.floor(parts * (start + shares * (end - start))).astype(np.int64)
        return np.asarray(np.minimum(cells, parts * (np.array(self._components.nodes.shape) - 1) - 1))

    def _is_enclosed(self, one: int, parts: int) -> bool:
        """Same as `is_enclosed`, with the edges of the cells divided into `parts` parts."""
        own = self._components.nodes == one
        reached, other = _cells_at(own, parts), _cells_at((self._components.nodes >= 0) & ~own, parts)
        layer = _beside(np.argwhere(reached), reached)
        for _ in range(parts * MOST_LAYERS):
            if not len(layer):
                return True
            if len(layer) > self._left or other[tuple(layer.T)].any():
                return False
            reached[tuple(layer.T)] = True
            layer = _beside(layer[~self._excluded(layer, parts)], reached)
        return False

    def _excluded(self, cells: Indices, parts: int) -> Flags:
        """Mask of the cells (K, 3) that are excluded."""
        self._left -= len(cells)
        step = np.array([(axis[-1] - axis[0]) / (len(axis) - 1) for axis in self._components.axes]) / parts
        low = np.array([axis[0] for axis in self._components.axes])
        return self._exclude(low + (cells + 0.5) * step, 0.5 * (1.0 + ROUNDING) * step)


def _beside(cells: Indices, asked: Flags) -> Indices:
    """Neighbors (K, 3) of `cells` across faces, edges and corners, except the cells in the mask `asked`."""
    near = (cells[:, None] + _AROUND).reshape(-1, 3)
    near = near[((near >= 0) & (near < asked.shape)).all(axis=1)]
    near = near[~asked[tuple(near.T)]]
    return np.stack(np.unravel_index(np.unique(np.ravel_multi_index(tuple(near.T), asked.shape)), asked.shape), axis=1)


def _cells_at(nodes: Flags, parts: int) -> Flags:
    """Mask of the parts of cells: True if a corner of the part is in `nodes`, or if all nodes of its cell are."""
    inner, at = nodes, np.zeros([parts * (count - 1) for count in nodes.shape], dtype=np.bool_)
    for axis in range(3):
        inner = np.asarray(np.logical_and(*(np.delete(inner, end, axis=axis) for end in (0, -1))))
    places = parts * np.argwhere(nodes)[:, None] - np.array(list(product((0, 1), repeat=3)))
    places = places[((places >= 0) & (places < at.shape)).all(axis=2)]
    at[tuple(places.T)] = True
    for axis in range(3):
        inner = np.repeat(inner, parts, axis=axis)
    return at | inner


def exclusion(levels: Levels) -> Exclude | None:
    """Function that proves boxes to be outside the workspace by margin and criteria; None if none is implemented."""
    turned, robot = levels.orientations, levels.robot
    vectors = Rotation.from_quat(turned.quaternion).as_rotvec()
    prover = _prover(levels) if not vectors.any() or levels.wrenches.accelerations[1] == 0.0 else None
    criteria = [one for one in levels.criteria if type(one).excluded is not Criterion.excluded]
    if prover is None and not criteria:
        return None

    def exclude(centers: Array, half: Array) -> Flags:
        found = np.zeros((len(turned), len(centers)), dtype=np.bool_)
        places = levels.in_plane(centers)
        edges = half.copy()
        if levels.held is not None:
            edges[levels.held[0]] = 0.0
        for k, own in enumerate(found):
            rows = turned.at(places, k)
            if prover is not None:
                own |= prover.verdicts(places, edges, vectors[k], ROUNDING) == OUTSIDE
            for one in criteria:
                own |= one.excluded(robot, Pose._adopt(rows[:, :3], rows[:, 3:]), edges)
        return np.asarray(found.any(axis=0) if turned.need == "all" else found.all(axis=0))

    return exclude


def _prover(levels: Levels) -> Prover | None:
    """Prover that uses the margin; None if no proofs are implemented for the robot."""
    try:
        check_provable(levels.robot)
    except InvalidValueError:
        return None
    return Prover(levels.robot, levels.wrenches, levels.model)

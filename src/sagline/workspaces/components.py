"""The separate pieces of a set, as its grid and its net see them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arrays import Array, checked, locked
from sagline.core.numbers import counted, n
from sagline.core.results import Result
from sagline.workspaces.grid import Grid
from sagline.workspaces.surface import Indices

_TOLD: Final = 8  # volumes that are printed


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Components(Result):
    """The separate pieces of a set, the largest first; a cavity belongs to the piece around it.

    Attributes:
        volume: Of each piece, as of the whole [m^3], shape (K,).
        vertices: The piece of each vertex of the surface, shape (V,).
        x: Coordinates of the nodes of the grid that tells pieces apart [m], shape (nx,).
        y: The same along y, shape (ny,).
        z: The same along z, shape (nz,).
        nodes: The piece of each node, -1 outside all of them, shape (nx, ny, nz).
    """

    volume: Array
    vertices: NDArray[np.int32]
    x: Array
    y: Array
    z: Array
    nodes: NDArray[np.int32]

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.volume)

    def __str__(self) -> str:
        """How many there are, and how large."""
        sizes = ", ".join(n(volume) for volume in self.volume[:_TOLD])
        more = ", …" * (self.count > _TOLD)
        return f"{counted(self.count, 'piece')}" + f", volume {sizes}{more}" * (self.count > 0)

    def label(self, position: ArrayLike) -> NDArray[np.int32]:
        """Which piece positions belong to, to within a cell of the grid.

        Args:
            position: Positions [m], shape (..., 3), each in the set.

        Returns:
            Index of the piece, that of the nearest node of the cell which is in one, shape (...,); -1 where the cell
            has no such node.

        Raises:
            InvalidValueError: If a position is no such numbers.
        """
        given = checked(position, "position", "m", shape=(3,))
        axes = (self.x, self.y, self.z)
        shares = [np.interp(given[..., i], axis, np.arange(len(axis))) for i, axis in enumerate(axes)]
        lower = [np.minimum(share.astype(np.int64), len(axis) - 2) for share, axis in zip(shares, axes, strict=True)]
        best = np.full(given.shape[:-1], np.inf)
        labels = np.full(given.shape[:-1], -1, dtype=np.int32)
        for corner in np.ndindex(2, 2, 2):
            node = [low + up for low, up in zip(lower, corner, strict=True)]
            found = self.nodes[tuple(node)]
            away = sum((share - at) ** 2 for share, at in zip(shares, node, strict=True))
            nearer = (found >= 0) & (away < best)
            best, labels = np.where(nearer, away, best), np.where(nearer, found, labels).astype(np.int32)
        beyond = [(given[..., i] < axis[0]) | (given[..., i] > axis[-1]) for i, axis in enumerate(axes)]
        return np.where(np.logical_or.reduce(beyond), -1, labels).astype(np.int32)


def components_of(grid: Grid, inner: Indices, faces: Indices, volumes: Array) -> Components:
    """The separate pieces of a set.

    Args:
        grid: Its grid.
        inner: The node inside next to each vertex of its surface, shape (V, 3).
        faces: The triangles of the surface, shape (F, 3).
        volumes: What each triangle adds to the volume, with what bulges over it [m^3], shape (F,).

    Returns:
        Components.
    """
    from scipy.ndimage import label  # a third of a second to load

    nodes, count = label(grid.inside)  # neighbors along the axes: as the net joins them
    vertices = nodes[tuple(inner.T)] - 1
    volume = np.bincount(vertices[faces[:, 0]], volumes, minlength=count)
    order = np.argsort(-volume, kind="stable")
    rank = np.empty(count + 1, dtype=np.int32)
    rank[order], rank[-1] = np.arange(count), -1  # -1 last: where a node's number is 0, minus 1
    labels = locked(np.ascontiguousarray(rank[nodes - 1]))
    return Components(locked(volume[order]), locked(rank[vertices]), grid.x, grid.y, grid.z, labels)

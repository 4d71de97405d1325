"""The net of triangles between the nodes of a grid that are inside and those that are not: marching cubes.

Only signs enter: where on its edge a vertex lies is found afterwards, on the exact function. Nodes inside are joined
along the edges of the grid; those outside also across faces and corners, which is what closes the net everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.errors import FileError
from sagline.workspaces.grid import Mask
from sagline.workspaces.surface import Indices


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """Triangles whose vertices lie each on an edge of the grid, or at a node on the border of the grid.

    Attributes:
        inner: The node inside, of the edge of each vertex, shape (V, 3).
        outer: The node outside, shape (V, 3); the same as inner at the border.
        faces: The vertices of each triangle, counterclockwise as seen from outside, shape (F, 3).
        first: Which of the vertices that were merged into it each one was taken from, shape (V,).
    """

    inner: Indices
    outer: Indices
    faces: Indices
    first: Indices


def net_of(inside: Mask) -> Net:
    """The triangles between inside and outside, closed along the border of the grid.

    Args:
        inside: Which nodes are, shape (nx, ny, nz).

    Returns:
        Net; without triangles where no node is inside.

    Raises:
        FileError: If scikit-image is not installed.
    """
    none = np.zeros((0, 3), dtype=np.int64)
    if not inside.any():
        return Net(none, none, none, none[:, 0])
    try:
        from skimage.measure import marching_cubes
    except ModuleNotFoundError:
        raise FileError.not_installed("scikit-image", "Workspaces need it", "workspace") from None
    padded = np.pad(np.where(inside, np.float32(1.0), np.float32(-1.0)), 1, constant_values=-1.0)
    # the older table knows only signs, and no vertices but those on edges
    middle, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        padded, 0.0, method="lorensen", gradient_direction="ascent"
    )
    twice = np.rint(2.0 * middle).astype(np.int64) - 2
    low, high = twice // 2, (twice + 1) // 2
    is_low = padded[tuple((low + 1).T)] > 0.0
    inner, outer = np.where(is_low[:, None], (low, high), (high, low))
    outer = np.where(((outer < 0) | (outer >= inside.shape)).any(axis=1)[:, None], inner, outer)
    return merged(inner, outer, faces.astype(np.int64), inside.shape)


def merged(inner: Indices, outer: Indices, faces: Indices, shape: tuple[int, ...]) -> Net:
    """A net with one vertex for each edge or node of the grid, and without the triangles that this flattens.

    Args:
        inner: The node inside, of the edge of each vertex, shape (V, 3).
        outer: The node outside; the same as inner where the vertex is at the node.
        faces: The vertices of each triangle, shape (F, 3).
        shape: Nodes of the grid along each axis.

    Returns:
        Net.
    """
    node = np.ravel_multi_index(tuple(np.minimum(inner, outer).T), shape)
    direction = np.abs(outer - inner) @ np.array([1, 2, 3])
    _, first, place = np.unique(4 * node.astype(np.int64) + direction, return_index=True, return_inverse=True)
    faces = place[faces]
    faces = faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]
    return Net(inner[first], outer[first], faces, first)

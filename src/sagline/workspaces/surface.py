"""Closed surfaces of triangles, components of the set inside a surface, and walks between these components.

A thin part of a set can be between the nodes of a grid. The inside nodes then form several components although the set
is connected. A path finds such a thin part: the path leads from one component to another, along the nodes with the
highest values. Positions of the path that are outside the set are moved into it, across the path. The path is divided
until all positions are in the set and close together.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Flags, Indices, checked
from sagline.core.numbers import counted, n
from sagline.core.results import Result, formats
from sagline.workspaces.grid import Grid, Level, level_values


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Surface(Result):
    """Surface of triangles, whose corners are counterclockwise as seen from outside.

    Attributes:
        vertices: Positions [m], shape (V, 3).
        faces: The three vertices of each triangle, shape (F, 3).
    """

    vertices: Array
    faces: Indices

    @property
    def volume(self) -> float:
        """Enclosed volume without cavities [m^3], by the divergence theorem."""
        return float(volumes_of(self.vertices, self.faces).sum())

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(np.linalg.norm(normals_of(self.vertices, self.faces), axis=1).sum())

    @property
    def closed(self) -> bool:
        """True if each edge of a triangle is an edge of exactly one other triangle, in the opposite direction."""
        edges = np.concatenate([self.faces[:, [i, (i + 1) % 3]] for i in range(3)])
        count = len(self.vertices)
        there, back = edges @ [count, 1], edges @ [1, count]
        return len(np.unique(there)) == len(there) and bool(np.array_equal(np.sort(there), np.sort(back)))

    def __str__(self) -> str:
        """Numbers of vertices and triangles, and extent of the surface."""
        counts = f"{counted(len(self.faces), 'triangle')} with {len(self.vertices):,} vertices"
        if not len(self.vertices):
            return counts
        sides = zip(self.vertices.min(axis=0), self.vertices.max(axis=0), strict=True)
        spans = ", ".join(f"{n(low)} to {n(high)}" for low, high in sides)
        return f"{counts}, {'closed' if self.closed else 'open'}, {spans} m"

    def export(self, file: Path | str) -> None:
        """Write the surface to a file atomically, in meters and with z up (GLB: y up, as the format requires).

        Args:
            file: The file: "hull.stl", ".glb" or ".ply"; also ".vtk" or ".vtu" if meshio or PyVista is installed. An
                existing file is replaced.

        Raises:
            FileError: If the suffix is unknown, a package is missing, or the file cannot be written. An existing file
                is then unchanged.
        """
        formats().save(self, file)


def normals_of(vertices: Array, faces: Indices) -> Array:
    """Outward normals (F, 3) of triangles; the length of a normal is the area of its triangle [m^2]."""
    first, second, third = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(np.cross(second - first, third - first) / 2.0)


def volumes_of(vertices: Array, faces: Indices) -> Array:
    """Contribution (F,) of each triangle to the enclosed volume [m^3]: the signed volume of a tetrahedron on it."""
    if not len(faces):
        return np.zeros(0)
    top = vertices.mean(axis=0)  # a reference point near the surface reduces rounding errors
    return np.asarray(np.einsum("fi,fi->f", vertices[faces[:, 0]] - top, normals_of(vertices, faces)) / 3.0)


_TOLD: Final = 8  # largest number of volumes that are printed


def vertex_areas(vertices: Array, faces: Indices) -> Array:
    """Area of the surface that belongs to each vertex, (V,) [m^2]: a third of the triangles at the vertex."""
    areas = np.linalg.norm(normals_of(vertices, faces), axis=1) / 3.0
    return np.asarray(np.bincount(faces.ravel(), np.repeat(areas, 3), minlength=len(vertices)), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Components(Result):
    """The components of a set in decreasing order of volume. A cavity belongs to the component around it.

    Attributes:
        volume: Volume of each component [m^3], shape (K,).
        vertices: Index of the component of each vertex of the surface, shape (V,).
        x: Coordinates of the nodes of the grid that separates the components [m], shape (nx,).
        y: Coordinates of the nodes along y, shape (ny,).
        z: Coordinates of the nodes along z, shape (nz,).
        nodes: Index of the component of each node, -1 outside all components, shape (nx, ny, nz).
        separate: True if it is proved that no path in the box leads from the component to another one, shape (K,).
    """

    volume: Array
    vertices: NDArray[np.int32]
    x: Array
    y: Array
    z: Array
    nodes: NDArray[np.int32]
    separate: Flags

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Coordinates of the nodes along x, y and z [m]."""
        return self.x, self.y, self.z

    @property
    def count(self) -> int:
        """Number of components."""
        return len(self.volume)

    def __str__(self) -> str:
        """Number of components and their volumes."""
        sizes = ", ".join(n(volume) for volume in self.volume[:_TOLD])
        more = ", …" * (self.count > _TOLD)
        return f"{counted(self.count, 'piece')}" + f", volume {sizes}{more}" * (self.count > 0)

    def label(self, position: ArrayLike) -> NDArray[np.int32]:
        """Index of the component in which each position is, with the accuracy of a grid cell.

        Args:
            position: Positions [m], shape (..., 3), each in the set.

        Returns:
            Index of the component, shape (...,). The nearest node of the grid cell that is in a component gives this
            index; -1 if no node of the cell is in a component.

        Raises:
            InvalidValueError: If the positions have another shape.
        """
        given = checked(position, "position", "m", shape=(3,))
        axes = self.axes
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


FINE: Final = 32  # largest distance of neighboring positions of a walk: longest edge of a cell divided by this number
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
    from scipy.ndimage import binary_erosion, label  # this import takes a fifth of a second

    nodes, count = label(grid.inside)  # nodes are connected along the axes, as in the net
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
    """Path (K, 3) from node `start` to another component, with the highest possible minimum; None if not found."""
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
    """Walk: closely spaced positions (K, 3) in the set along `path`, whose ends are in the set. None if not found."""
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
        share = 0.5 if found.all() else turn.uniform(0.2, 0.8)  # after a division has failed, another position is tried
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

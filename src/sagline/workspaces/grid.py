"""Grid of a function of positions with values, refinement and net, and sign changes of the function along lines.

The method of marching cubes gives the net, which depends only on the signs at the nodes. The position of a vertex on
its edge is computed afterwards with the exact function. Two inside nodes are connected if they share an edge of the
grid. Two outside nodes are also connected across faces and corners of cells, so that the net is closed everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.results import Result

Level = Callable[[Array], Array]
"""A function of positions (N, 3) [m] that returns values (N,), >= 0 inside; values may be infinite and may jump."""
Mask = NDArray[np.bool_]

_CELL = tuple(product((0, 1), repeat=3))  # the corners of a cell
_HALVED = tuple(product((0, 1, 2), repeat=3))  # indices of the 27 nodes of a cell after its edges have been halved


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Grid(Result):
    """Values of a function at the nodes of a grid."""

    x: Array  # coordinates of the nodes [m], shape (nx,)
    y: Array  # coordinates of the nodes along y, shape (ny,)
    z: Array  # coordinates of the nodes along z, shape (nz,)
    values: Array  # the function, >= 0 inside, shape (nx, ny, nz)
    # True if the function was evaluated, shape (nx, ny, nz). Other nodes have the value of a neighbor, and only its
    # sign is valid.
    evaluated: Mask

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """The coordinates along x, y and z [m]."""
        return self.x, self.y, self.z

    @property
    def inside(self) -> Mask:
        """Mask of the nodes inside, shape (nx, ny, nz)."""
        return np.asarray(self.values >= 0.0)

    @property
    def step(self) -> Array:
        """Distance between neighboring nodes along each axis [m], shape (3,)."""
        return np.array([(axis[-1] - axis[0]) / (len(axis) - 1) for axis in self.axes])

    def positions(self, nodes: NDArray[np.int64]) -> Array:
        """Positions (N, 3) [m] of nodes, from the indices of the nodes along x, y and z, shape (N, 3)."""
        return np.stack([axis[nodes[:, k]] for k, axis in enumerate(self.axes)], axis=1)


def level_values(level: Level, positions: Array) -> Array:
    """Values (N,) of a level function at positions (N, 3) [m]; raises an error for NaN or another shape."""
    if not len(positions):
        return np.zeros(0)
    values = np.asarray(level(locked(np.ascontiguousarray(positions))), dtype=np.float64)
    if values.shape != (len(positions),):
        allowed = f"shape ({len(positions)},), one value per position"
        raise InvalidValueError("level", f"of shape {values.shape}", allowed, "Correct the function.")
    missing = np.isnan(values)
    if missing.any():
        where = ", ".join(f"{v:.6g}" for v in positions[missing.argmax()])
        step = "Give -inf at a position that is outside for another reason."
        raise InvalidValueError(f"level at ({where}) m", "nan", "a number, or infinite", step)
    return values


def sample_grid(level: Level, low: Array, high: Array, cells: tuple[int, int, int]) -> Grid:
    """Values of `level` at all nodes of a grid of `cells` in a box. `low`, `high`: corners of the box (3,) [m]."""
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True)]
    positions = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    shape = tuple(n + 1 for n in cells)
    return _grid(axes, level_values(level, positions).reshape(shape), np.ones(shape, dtype=np.bool_))


def refine_grid(grid: Grid, level: Level) -> Grid:
    """Grid with half the step of `grid`, evaluated only in cells that the boundary crosses on either grid."""
    axes = [np.interp(np.arange(2 * len(a) - 1) / 2.0, np.arange(len(a)), a) for a in grid.axes]
    nearest = np.ix_(*(np.arange(len(axis)) // 2 for axis in axes))
    fine = _grid(axes, grid.values[nearest], np.zeros([len(axis) for axis in axes], dtype=np.bool_), lock=False)
    fine.evaluated[::2, ::2, ::2] = grid.evaluated
    cells = _crossed_cells(grid.inside, _CELL, 1)
    while True:
        wanted = np.zeros_like(fine.evaluated)
        for part in _views(wanted, _HALVED, 2):
            part |= cells
        nodes = np.argwhere(wanted & ~fine.evaluated)
        if not len(nodes):
            return _grid(axes, fine.values, fine.evaluated)
        where = tuple(nodes.T)
        fine.values[where] = level_values(level, fine.positions(nodes))
        fine.evaluated[where] = True
        cells = _crossed_cells(fine.inside, _HALVED, 2)


def _crossed_cells(inside: Mask, nodes: tuple[tuple[int, ...], ...], stride: int) -> Mask:
    """Mask of the cells that the boundary crosses: they have nodes inside and nodes outside."""
    parts = list(_views(inside, nodes, stride))
    return np.asarray(np.logical_or.reduce(parts) & ~np.logical_and.reduce(parts))


def _views(nodes: Mask, offsets: tuple[tuple[int, ...], ...], stride: int) -> list[Mask]:
    """Eight views of the mask `nodes`, one per cell corner. Each contains the values of all cells at this corner."""
    count = [(n - 1) // stride for n in nodes.shape]
    return [
        nodes[tuple(slice(a, a + stride * (n - 1) + 1, stride) for a, n in zip(offset, count, strict=True))]
        for offset in offsets
    ]


def _grid(axes: list[Array], values: Array, evaluated: Mask, *, lock: bool = True) -> Grid:
    x, y, z = (locked(axis) for axis in axes)
    return Grid(x, y, z, locked(values) if lock else values, locked(evaluated) if lock else evaluated)


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """Net of triangles, with vertices on edges of the grid, or at nodes on the border of the grid."""

    inner: Indices  # for each vertex, the inside node of its edge, shape (V, 3)
    outer: Indices  # for each vertex, the outside node of its edge, shape (V, 3); equal to `inner` at the border
    faces: Indices  # vertices of each triangle, counterclockwise as seen from outside, shape (F, 3)
    first: Indices  # index that each vertex had before equal vertices were merged, shape (V,)


def triangulate(inside: Mask) -> Net:
    """Triangles between inside and outside nodes (nx, ny, nz), closed along the border of the grid."""
    none = np.zeros((0, 3), dtype=np.int64)
    if not inside.any():
        return Net(none, none, none, none[:, 0])
    try:
        from skimage.measure import marching_cubes
    except ModuleNotFoundError:
        raise FileError.not_installed("scikit-image", "Workspaces need it", "workspace") from None
    padded = np.pad(np.where(inside, np.float32(1.0), np.float32(-1.0)), 1, constant_values=-1.0)
    # this older method of the package uses only signs, and places all vertices on edges
    middle, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        padded, 0.0, method="lorensen", gradient_direction="ascent"
    )
    twice = np.rint(2.0 * middle).astype(np.int64) - 2
    low, high = twice // 2, (twice + 1) // 2
    is_low = padded[tuple((low + 1).T)] > 0.0
    inner, outer = np.where(is_low[:, None], (low, high), (high, low))
    outer = np.where(((outer < 0) | (outer >= inside.shape)).any(axis=1)[:, None], inner, outer)
    return merge_vertices(inner, outer, faces.astype(np.int64), inside.shape)


def merge_vertices(inner: Indices, outer: Indices, faces: Indices, shape: tuple[int, ...]) -> Net:
    """Net in which an edge or node of the grid has at most one vertex. Degenerate triangles are removed."""
    node = np.ravel_multi_index(tuple(np.minimum(inner, outer).T), shape)
    direction = np.abs(outer - inner) @ np.array([1, 2, 3])
    _, first, place = np.unique(4 * node.astype(np.int64) + direction, return_index=True, return_inverse=True)
    faces = place[faces]
    faces = faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]
    return Net(inner[first], outer[first], faces, first)


TRIAL = 3  # after this number of steps of regula falsi, a bracket must have an eighth of its width
ITERATIONS = 100  # largest number of steps; bisection at a jump needs about 45, a continuous function 5 to 8


class Brackets(NamedTuple):
    """Two positions on each of N rays, between which a function changes its sign."""

    inner: Array  # position inside [m], shape (N, 3)
    outer: Array  # position outside [m]
    at_inner: Array  # function at `inner`, shape (N,)
    at_outer: Array  # function at `outer`
    found: NDArray[np.bool_]  # True if the function changes its sign within the limit, shape (N,)

    @property
    def k(self) -> Indices:
        """Indices of the rays with a sign change."""
        return np.flatnonzero(self.found)


def brackets(
    level: Level, points: Array, outward: Array, at_points: Array, step: Array, outer_limit: Array, inner_limit: Array
) -> Brackets:
    """Search along rays from `points` (N, 3) [m]: outward from inside points, inward from others. Each step triples."""
    is_inside = at_points >= 0.0
    limit = np.where(is_inside, outer_limit, inner_limit)
    away = np.where(is_inside, 1.0, -1.0)[:, None] * outward
    near, at_near, at_far = points.copy(), at_points.copy(), np.full(len(points), np.nan)
    distance, far = np.minimum(step, limit), points.copy()
    k = np.flatnonzero(limit > 0.0)
    found = np.zeros(len(points), dtype=np.bool_)
    while len(k):
        far[k] = points[k] + distance[k, None] * away[k]
        at_far[k] = level_values(level, far[k])
        found[k] = (at_far[k] >= 0.0) != is_inside[k]
        k = k[~found[k] & (distance[k] < limit[k])]
        near[k], at_near[k] = far[k], at_far[k]
        distance[k] = np.minimum(3.0 * distance[k], limit[k])
    inner, outer = np.where(is_inside[:, None], (near, far), (far, near))
    at_inner, at_outer = np.where(is_inside, (at_near, at_far), (at_far, at_near))
    return Brackets(inner, outer, at_inner, at_outer, found)


def crossings(level: Level, inner: Array, outer: Array, at_inner: Array, at_outer: Array, **limits: float) -> Array:
    """Same as `_crossings_of`, but with one function `level` for all V lines."""
    return _crossings_of(
        lambda _, positions: level_values(level, positions), inner, outer, at_inner, at_outer, **limits
    )


def _crossings_of(
    values: Callable[[Indices, Array], Array],
    inner: Array,
    outer: Array,
    at_inner: Array,
    at_outer: Array,
    *,
    precision: float = 1e-10,
    narrow: float = 1e-12,
) -> Array:
    """Share (V,) of each line that is inside, by regula falsi. The weight of an end that does not move is reduced."""
    # `values` has two arguments, indices of lines and one position on each line, and returns the function of each line.
    # A bracket is bisected if an end value is infinite. A bracket is bisected several times if regula falsi is slower
    # than bisection, for example at jumps. `precision` is relative to the smaller end value. `narrow` is relative to
    # the length of the line. The weights follow Anderson & Björck 1973; the Illinois method would have weights of 1/2.
    low, high = np.zeros(len(inner)), np.ones(len(inner))
    at_low, at_high = at_inner.copy(), at_outer.copy()
    small = np.minimum(at_low, -at_high)
    small = np.where(np.isinf(small), 0.0, precision * small)
    low_stays, high_stays = np.zeros((2, len(inner)), dtype=np.bool_)
    schedule = _BisectionSchedule(len(inner))
    k = np.flatnonzero(at_low > small)
    for _ in range(ITERATIONS):
        if not len(k):
            break
        with np.errstate(invalid="ignore"):
            share = at_low[k] / (at_low[k] - at_high[k])
        halved = schedule.due(k) | np.isinf(at_low[k]) | np.isinf(at_high[k])
        share = low[k] + np.where(halved, 0.5, share) * (high[k] - low[k])
        found = values(k, inner[k] + share[:, None] * (outer[k] - inner[k]))
        is_inside = found >= 0.0
        with np.errstate(invalid="ignore", divide="ignore"):
            weight = 1.0 - found / np.where(is_inside, at_low[k], at_high[k])
        weight = np.where(weight > 0.0, weight, 0.5)
        at_low[k] = np.where(is_inside, found, np.where(low_stays[k], weight * at_low[k], at_low[k]))
        at_high[k] = np.where(~is_inside, found, np.where(high_stays[k], weight * at_high[k], at_high[k]))
        low[k], high[k] = np.where(is_inside, share, low[k]), np.where(is_inside, high[k], share)
        low_stays[k], high_stays[k] = ~is_inside & ~halved, is_inside & ~halved
        schedule.update(k, halved, high[k] - low[k])
        hit = np.abs(found) <= small[k]
        low[k[hit]] = share[hit]
        k = k[~hit & (high[k] - low[k] > narrow)]
    return low


class _BisectionSchedule:
    """Number of bisection steps of each bracket. The number doubles after each trial in which regula falsi was slow."""

    def __init__(self, count: int) -> None:
        self._width = np.ones(count)  # width of the bracket at the start of its trial
        self._steps, self._due = np.zeros((2, count), dtype=np.int64)
        self._next = np.ones(count, dtype=np.int64)

    def due(self, k: Indices) -> NDArray[np.bool_]:
        """True for each bracket of `k` whose next step is a bisection."""
        return np.asarray(self._due[k] > 0)

    def update(self, k: Indices, halved: NDArray[np.bool_], width: Array) -> None:
        """Update the counters of the brackets `k` after a step."""
        self._due[k] = np.maximum(self._due[k] - halved, 0)
        self._steps[k] = np.where(halved, 0, self._steps[k] + 1)
        over = self._steps[k] == TRIAL
        slow = k[over & (width > self._width[k] * 0.5**TRIAL)]
        self._due[slow] = self._next[slow]
        self._next[slow] *= 2
        self._steps[k[over]] = 0
        self._width[k] = np.where(over | halved, width, self._width[k])


def distance_to_box(points: Array, directions: Array, low: Array, high: Array) -> Array:
    """Distances (N,) [m] from `points` (3,) or (N, 3) in a box to its surface, along unit `directions` (N, 3)."""
    walls = np.where(directions > 0.0, high - points, low - points)
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths: Array = np.where(directions != 0.0, walls / directions, np.inf).min(axis=1)
    return lengths.clip(0.0)

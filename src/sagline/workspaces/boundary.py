"""Boundary of the set where a function is nonnegative: surface, volume with an error bar, and components."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, Flags, Indices, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.workspaces.grid import (
    Brackets,
    Grid,
    Level,
    Net,
    brackets,
    crossings,
    distance_to_box,
    level_values,
    merge_vertices,
    refine_grid,
    sample_grid,
    triangulate,
)
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Region
from sagline.workspaces.surface import Components, Surface, labels_of, normals_of, vertex_areas, volumes_of

MOST_CELLS: Final = 128  # along an axis
MOST_HALVED: Final = 256  # largest number of cells along an axis; this gives 17 million nodes, 0.5 GB
MOST_HALVINGS: Final = 3
AT_NODE: Final = 1e-10  # a vertex moves to a node if it is closer to the node than this share of a grid edge
FACES: Final = ("x low", "x high", "y low", "y high", "z low", "z high")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Boundary(Result):
    """Boundary of a set of positions, with volume and components: the result of `boundary`."""

    # The boundary, closed along the faces of the box. Vertices that are not on a face of the box are on the boundary,
    # with an error of at most 1e-10 of a cell.
    surface: Surface
    # Volume of the set within the box [m^3]. The number is the volume that the surface encloses, plus the volume
    # between the flat triangles and the curved boundary.
    volume: float
    # Error bound of the volume [m^3]. The bound neglects parts and gaps that are thinner than two cells of the finest
    # grid.
    volume_error: float
    grid: Grid  # values of the function at the nodes of the grid before refinement
    components: Components  # two parts are one component if a walk between them was found
    # Faces of the box that the set reaches, for example "x low". The set may continue beyond them.
    open_faces: tuple[str, ...]
    evaluations: int  # number of positions at which the function was evaluated


def boundary(
    level: Level, low: ArrayLike, high: ArrayLike, cells: int | tuple[int, int, int] = 32, refine: bool | int = True
) -> Boundary:
    """Boundary, in a box [m], of the set in which `level`, a function of positions (N, 3) [m], is nonnegative."""
    # `level` may have jumps and infinite values, but not NaN. The function is evaluated at the nodes of a grid. `cells`
    # is the number of cells along the longest side, or along each axis. The cells on the boundary are then halved
    # `refine` times. The method of marching cubes gives a closed net of triangles from the signs at the nodes. The
    # vertices of the net are on the edges of the grid. The volume between net and boundary, and the error bound, are
    # computed from the distances of the triangles' centers to the boundary.
    corners = exactly(low, "low", "m", (3,)), exactly(high, "high", "m", (3,))
    for name, a, b in zip("xyz", *corners, strict=True):
        if not a < b:
            raise InvalidValueError(f"box along {name}", f"{a:g} to {b:g} m", "low < high", "Correct low or high.")
    numbers = _cells_of(cells, corners[1] - corners[0])
    most = min(MOST_HALVINGS, (MOST_HALVED // max(numbers)).bit_length() - 1)
    halvings = whole_number(int(refine) if isinstance(refine, bool) else refine, "refine", 0, most)
    count = 0

    def counted(positions: Array) -> Array:
        nonlocal count
        count += len(positions)
        return level(positions)

    first = grid = sample_grid(counted, *corners, numbers)
    for _ in range(halvings):
        grid = refine_grid(grid, counted)
    net, vertices, slope = _place_vertices(triangulate(grid.inside), grid, counted)
    surface = Surface(locked(vertices), locked(net.faces))
    on_box = _faces_on_box(surface, grid)
    open_faces = tuple(name for name, flat in zip(FACES, on_box, strict=True) if flat.any())
    curved = np.flatnonzero(~np.logical_or.reduce(on_box))
    faces = net.faces[curved]
    slopes = _slopes(surface.vertices, faces, net, slope)
    between, errors = _bulge_volumes(counted, surface.vertices, faces, slopes, grid)
    volumes = volumes_of(surface.vertices, surface.faces)
    volumes[curved] += between
    volume, error = float(volumes.sum()), float(errors.sum())
    components = _components_of(grid, labels_of(counted, grid)[0], net.inner, net.faces, volumes)
    return Boundary(surface, volume, error, first, components, open_faces, count)


def _components_of(grid: Grid, nodes: NDArray[np.int32], inner: Indices, faces: Indices, volumes: Array) -> Components:
    """Components of a set, without a proof that they are separate."""
    # Arguments: `grid`; `nodes`, the labels of its nodes, 1 and higher in the set; `inner` and `faces`, the inner nodes
    # and the triangles of the set's net; `volumes` (F,) [m^3] of the triangles.
    count = int(nodes.max())
    vertices = nodes[tuple(inner.T)] - 1
    volume = np.bincount(vertices[faces[:, 0]], volumes, minlength=count)
    order = np.argsort(-volume, kind="stable")
    rank = np.empty(count + 1, dtype=np.int32)
    rank[order], rank[-1] = np.arange(count), -1  # the label 0 (outside) becomes the index -1
    labels = locked(np.ascontiguousarray(rank[nodes - 1]))
    separate = locked(np.full(count, count == 1))
    return Components(locked(volume[order]), locked(rank[vertices]), grid.x, grid.y, grid.z, labels, separate)


INWARD: Final = 0.01  # distance between a vertex and the position at which its slope is computed, relative to a cell


def uncertain_volume(level: Level, surface: Surface, uncertainty: Array, cell: float) -> float:
    """Volume [m^3] between the boundaries of two level functions that differ by `uncertainty` (V,) at vertices."""
    # The slope at a vertex is computed with a position inside the set. cell: edge of a cell [m], which is also the
    # largest distance between the two boundaries.
    k = np.flatnonzero(uncertainty > 0.0)
    if not len(k):
        return 0.0
    areas = normals_of(surface.vertices, surface.faces)
    corners = surface.faces.ravel()
    normals = np.stack([np.bincount(corners, np.repeat(part, 3), len(uncertainty)) for part in areas.T], axis=1)[k]
    sizes = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(np.float64).tiny)[:, None]
    rise = level_values(level, surface.vertices[k] - INWARD * cell * normals / sizes)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(rise > 0.0, INWARD * cell * uncertainty[k] / rise, cell)
    return float(np.minimum(distance, cell) @ vertex_areas(surface.vertices, surface.faces)[k])


def _cells_of(cells: int | tuple[int, int, int], size: Array) -> tuple[int, int, int]:
    """Numbers of cells along each axis."""
    if isinstance(cells, tuple):
        x, y, z = (whole_number(n, "cells", 1, MOST_CELLS) for n in cells)
        return x, y, z
    most = whole_number(cells, "cells", 2, MOST_CELLS)
    x, y, z = (max(1, round(most * part)) for part in (size / size.max()).tolist())
    return x, y, z


def _place_vertices(
    net: Net, grid: Grid, level: Level, *, precision: float = 1e-10, narrow: float = 1e-12
) -> tuple[Net, Array, Array]:
    """Net, its vertices (V, 3) [m] on the exact boundary, and the decrease of the function along its edges [1/m]."""
    inner, outer = grid.positions(net.inner), grid.positions(net.outer)
    at_inner, at_outer = grid.values[tuple(net.inner.T)], grid.values[tuple(net.outer.T)]
    k = np.flatnonzero((net.inner != net.outer).any(axis=1))
    share, slope = np.zeros(len(inner)), np.full(len(inner), np.nan)
    share[k] = crossings(level, inner[k], outer[k], at_inner[k], at_outer[k], precision=precision, narrow=narrow)
    slope[k] = (at_inner[k] - at_outer[k]) / np.linalg.norm(outer[k] - inner[k], axis=1)
    at_node = share <= AT_NODE
    vertices = inner + np.where(at_node, 0.0, share)[:, None] * (outer - inner)
    if not at_node[k].any():
        return net, vertices, slope
    one = merge_vertices(net.inner, np.where(at_node[:, None], net.inner, net.outer), net.faces, grid.values.shape)
    kept = Surface(vertices[one.first], one.faces)
    if not kept.closed:  # a sheet without thickness keeps its two sides
        return net, vertices, slope
    return one, kept.vertices, np.where(at_node, np.nan, slope)[one.first]


def _slopes(vertices: Array, faces: Indices, net: Net, slope: Array) -> Array:
    """Decrease of the function along the normal of each triangle [1/m]: least squares from slopes at the vertices."""
    normals = normals_of(vertices, faces)
    with np.errstate(invalid="ignore", divide="ignore"):
        normals = np.abs(normals) / np.linalg.norm(normals, axis=1)[:, None]
    along = np.abs(net.outer - net.inner).argmax(axis=1)[faces]
    part = np.take_along_axis(normals, along, axis=1)
    known = np.isfinite(slope[faces])
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Array = np.where(known, slope[faces] * part, 0.0).sum(axis=1) / np.where(known, part**2, 0.0).sum(axis=1)
    return found


def _faces_on_box(surface: Surface, grid: Grid) -> list[NDArray[np.bool_]]:
    """Triangles on each face of the box: masks of shape (F,), in the order of `FACES`."""
    corners = surface.vertices[surface.faces]
    return [(corners[:, :, k] == axis[end]).all(axis=1) for k, axis in enumerate(grid.axes) for end in (0, -1)]


MEAN: Final = 3.0 / 4.0  # mean distance between a triangle and a curved boundary, divided by the distance at its center
MISSED: Final = 5.0 / 12.0  # largest relative error of the mean distance
FLAT: Final = 1e-6  # smaller distances, relative to the reach of the search, are ignored


def _bulge_volumes(level: Level, vertices: Array, faces: Indices, slope: Array, grid: Grid) -> tuple[Array, Array]:
    """Volumes (F,) between triangles and boundary [m^3], negative inward, and error bars of these volumes, (F,)."""
    normals = normals_of(vertices, faces)
    area = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(area, np.finfo(np.float64).tiny)[:, None]
    points = vertices[faces].mean(axis=1)
    low, high = (np.array([axis[end] for axis in grid.axes]) for end in (0, -1))
    reach = [np.minimum(grid.step.max(), distance_to_box(points, side * normals, low, high)) for side in (1.0, -1.0)]
    distance = _distances_to_boundary(level, points, normals, slope, reach[0], reach[1])
    found = ~np.isnan(distance)
    volume = np.where(found, MEAN * area * distance, 0.0)
    return volume, area * np.where(found, MISSED * np.abs(distance), np.maximum(*reach))


def _distances_to_boundary(
    level: Level, points: Array, normals: Array, slope: Array, outward: Array, inward: Array
) -> Array:
    """Distances (N,) [m] from `points` (N, 3) to the boundary along `normals`, to a few percent; NaN out of reach."""
    at_points = level_values(level, points)
    reach = np.where(at_points >= 0.0, outward, inward)
    with np.errstate(divide="ignore", invalid="ignore"):
        guess = np.abs(at_points) / slope
    guess = np.where(np.isfinite(guess) & (slope > 0.0), guess, 0.1 * reach)
    distance = np.where(guess <= FLAT * reach, 0.0, np.nan)
    k = np.flatnonzero(guess > FLAT * reach)
    step = np.clip(1.5 * guess[k], 0.01 * reach[k], reach[k])
    ends = brackets(level, points[k], normals[k], at_points[k], step, outward[k], inward[k])
    crossed = np.full((len(k), 3), np.nan)
    crossed[ends.k] = _between(level, ends)
    distance[k] = np.einsum("ni,ni->n", crossed - points[k], normals[k])
    return distance


def _between(level: Level, ends: Brackets) -> Array:
    """Position of the sign change between `ends`: interpolated, or by iteration if a value at an end is infinite."""
    inner, outer, at_inner, at_outer = (part[ends.k] for part in ends[:4])
    with np.errstate(invalid="ignore"):
        share = at_inner / (at_inner - at_outer)
    k = np.flatnonzero(np.isinf(at_inner) | np.isinf(at_outer))
    share[k] = crossings(level, inner[k], outer[k], at_inner[k], at_outer[k], precision=0.01, narrow=0.05)
    return np.asarray(inner + share[:, None] * (outer - inner))


PRECISE: Final = 1e-4  # precision for display, relative to the level at the nearer node; at jumps, to the edge


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Outline(Result):
    """Boundary of a workspace for display, without error bar."""

    surface: Surface  # the boundary, closed along the faces of the box
    margin: Array  # margin at the vertices [N], shape (V,)
    cable: Indices  # limiting cable at each vertex, -1 for none, shape (V,)
    on_box: Flags  # True for triangles on a face of the box, shape (F,)
    open_faces: tuple[str, ...]  # faces of the robot's box that the workspace reaches, for example "x low"
    volume: float  # volume [m^3], or area in a plane [m^2], enclosed by the triangles
    parts: int  # number of components, without a search for walks between components
    grid: Grid  # the level at the nodes

    @property
    def shares(self) -> dict[int, float]:
        """Share of each limiting cable in the boundary outside the faces of the box; the largest is first."""
        areas = vertex_areas(self.surface.vertices, self.surface.faces[~self.on_box])
        k = np.flatnonzero(areas > 0.0)
        cables, place = np.unique(self.cable[k], return_inverse=True)
        sums = np.bincount(place.ravel(), areas[k], minlength=len(cables))
        return {int(cables[i]): float(sums[i] / sums.sum()) for i in np.argsort(-sums, kind="stable")}


def outline(levels: Levels, region: Region) -> Outline:
    """Boundary of the set in which `levels` is nonnegative, computed from the nodes of the grid of `region`."""
    grid = sample_grid(levels, region.low, region.high, region.cells)
    net, vertices, _ = _place_vertices(triangulate(grid.inside), grid, levels, precision=PRECISE, narrow=PRECISE)
    surface = Surface(locked(vertices), locked(net.faces))
    decided = levels.details(vertices)
    on_box = _faces_on_box(surface, grid)
    ends = np.stack((region.low == region.box.low, region.high == region.box.high), axis=1).ravel()
    return Outline(
        surface=surface,
        margin=decided.margin,
        cable=decided.cable,
        on_box=locked(np.logical_or.reduce(on_box)),
        open_faces=tuple(name for name, own, is_box in zip(FACES, on_box, ends, strict=True) if own.any() and is_box),
        volume=float(volumes_of(surface.vertices, surface.faces).sum()) / region.thickness,
        parts=labels_of(levels, grid)[1],
        grid=grid,
    )

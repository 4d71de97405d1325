"""The boundary of a set that a function describes: its surface, its volume with an error bar, its pieces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.workspaces.components import Components, components_of
from sagline.workspaces.crossing import crossings
from sagline.workspaces.grid import Grid, Level, refined, sampled
from sagline.workspaces.marching import Net, merged, net_of
from sagline.workspaces.surface import Indices, Surface, normals_of, volumes_of
from sagline.workspaces.volume import bulge

MOST_CELLS: Final = 128  # along an axis
MOST_HALVED: Final = 256  # along an axis: 17 million nodes, half a gigabyte
MOST_HALVINGS: Final = 3
AT_NODE: Final = 1e-10  # of an edge of the grid: a vertex so near to its node is at it
FACES: Final = ("x low", "x high", "y low", "y high", "z low", "z high")


@dataclass(frozen=True, slots=True, eq=False)
class Boundary(Result):
    """Result of `boundary`.

    Attributes:
        surface: The boundary, closed along the faces of the box; its vertices that are not on those are on the
            boundary to 1e-10 of a cell.
        volume: Of the set within the box [m^3]: that of the surface, and of what bulges between its vertices.
        volume_error: By how much the volume can be wrong [m^3], but for parts of the set, and gaps in it, that are
            thinner than two cells of the finest grid.
        grid: The function at the nodes of the grid, before cells were halved.
        components: The separate pieces of the set.
        open_faces: Faces of the box that the set reaches, "x low" for instance: it may go on beyond them.
        evaluations: At how many positions the function was evaluated.
    """

    surface: Surface
    volume: float
    volume_error: float
    grid: Grid
    components: Components
    open_faces: tuple[str, ...]
    evaluations: int


class _Counted:
    """A level function, and at how many positions it has been evaluated."""

    def __init__(self, level: Level) -> None:
        self._level = level
        self.count = 0

    def __call__(self, positions: Array) -> Array:
        self.count += len(positions)
        return self._level(positions)


def boundary(
    level: Level,
    low: ArrayLike,
    high: ArrayLike,
    cells: int | tuple[int, int, int] = 32,
    refine: bool | int = True,
) -> Boundary:
    """The boundary of the set where a function of positions is not negative, within a box.

    The function is evaluated at the nodes of a grid, then at those of half its step in cells that the boundary passes
    through. Marching cubes on the signs gives a closed net of triangles, of which each vertex is found on its edge of
    the grid, where the function changes its sign. How far the triangles' middles are from the boundary gives the
    volume between, and with it the error bar.

    Args:
        level: The function, >= 0 inside, of positions [m], shape (N, 3); values of shape (N,), which may be infinite
            but not NaN, and may jump.
        low: Lower corner of the box [m], shape (3,).
        high: Upper corner of the box [m], shape (3,).
        cells: How many cells along the longest side of the box, 2 to 128; the others have as many as keep cells near
            cubes. Or how many along each axis.
        refine: How many times to halve the step in cells that the boundary passes through, as long as no more than 256
            cells stand along an axis; True for once.

    Returns:
        Boundary.

    Raises:
        InvalidValueError: If the box is empty, an argument is out of range, or the function gives NaN.
        FileError: If scikit-image is not installed.
    """
    corners = exactly(low, "low", "m", (3,)), exactly(high, "high", "m", (3,))
    for name, a, b in zip("xyz", *corners, strict=True):
        if not a < b:
            raise InvalidValueError(f"box along {name}", f"{a:g} to {b:g} m", "low < high", "Correct low or high.")
    numbers = _cells_of(cells, corners[1] - corners[0])
    most = min(MOST_HALVINGS, (MOST_HALVED // max(numbers)).bit_length() - 1)
    halvings = whole_number(int(refine) if isinstance(refine, bool) else refine, "refine", 0, most)
    counted = _Counted(level)
    first = grid = sampled(counted, *corners, numbers)
    for _ in range(halvings):
        grid = refined(grid, counted)
    net, vertices, slope = placed(net_of(grid.inside), grid, counted)
    surface = Surface(locked(vertices), locked(net.faces))
    on_box = faces_on_box(surface, grid)
    open_faces = tuple(name for name, flat in zip(FACES, on_box, strict=True) if flat.any())
    curved = np.flatnonzero(~np.logical_or.reduce(on_box))
    faces = net.faces[curved]
    between = bulge(counted, surface.vertices, faces, _slopes(surface.vertices, faces, net, slope), grid)
    volumes = volumes_of(surface.vertices, surface.faces)
    volumes[curved] += between.volume
    volume, error = float(volumes.sum()), float(between.error.sum())
    components = components_of(grid, net.inner, net.faces, volumes)
    return Boundary(surface, volume, error, first, components, open_faces, counted.count)


def _cells_of(cells: int | tuple[int, int, int], size: Array) -> tuple[int, int, int]:
    """Numbers of cells along each axis."""
    if isinstance(cells, tuple):
        x, y, z = (whole_number(n, "cells", 1, MOST_CELLS) for n in cells)
        return x, y, z
    most = whole_number(cells, "cells", 2, MOST_CELLS)
    x, y, z = (max(1, round(most * part)) for part in (size / size.max()).tolist())
    return x, y, z


def placed(
    net: Net, grid: Grid, level: Level, *, precision: float = 1e-10, narrow: float = 1e-12
) -> tuple[Net, Array, Array]:
    """Vertices on the exact boundary.

    Args:
        net: Triangles between the nodes of the grid.
        grid: The function there.
        level: The function.
        precision: As of `crossings`.
        narrow: Likewise.

    Returns:
        The net, in which vertices at one node are one; where its vertices are [m], shape (V, 3); and how fast the
        function falls along the edge of each [1/m], shape (V,), NaN where that is not known.
    """
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
    one = merged(net.inner, np.where(at_node[:, None], net.inner, net.outer), net.faces, grid.values.shape)
    kept = Surface(vertices[one.first], one.faces)
    if not kept.closed:  # a sheet without thickness: its two sides stay apart
        return net, vertices, slope
    return one, kept.vertices, np.where(at_node, np.nan, slope)[one.first]


def _slopes(vertices: Array, faces: Indices, net: Net, slope: Array) -> Array:
    """How fast the function falls along the normal of each triangle, by least squares from its vertices' edges."""
    normals = normals_of(vertices, faces)
    with np.errstate(invalid="ignore", divide="ignore"):
        normals = np.abs(normals) / np.linalg.norm(normals, axis=1)[:, None]
    along = np.abs(net.outer - net.inner).argmax(axis=1)[faces]
    part = np.take_along_axis(normals, along, axis=1)
    known = np.isfinite(slope[faces])
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Array = np.where(known, slope[faces] * part, 0.0).sum(axis=1) / np.where(known, part**2, 0.0).sum(axis=1)
    return found


def faces_on_box(surface: Surface, grid: Grid) -> list[NDArray[np.bool_]]:
    """Which triangles lie on each face of the box.

    Args:
        surface: The triangles.
        grid: The grid that fills the box.

    Returns:
        Masks of shape (F,), one for each of `FACES`.
    """
    corners = surface.vertices[surface.faces]
    return [(corners[:, :, k] == axis[end]).all(axis=1) for k, axis in enumerate(grid.axes) for end in (0, -1)]

"""Workspace at one orientation: hull of its region, and free travel from a position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.numbers import counted, n
from sagline.kinematics.inverse_rows import Given
from sagline.robot.robot import Robot, without_cables
from sagline.tension.methods import MinimumNorm
from sagline.viewer.readout import color_key, html_block, table_html
from sagline.viewer.slices import MarginScale
from sagline.viewer.tension_scale import ForceUnit, cable_color
from sagline.workspaces.boundary import Outline, outline
from sagline.workspaces.criteria import LeastMargin
from sagline.workspaces.levels import Details, Find, Levels, nearest_to
from sagline.workspaces.region import Orientations, Region, region_of
from sagline.workspaces.wrench_sets import WrenchSet

OPACITY: Final = 0.35  # opacity, so that the robot inside is visible


class Patch(NamedTuple):
    """Faces of one color."""

    vertices: Array  # corners, each used by a face [m], shape (V, 3)
    faces: Indices  # faces as indices of corners, shape (F, 3)
    color: tuple[int, int, int]  # red, green and blue, 0 to 255
    opacity: float = OPACITY  # opacity, 0 to 1

    @classmethod
    def of(cls, vertices: Array, faces: Indices, color: tuple[int, int, int]) -> Patch:
        """A patch of some faces of a mesh, with the corners of these faces only."""
        used, index = np.unique(faces, return_inverse=True)
        return cls(vertices[used], index.reshape(-1, 3), color)


CELLS: Final = 30  # cells along each edge of a cube; another box has the same total number of cubic cells
MOST_CELLS: Final = 64  # largest number of cells along the longest edge
ROUGH: Final = 2  # factor on the size of cells in the first hull
SMALL: Final = 0.25  # smallest share of its box; a smaller region is computed again with smaller cells
LEAST: Final = 0.005  # smallest share of the boundary that is written


class _NumberedLevels(Levels):
    """Levels of the cables that are not broken; limiting cables have their numbers in the whole robot."""

    numbers: Indices  # number of each remaining cable, then -1 for no cable

    def details(self, positions: Array) -> Details:
        found = super().details(positions)
        return found._replace(cable=self.numbers[found.cable])


class WorkspaceQuery(NamedTuple):
    """Robot, orientation, cable model, loads and broken cables of a workspace."""

    robot: Robot  # robot with the changes of the settings
    quaternion: Array  # orientation of the platform, shape (4,)
    model: CableModel
    wrenches: WrenchSet
    broken: tuple[int, ...] = ()  # numbers of the broken cables
    given: tuple[Given, ...] | None = None  # given values of an underconstrained platform, as in `inverse`

    @property
    def without(self) -> str:
        """Text of the broken cables; "" if all cables hold the platform."""
        return f", without cable {', '.join(map(str, self.broken))}" if self.broken else ""

    @property
    def orientations(self) -> Orientations:
        """The orientation of the platform."""
        return Orientations(Rotation.from_quat(self.quaternion))

    def levels(self) -> Levels:
        """Levels, whose change of sign is the boundary."""
        robot = without_cables(self.robot, *self.broken) if self.broken else self.robot
        margin, way = (LeastMargin(),), MinimumNorm()
        about = self.wrenches, self.orientations, margin, self.model, way, None
        levels = _NumberedLevels(robot, *about, given=None if self.broken else self.given)
        levels.numbers = np.append(np.delete(np.arange(self.robot.cable_count), self.broken), -1)
        return levels


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """Boundary of a region."""

    vertices: Array  # corners [m], shape (V, 3)
    faces: Indices  # faces as indices of corners, shape (F, 3)
    margin: Array  # margins at the vertices [N], shape (V,)
    owner: Indices  # index of the limiting cable at each face, -1 if there is none, shape (F,)
    on_box: Flags  # True for faces on the robot's box, shape (F,)
    text: str  # HTML with the description of the hull
    by_cable: list[Patch]  # patches of faces by limiting cable
    longest: float  # the longest edge of a face [m]; 0 without faces

    @classmethod
    def of(cls, vertices: Array, faces: Indices, margin: Array, cable: Indices, on_box: Flags, text: str) -> Hull:
        """Hull from the limiting cable at each vertex."""
        first, second, third = cable[faces].T
        majority = np.where(second == third, second, first)  # the first cable if all three differ
        owner = np.where(on_box, -1, majority)
        patches = [Patch.of(vertices, faces[owner == k], cable_color(k)) for k in np.unique(owner).tolist()]
        corners = vertices[faces]
        longest = float(np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(initial=0.0))
        return cls(vertices, faces, margin, owner, on_box, text, patches, longest)

    def by_margin(self, scale: MarginScale) -> list[Patch]:
        """Patches of the faces by margin, one patch per color of a scale."""
        margin = self.margin[self.faces].mean(axis=1)
        bands = scale.bands(margin)
        shades = scale.colors(margin)
        return [
            Patch.of(self.vertices, self.faces[bands == k], tuple(shades[bands == k][0].tolist()))
            for k in np.unique(bands).tolist()
        ]

    def near_patches(self, position: Array, reach: float) -> list[Patch]:
        """Patches of the wall within `reach`, in the colors of the limiting cables. Nearer patches are more opaque."""
        # the faces of the robot's box are not a wall
        near = np.linalg.norm(self.vertices - position, axis=1) < reach + self.longest
        faces_near = np.flatnonzero(near[self.faces].any(axis=1) & ~self.on_box)
        corners, owner = _quartered(self.vertices[self.faces[faces_near]]), np.repeat(self.owner[faces_near], 4)
        away = np.linalg.norm(corners.mean(axis=1) - position, axis=1) / reach
        patches = []
        for (least, most), opacity in zip(pairwise(_RINGS), _OPACITIES, strict=True):
            ring = (away >= least) & (away < most)
            for cable in np.unique(owner[ring]).tolist():
                chosen = _on_both_sides(corners[ring & (owner == cable)], BESIDE * reach)
                faces = np.arange(3 * len(chosen)).reshape(-1, 3)
                patches.append(Patch(chosen.reshape(-1, 3), faces, cable_color(cable), opacity))
        return patches


def region_in(query: WorkspaceQuery, rough: bool) -> Region:
    """The region to search, with as many cells as a cube of `CELLS` along each edge; `rough`: half of it per edge."""
    box = region_of(query.robot, None, CELLS)
    cells = max(_cells_of(box.high - box.low)) if box.flat is None else MOST_CELLS
    return region_of(query.robot, None, cells // ROUGH if rough else cells)


def region_hull(query: WorkspaceQuery, rough: bool, progress: Callable[[int, int], None]) -> Hull:
    """The hull of a region at one orientation; `progress` receives the number of poses done and the expected total."""
    region, levels = region_in(query, rough), query.levels()
    total = 2 * int(np.prod(np.array(region.cells) + 1))  # a vertex takes as long as a node
    done = 0

    def count(poses: int) -> None:
        nonlocal done
        done += poses
        progress(done, max(total, done))

    levels.on_block = count
    found = outline(levels, region)
    closer = None if rough else _around(found, region)
    if closer is not None:
        found = outline(levels, closer)
    text = _hull_text(found, query, region) if len(found.surface.faces) else _empty_text(found, query, region, rough)
    return Hull.of(found.surface.vertices, found.surface.faces, found.margin, found.cable, found.on_box, text)


def _around(found: Outline, region: Region) -> Region | None:
    """The box of `found` plus one cell, if `found` fills only a small part of the searched `region`; otherwise None."""
    if not len(found.surface.faces) or region.flat is not None:
        return None
    cell = found.grid.step
    low = np.maximum(found.surface.vertices.min(axis=0) - cell, region.low)
    high = np.minimum(found.surface.vertices.max(axis=0) + cell, region.high)
    if float(np.prod(high - low)) > SMALL * float(np.prod(region.high - region.low)):
        return None
    return region._replace(low=low, high=high, cells=_cells_of(high - low))


def _cells_of(size: Array) -> tuple[int, int, int]:
    """Numbers of nearly cubic cells along the edges of a box [m]."""
    along = CELLS * size / np.prod(size) ** (1.0 / 3.0)
    x, y, z = np.clip(np.rint(along), 1, MOST_CELLS).astype(int).tolist()
    return x, y, z


def _hull_text(found: Outline, query: WorkspaceQuery, region: Region) -> str:
    """HTML of the size of a region, the limiting cables, and the faces of the box that it reaches."""
    parts = f" in {counted(found.parts, 'part')} on this grid" if found.parts > 1 else ""
    text = f"<b>Region</b> {n(found.volume, '.3g', region.unit)}{parts}, {escape(str(query.wrenches))}{query.without}"
    key = color_key(
        (cable_color(k), f"{f'cable {k}' if k >= 0 else 'no cable'}, {n(100.0 * share, '.0f')} %")
        for k, share in found.shares.items()
        if share >= LEAST
    )
    if key:
        text += f"<br><b>Boundary by limiting cable</b> &nbsp;{key}"
    if found.open_faces:
        text += f"<br>It extends beyond the robot's box at {escape(', '.join(found.open_faces))}."
    return text


def _empty_text(found: Outline, query: WorkspaceQuery, region: Region, rough: bool) -> str:
    """HTML for an empty region, with the best position. With `rough`, a remark states that the search continues."""
    if rough:
        return "<b>Region</b> none found on the coarse grid"
    empty = f"<b>Region</b> empty, {escape(str(query.wrenches))}{query.without}"
    if query.broken:  # the reason would give the numbers of the remaining cables
        return empty
    return f"{empty}<br>{escape(nearest_to(query.levels(), found.grid, region.box.low, region.box.high).reason)}"


BESIDE: Final = 0.01  # distance of patches from their wall, relative to the reach; avoids hidden parts
REACH: Final = 0.16  # patches of a wall nearer than this are drawn, as a share of the robot's size
_RINGS: Final = (0.0, 0.4, 0.7, 1.0)  # radii of the rings, relative to the reach
_OPACITIES: Final = (0.6, 0.35, 0.15)  # opacity in each ring; two patches lie behind each other


def margin_text(margin: float, cable: int, unit: ForceUnit) -> str:
    """Text of the margin at the platform and of the limiting cable."""
    by = f", cable {cable}" if cable >= 0 else ""
    if not np.isfinite(margin):
        return "nothing limits it" if margin > 0.0 else "nothing holds it"
    return f"{unit.written(margin)} left{by}" if margin >= 0.0 else f"{unit.written(-margin)} too much{by}"


def _on_both_sides(corners: Array, distance: float) -> Array:
    """Each triangle of `corners` (F, 3, 3) twice, displaced by `distance` [m] to both sides."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    away = distance * (normal / np.maximum(length, np.finfo(np.float64).tiny))[:, None]
    return np.concatenate((corners + away, corners - away))


def _quartered(corners: Array) -> Array:
    """Each triangle (F, 3, 3) divided into four, in order."""
    first, second, third = (corners[:, k] for k in range(3))
    one, two, three = 0.5 * (first + second), 0.5 * (second + third), 0.5 * (third + first)
    parts = ((first, one, three), (one, second, two), (three, two, third), (one, two, three))
    return np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3, 3)


_STEPS: Final = 20  # steps of the scan along each direction; it may miss narrower gaps
_BISECTIONS: Final = 14  # bisections of a step, which reduce the error to about 1e-4 of it
DIRECTIONS: Final = np.vstack((np.eye(3), -np.eye(3)))  # +x, +y, +z, -x, -y, -z
NAMES: Final = ("+x", "+y", "+z", "−x", "−y", "−z")


@dataclass(frozen=True, slots=True, eq=False)
class _FreeTravel:
    """Free travel from a position in directions of the axes, at one orientation."""

    start: Array  # position [m], shape (3,)
    inside: bool  # True if the position is in the workspace
    margin: float  # capacity margin at the position [N]
    which: Indices  # indices of `DIRECTIONS` in which this robot can move, shape (K,)
    distance: Array  # distance to the boundary, or to the end of the box [m], shape (K,)
    crossed: Flags  # True if the boundary is reached, shape (K,)
    cable: Indices  # index of the limiting cable there, -1 if there is none, shape (K,)

    @property
    def ends(self) -> Array:
        """End points [m], shape (K, 3)."""
        return np.asarray(self.start + self.distance[:, None] * DIRECTIONS[self.which])

    def text(self, unit: ForceUnit, without: str = "") -> str:
        """HTML: margin, nearest boundary with its limit, and a table of all directions."""
        head = f"<b>Margin</b> {unit.written(self.margin)}{without}<br>"
        crossed = [k for k in range(len(self.which)) if self.crossed[k]]
        if crossed:
            nearest = min(crossed, key=lambda k: float(self.distance[k]))
            length, way = f"{self.distance[nearest]:.3f} m", NAMES[self.which[nearest]]
            head += f"<b>Boundary</b> {length} along {way}" if self.inside else f"<b>Workspace</b> {length} along {way}"
            head += f", cable {self.cable[nearest]} limits" if self.cable[nearest] >= 0 else ""
        else:
            head += "No boundary along any axis within the robot's box."
        rows = (
            (NAMES[which], f"{distance:.3f} m", _end(bool(crossed), int(cable), self.inside))
            for which, distance, crossed, cable in zip(self.which, self.distance, self.crossed, self.cable, strict=True)
        )
        return html_block(head + table_html(("direction", "length", "ends at"), rows))


def free_directions(robot: Robot, flat: int | None) -> Indices:
    """Indices of the `DIRECTIONS` of free motion, shape (K,); `flat` is the normal of a planar region."""
    free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
    if flat is not None:
        free[flat] = False
    return np.flatnonzero(np.abs(DIRECTIONS) @ free > 0.5)


def free_travel(find: Find, start: Array, which: Indices, low: Array, high: Array) -> _FreeTravel:
    """Distances from `start` along the directions `which` to the sign change of the margin, by a scan and bisection."""
    ways = DIRECTIONS[which]
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = np.where(ways > 0.0, (high - start) / ways, np.where(ways < 0.0, (low - start) / ways, np.inf))
    farthest = np.maximum(distances.min(axis=1), 0.0)
    at = farthest[:, None] * np.linspace(0.0, 1.0, _STEPS + 1)
    first = find(start[None])
    value, cable = _levels_at(find, start + at[..., None] * ways[:, None])
    inside = bool(first.level[0] >= 0.0)
    other = (value >= 0.0) != inside
    crossed = other.any(axis=1)
    last = np.where(crossed, other.argmax(axis=1), _STEPS)
    row = np.arange(len(which))
    near, far, limiting = at[row, np.maximum(last - 1, 0)], at[row, last], cable[row, last]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (near + far)
        value_there, cable_there = _levels_at(find, (start + middle[:, None] * ways)[:, None])
        beyond = ((value_there[:, 0] >= 0.0) != inside) & crossed
        far, limiting = np.where(beyond, middle, far), np.where(beyond, cable_there[:, 0], limiting)
        near = np.where(beyond, near, middle)
    distance, limiting = np.where(crossed, far, farthest), np.where(crossed, limiting, -1)
    margin = float(first.margin[0])
    return _FreeTravel(start, inside, margin, which, locked(distance), locked(crossed), locked(limiting))


def _levels_at(find: Find, places: Array) -> tuple[Array, Indices]:
    found = find(places.reshape(-1, 3))
    return found.level.reshape(places.shape[:2]), found.cable.reshape(places.shape[:2])


def _end(crossed: bool, cable: int, inside: bool) -> str:
    if not crossed:
        return "the box"
    return f"{'the boundary' if inside else 'the workspace'}{f', cable {cable}' if cable >= 0 else ''}"

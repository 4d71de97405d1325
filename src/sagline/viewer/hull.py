"""The hull of the region where the platform may go, in faces of one color each; it is there in a tenth of a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices
from sagline.core.numbers import counted, n
from sagline.robot.robot import Robot
from sagline.tension.minimum_norm import MinimumNorm
from sagline.viewer.cable_colors import cable_color
from sagline.viewer.margin_scale import MarginScale
from sagline.viewer.patches import Patch
from sagline.viewer.readout import css_color
from sagline.workspaces.criteria.margin import LeastMargin
from sagline.workspaces.levels import Levels
from sagline.workspaces.nearest import nearest_to
from sagline.workspaces.orientations import Orientations
from sagline.workspaces.outline import Outline, outline
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.wrench_sets import WrenchSet

CELLS: Final = 30  # along each edge of a cube; another box has as many cells, which are cubes too
MOST_CELLS: Final = 64  # along the longest edge
ROUGH: Final = 2  # times as long are cells in the hull that comes first
SMALL: Final = 0.25  # of its box: a region that fills less is looked at once more, with cells as much smaller
LEAST: Final = 0.005  # of the wall: what limits less is not told


class Asked(NamedTuple):
    """What a workspace is of.

    Attributes:
        robot: As the settings have changed it.
        quaternion: Of the platform, shape (4,).
        model: Cable model.
        wrenches: Loads to be borne.
    """

    robot: Robot
    quaternion: Array
    model: CableModel
    wrenches: WrenchSet

    @property
    def orientations(self) -> Orientations:
        """The one of the platform."""
        return Orientations(Rotation.from_quat(self.quaternion))

    def levels(self) -> Levels:
        """What says where it ends."""
        margin = (LeastMargin(),)
        return Levels(self.robot, self.wrenches, self.orientations, margin, self.model, MinimumNorm(), None, None)


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """A hull that has been worked out.

    Attributes:
        vertices: Corners [m], shape (V, 3).
        faces: Shape (F, 3).
        margin: At the vertices [N], shape (V,).
        owner: The cable that limits at each face, -1 where none does, shape (F,).
        on_box: Which faces are those of the robot's box, shape (F,).
        told: What it is, in words, as HTML.
        by_cable: The faces by their owners.
        longest: The longest edge of a face [m]; 0 without any.
    """

    vertices: Array
    faces: Indices
    margin: Array
    owner: Indices
    on_box: Flags
    told: str
    by_cable: list[Patch]
    longest: float

    @classmethod
    def of(cls, vertices: Array, faces: Indices, margin: Array, cable: Indices, on_box: Flags, told: str) -> Hull:
        """A hull of which it is known which cable limits at each vertex."""
        owner = np.where(on_box, -1, _most(cable[faces]))
        patches = [Patch.of(vertices, faces[owner == k], cable_color(k)) for k in np.unique(owner).tolist()]
        corners = vertices[faces]
        longest = float(np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(initial=0.0))
        return cls(vertices, faces, margin, owner, on_box, told, patches, longest)

    def by_margin(self, scale: MarginScale) -> list[Patch]:
        """The faces by the margin there, on a scale.

        Args:
            scale: Of margins.

        Returns:
            A patch for each color that there is.
        """
        margin = self.margin[self.faces].mean(axis=1)
        bands = scale.bands(margin)
        shades = scale.colors(margin)
        return [
            Patch.of(self.vertices, self.faces[bands == k], tuple(shades[bands == k][0].tolist()))
            for k in np.unique(bands).tolist()
        ]


def region_in(asked: Asked, rough: bool) -> Region:
    """Where is looked, with as many cells as a cube of `CELLS` along each edge has; rough: an eighth of them.

    Args:
        asked: What the hull is of.
        rough: Whether the hull is only the first.
    """
    box = region_of(asked.robot, None, CELLS)
    cells = max(_cells_of(box.high - box.low)) if box.flat is None else MOST_CELLS
    return region_of(asked.robot, None, cells // ROUGH if rough else cells)


def hull_of(asked: Asked, rough: bool, told: Callable[[int, int], None]) -> Hull:
    """The hull of a robot's region at one orientation.

    Args:
        asked: What it is of.
        rough: Whether it is to be there at once, with cells twice as long; parts that are thinner may be missing.
        told: Called with how much is done, of how much, about; what it raises ends the work.

    Returns:
        The hull.
    """
    region, levels = region_in(asked, rough), asked.levels()
    levels.told = _Told(told, region)
    found = outline(levels, region)
    closer = None if rough else _around(found, region)
    if closer is not None:
        found = outline(levels, closer)
    words = _told(found, asked, region) if len(found.surface.faces) else _empty(found, asked, region, rough)
    return Hull.of(found.surface.vertices, found.surface.faces, found.margin, found.cable, found.on_box, words)


def _around(found: Outline, region: Region) -> Region | None:
    """The box around a region that fills little of its own, a cell wider; None where it fills it, or is empty."""
    if not len(found.surface.faces) or region.flat is not None:
        return None
    room = found.grid.step
    low = np.maximum(found.surface.vertices.min(axis=0) - room, region.low)
    high = np.minimum(found.surface.vertices.max(axis=0) + room, region.high)
    if float(np.prod(high - low)) > SMALL * float(np.prod(region.high - region.low)):
        return None
    return region._replace(low=low, high=high, cells=_cells_of(high - low))


class _Told:
    """Tells of poses as they are done; how many there will be is known only about."""

    def __init__(self, told: Callable[[int, int], None], region: Region) -> None:
        self._done, self._told = 0, told
        self._whole = 2 * int(np.prod(np.array(region.cells) + 1))  # vertices take as long as nodes

    def __call__(self, count: int) -> None:
        self._done += count
        self._told(self._done, max(self._whole, self._done))


def _cells_of(size: Array) -> tuple[int, int, int]:
    """How many cells along the edges of a box [m], all about cubes."""
    along = CELLS * size / np.prod(size) ** (1.0 / 3.0)
    x, y, z = np.clip(np.rint(along), 1, MOST_CELLS).astype(int).tolist()
    return x, y, z


def _told(found: Outline, asked: Asked, region: Region) -> str:
    """HTML: how large it is, what limits it most, and where it goes on."""
    parts = f" in {counted(found.parts, 'part')}" if found.parts > 1 else ""
    text = f"<b>Region</b> {n(found.volume, '.3g', region.unit)}{parts}, {escape(str(asked.wrenches))}"
    marks = [
        f'<span class="key"><span class="swatch" style="background:{css_color(np.array(cable_color(k)))}"></span>'
        f" {f'cable {k}' if k >= 0 else 'no cable'}, {n(100.0 * share, '.0f')} %</span>"
        for k, share in found.shares.items()
        if share >= LEAST
    ]
    if marks:
        text += f"<br><b>Its wall by what limits</b> &nbsp;{''.join(marks)}"
    if found.open_faces:
        text += f"<br>It goes on beyond the robot's box at {escape(', '.join(found.open_faces))}."
    return text


def _empty(found: Outline, asked: Asked, region: Region, rough: bool) -> str:
    """HTML: that there is none, and what comes nearest to one; at a rough look, that there is none yet."""
    if rough:
        return "<b>Region</b> none is seen at a rough look"
    reason = nearest_to(asked.levels(), found.grid, region.box.low, region.box.high).reason
    return f"<b>Region</b> empty, {escape(str(asked.wrenches))}<br>{escape(reason)}"


def _most(cables: Indices) -> Indices:
    """Of each face the cable that most of its corners have; of three different ones the first."""
    return np.where(cables[:, 1] == cables[:, 2], cables[:, 1], cables[:, 0])

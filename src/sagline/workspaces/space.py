"""Workspace of a robot: positions, volume, and the criteria that limit it."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Indices
from sagline.core.numbers import SPACE, counted, n
from sagline.core.results import Result, Saved, formats
from sagline.robot.pose import PoseBox
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.workspaces.criterion import Criterion
from sagline.workspaces.levels import Levels
from sagline.workspaces.nearest import Nearest
from sagline.workspaces.orientations import Orientations
from sagline.workspaces.region import flat_axis
from sagline.workspaces.surface import Components, Surface, vertex_areas
from sagline.workspaces.wrench_sets import WrenchSet

BY_BOX: Final = -1  # of `limiting`: the surface is the face of the box
MOST_LIMITS: Final = 10  # shares that are printed
_MOST_PARTS: Final = 5  # whose volumes are printed
_WIDTH: Final = 80  # columns of what is printed
_HEAD: Final = 12  # of them, before each line


class Limit(NamedTuple):
    """Share of the surface with one deciding criterion and cable.

    Attributes:
        criterion: Its title.
        cable: Deciding cable, -1 for none.
        share: Of the surface without the faces of the box.
        number: Of the criterion, counted from 0.
    """

    criterion: str
    cable: int
    share: float
    number: int

    def __str__(self) -> str:
        """Criterion and cable."""
        return self.criterion if self.cable < 0 else f"{self.criterion}, cable {self.cable}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Workspace(Result, Saved):
    """Result of `workspace`.

    Of a planar robot, and in a box without height, all is of the plane: the volume is an area [m2], and the surface
    a slab around it.

    Attributes:
        robot: The robot.
        box: Box of positions that was searched.
        wrenches: Loads that it bears there besides its weight.
        orientations: Of the platform.
        criteria: Criteria that are met there, the margin first.
        model: Cable model.
        tension: Tension distribution method, for criteria on tensions.
        moment_arm: As of `margin`; None for the mean lever arm.
        unit: Of the volume, "m³" or "m²".
        volume: In that unit.
        volume_error: By how much the volume can be wrong, except for parts and gaps that are thinner than two cells of
            the finest grid; 0 where it is empty.
        components: Components of the workspace.
        surface: The boundary, closed, the faces of the box where it reaches them included.
        limiting: At each vertex of the surface the criterion that decides, as an index; -1 where the box does,
            shape (V,).
        limiting_cable: And the cable, -1 where none does, shape (V,).
        margin: And the margin of the loads there [N], shape (V,).
        open_faces: Faces of the box through which the workspace continues, "x low" for instance: the volume is what
            there is of it in this box.
        x: Coordinates of the nodes of the grid [m], shape (X,).
        y: The same along y, shape (Y,).
        z: The same along z, shape (Z,).
        level: Least value of the criteria over their scales at these nodes, >= 0 inside, shape (X, Y, Z).
        nearest: The pose nearest to feasible where the workspace is empty; None elsewhere.
    """

    robot: Robot
    box: PoseBox
    wrenches: WrenchSet
    orientations: Orientations
    criteria: tuple[Criterion, ...]
    model: CableModel
    tension: TensionMethod
    moment_arm: float | None
    unit: str
    volume: float
    volume_error: float
    components: Components
    surface: Surface
    limiting: Codes
    limiting_cable: Indices
    margin: Array
    open_faces: tuple[str, ...]
    x: Array
    y: Array
    z: Array
    level: Array
    nearest: Nearest | None

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Coordinates of the nodes of the grid along x, y and z [m]."""
        return self.x, self.y, self.z

    @property
    def limits(self) -> tuple[Limit, ...]:
        """Criteria and cables that limit the workspace, the largest share of its surface first."""
        inner = (self.limiting[self.surface.faces] != BY_BOX).any(axis=1)  # a face with all corners on the box is its
        areas = vertex_areas(self.surface.vertices, self.surface.faces[inner])
        k = np.flatnonzero((self.limiting != BY_BOX) & (areas > 0.0))
        pairs, place = np.unique(
            np.stack((self.limiting[k], self.limiting_cable[k]), axis=1), axis=0, return_inverse=True
        )
        sums = np.bincount(place.ravel(), areas[k], minlength=len(pairs))
        return tuple(
            Limit(self.criteria[pairs[i, 0]].title, int(pairs[i, 1]), float(sums[i] / sums.sum()), int(pairs[i, 0]))
            for i in np.argsort(-sums, kind="stable")
        )

    @property
    def field(self) -> Any:
        """Level, margin, deciding criterion and cable at the points of the grid, with their coordinates.

        An xarray Dataset with dimensions x, y and z; computed at each call.
        """
        return formats().module_of(self).field_of(self)

    def levels(self) -> Levels:
        """Signed feasibility function of the position.

        Returns:
            A function of positions (N, 3) [m] that gives levels (N,), with `details`.
        """
        return Levels(
            self.robot,
            self.wrenches,
            self.orientations,
            self.criteria,
            self.model,
            self.tension,
            self.moment_arm,
            flat_axis(self.box),
        )

    def __str__(self) -> str:
        """Summary in lines of at most 80 columns."""
        return "\n".join(_summary_lines(self)).replace(SPACE, " ")


def _summary_lines(space: Workspace) -> list[str]:
    """Summary of a workspace in lines of at most 80 columns."""
    lines = [f"Workspace of {space.robot.name}: {amount_of(space)}"]
    for head, text in facts_of(space):
        lines += wrap(text, _WIDTH, initial_indent=f"  {head:<{_HEAD}}", subsequent_indent=" " * (_HEAD + 2))
    limits = space.limits
    if limits:
        lines.append("  limited by, in shares of its surface:")
        lines += [f"    {n(100.0 * limit.share, '.1f'):>5} %  {limit}" for limit in limits[:MOST_LIMITS]]
        if len(limits) > MOST_LIMITS:
            rest = sum(limit.share for limit in limits[MOST_LIMITS:])
            lines.append(f"    {n(100.0 * rest, '.1f'):>5} %  {counted(len(limits) - MOST_LIMITS, 'other')}")
    return lines


def amount_of(space: Workspace) -> str:
    """Volume or area with its error bar, "789.4 ± 0.2 m³", and the number of parts."""
    if space.nearest is not None:
        return f"empty, 0 {space.unit}"
    if space.volume_error <= 1e-9 * space.volume:  # all of the box
        return f"{space.volume:.6g} ± 0 {space.unit}"
    places = max(0, 1 - int(np.floor(np.log10(space.volume_error))))
    size = f"{space.volume:.{places}f} ± {space.volume_error:.{places}f} {space.unit}"
    count = space.components.count
    return size if count == 1 else f"{size} in {count} parts"


def facts_of(space: Workspace) -> list[tuple[str, str]]:
    """Box, loads, orientations, model and criteria of a workspace, as pairs of a word and a text."""
    facts = [("box", f"{span_of(space.box)} m"), ("loads", str(space.wrenches))]
    facts += [("platform", str(space.orientations)), ("cables", type(space.model).__name__)]
    if asked := [str(one) for one in space.criteria if not one.always]:
        facts.append(("criteria", ", ".join(asked)))
    if space.components.count > 1:
        sizes = [n(volume, ".3g", space.unit) for volume in space.components.volume[:_MOST_PARTS]]
        facts.append(("parts", ", ".join(sizes) + ", …" * (space.components.count > _MOST_PARTS)))
    if space.open_faces:
        faces = ", ".join(space.open_faces)
        facts.append(("open", f"it reaches the box at {faces}: only its part in this box is known"))
    if space.nearest is not None:
        facts.append(("nearest", space.nearest.reason))
    return facts


def span_of(box: PoseBox) -> str:
    """Range of a box of positions along x, y and z [m], as text."""
    ends = zip(box.low, box.high, strict=True)
    return ", ".join(f"{n(low)} to {n(high)}" if low < high else n(low) for low, high in ends)

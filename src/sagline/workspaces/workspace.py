"""Workspace of a robot: the set of positions at which all criteria are met, with its volume and its limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from textwrap import wrap
from typing import Any, Final, NamedTuple, get_args

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import brief, callback, choice, instance, whole_number
from sagline.core.arrays import Array, Codes, Flags, Indices, Progress, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import SPACE, counted, n
from sagline.core.results import Result, Saved, formats
from sagline.kinematics.inverse_rows import Given
from sagline.robot.pose import Pose, PoseBox
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import DEFAULT, method_of
from sagline.workspaces.balanced import check_arguments, check_given
from sagline.workspaces.boundary import MOST_CELLS, boundary, uncertain_volume
from sagline.workspaces.criteria import LeastMargin
from sagline.workspaces.criterion import Criterion, check_continuous
from sagline.workspaces.levels import Hull, Levels, Nearest, nearest_to
from sagline.workspaces.region import AXES, Orientations, Region, Tilts, flat_axis, orientations_of, region_of
from sagline.workspaces.separation import exclusion, separated
from sagline.workspaces.surface import Components, Surface, vertex_areas
from sagline.workspaces.wrench_sets import WrenchSet, load_of

HULLS: Final[dict[Hull, str]] = {
    "inner": "inner: every position inside is proved feasible",
    "outer": "outer: every position outside is proved infeasible",
}
BY_BOX: Final = -1  # value of `limiting` at vertices on a face of the box
MOST_LIMITS: Final = 10  # largest number of shares that are printed
_MOST_PARTS: Final = 5  # largest number of components whose volumes are printed
_WIDTH: Final = 80  # width of the printed text, in columns
_HEAD: Final = 12  # indentation of each line, in columns


class Limit(NamedTuple):
    """Share of the surface that is limited by one criterion and one cable.

    Attributes:
        criterion: Title of the criterion.
        cable: Limiting cable, -1 if there is none.
        share: Share of the surface outside the faces of the box, 0 to 1.
        number: Index of the criterion, from 0.
    """

    criterion: str
    cable: int
    share: float
    number: int

    def __str__(self) -> str:
        """Names of the criterion and the cable."""
        return self.criterion if self.cable < 0 else f"{self.criterion}, cable {self.cable}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Workspace(Result, Saved):
    """Workspace of a robot: the result of `workspace`.

    For a planar robot, and in a box without extent along one axis, the workspace is a part of a plane. The volume of a
    workspace in a plane is an area [m2], and the surface encloses a slab around the area.

    Attributes:
        robot: The robot.
        box: Box of positions that was searched.
        wrenches: Loads in addition to the weight.
        orientations: Orientations of the platform.
        criteria: Criteria that are met in the workspace, the margin first.
        model: Cable model.
        tension: Tension distribution method, for criteria on tensions.
        moment_arm: Lever arm as in `margin` [m]; None for the mean lever arm.
        hull: Margin that determines the surface: "exact" for its value, "inner" for its lower bound, "outer" for its
            upper bound.
        unit: Unit of the volume, "m³" or "m²".
        volume: Volume or area in this unit.
        volume_error: Error bound of the volume; 0 for an empty workspace. The bound includes the volume between
            triangles and boundary, and the uncertainty of the margin at vertices. The bound does not include parts and
            gaps that are thinner than two cells of the finest grid.
        components: Components of the workspace.
        surface: The closed boundary, including the faces of the box that the workspace reaches.
        limiting: Index of the limiting criterion at each vertex of the surface, shape (V,); -1 on a face of the box.
        limiting_cable: Limiting cable at each vertex, shape (V,); -1 if there is none.
        margin: Margin of the loads at each vertex [N], shape (V,).
        open_faces: Faces of the box that the workspace reaches, for example "x low". The workspace may continue beyond
            open faces; the volume is the volume inside the box.
        x: Coordinates of the nodes of the grid [m], shape (X,).
        y: Coordinates of the nodes along y, shape (Y,).
        z: Coordinates of the nodes along z, shape (Z,).
        level: Smallest value of the criteria, each divided by its scale, at these nodes, >= 0 inside, shape (X, Y, Z).
        nearest: The pose nearest to feasibility if the workspace is empty; otherwise None.
        given: Given values of an underconstrained platform, as in `inverse`; None for its default.
    """

    robot: Robot
    box: PoseBox
    wrenches: WrenchSet
    orientations: Orientations
    criteria: tuple[Criterion, ...]
    model: CableModel
    tension: TensionMethod
    moment_arm: float | None
    hull: Hull
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
    given: tuple[Given, ...] | None = None

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Coordinates of the nodes of the grid [m]: along x, along y, and along z."""
        return self.x, self.y, self.z

    @property
    def limits(self) -> tuple[Limit, ...]:
        """Criteria and cables that limit the workspace, in decreasing order of their shares of the surface."""
        inner = (self.limiting[self.surface.faces] != BY_BOX).any(axis=1)  # False for triangles on a face of the box
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
        """Level, margin, limiting criterion and cable at the points of the grid, with their coordinates.

        The result is an xarray Dataset with dimensions x, y and z. Each call computes it again.
        """
        return formats().writer_of(self).field_of(self)

    def levels(self) -> Levels:
        """Signed feasibility function of the position.

        Returns:
            A function of positions (N, 3) [m] that returns levels (N,), and has a method `details`.
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
            hull=self.hull,
            given=self.given,
        )

    def __str__(self) -> str:
        """Summary in lines of at most 80 columns."""
        lines = [f"Workspace of {self.robot.name}: {amount_of(self)}"]
        for head, text in facts_of(self):
            lines += wrap(text, _WIDTH, initial_indent=f"  {head:<{_HEAD}}", subsequent_indent=" " * (_HEAD + 2))
        limits = self.limits
        if limits:
            lines.append("  limited by, in shares of its surface:")
            lines += [f"    {n(100.0 * limit.share, '.1f'):>5} %  {limit}" for limit in limits[:MOST_LIMITS]]
        if len(limits) > MOST_LIMITS:
            rest = sum(limit.share for limit in limits[MOST_LIMITS:])
            lines.append(f"    {n(100.0 * rest, '.1f'):>5} %  {counted(len(limits) - MOST_LIMITS, 'other')}")
        return "\n".join(lines).replace(SPACE, " ")


def amount_of(space: Workspace) -> str:
    """Text of the volume or area with its error bar, such as "789.4 ± 0.2 m³", and of the number of parts."""
    if space.nearest is not None:
        return f"empty, 0 {space.unit}"
    if space.volume_error <= 1e-9 * space.volume:  # the workspace is the whole box
        return f"{space.volume:.6g} ± 0 {space.unit}"
    places = max(0, 1 - int(np.floor(np.log10(space.volume_error))))
    size = f"{space.volume:.{places}f} ± {space.volume_error:.{places}f} {space.unit}"
    count = space.components.count
    where = "" if space.components.separate.all() else " on this grid"
    return size if count == 1 else f"{size} in {count} parts{where}"


def facts_of(space: Workspace) -> list[tuple[str, str]]:
    """Box, loads, orientations, model and criteria of a workspace. Each is a pair of a heading and a text."""
    facts = [("box", f"{span_of(space.box)} m"), ("loads", str(space.wrenches))]
    facts += [("platform", orientations_text(space)), ("cables", type(space.model).__name__)]
    if space.hull != "exact":
        facts.append(("hull", HULLS[space.hull]))
    if asked := [str(one) for one in space.criteria if not one.always]:
        facts.append(("criteria", ", ".join(asked)))
    if space.components.count > 1:
        sizes = [n(volume, ".3g", space.unit) for volume in space.components.volume[:_MOST_PARTS]]
        listed = ", ".join(sizes) + ", …" * (space.components.count > _MOST_PARTS)
        facts.append(("parts", f"{listed}; {_separation_text(space.components)}"))
    if space.open_faces:
        faces = ", ".join(space.open_faces)
        facts.append(("open", f"the workspace reaches the box at {faces}: only its part in this box is known"))
    if space.nearest is not None:
        facts.append(("nearest", space.nearest.reason))
    return facts


def orientations_text(space: Workspace) -> str:
    """Text of the orientations of a workspace."""
    if is_underconstrained(space.robot):
        text = f"rotation from the balance of {counted(space.robot.cable_count, 'cable')}"
        if space.given is None or "yaw" not in space.given:
            return text
        turn = Pose.from_quaternion(np.zeros(3), space.orientations.quaternion[0]).rotation.as_euler("ZYX")[0]
        return f"{text} with a yaw of {n(np.degrees(turn), '.4g', '°')}"
    return str(space.orientations)


def _separation_text(components: Components) -> str:
    """Sentence about the parts of a workspace: proofs that they are separate, or results of the search for paths."""
    proved = int(components.separate.sum())
    if proved == components.count:
        return "proved: no path in the box leads from one part to another"
    rest = "neither a path between the parts nor a proof that they are separate was found"
    return f"{proved} proved separate; for the others, {rest}" if proved else rest


def span_of(box: PoseBox) -> str:
    """Range of a box of positions along x, y and z [m], as text."""
    ends = zip(box.low, box.high, strict=True)
    return ", ".join(f"{n(low)} to {n(high)}" if low < high else n(low) for low, high in ends)


LEAST_CELLS: Final = 4
_CROSSED: Final = 100  # approximate number of evaluated poses per cell at the boundary
ON_BOX: Final = 1e-9  # a vertex counts as on a face of the box if its distance, relative to the box, is smaller
_CATENARY = Catenary()


def workspace(
    robot: Robot,
    box: PoseBox | None = None,
    wrenches: WrenchSet | None = None,
    *,
    orientations: Orientations | Tilts | None = None,
    criteria: Sequence[Criterion] = (),
    model: CableModel | str = _CATENARY,
    tension: TensionMethod | str = DEFAULT.alone,
    cells: int = 32,
    refine: bool | int = True,
    moment_arm: float | None = None,
    hull: Hull = "exact",
    given: Sequence[Given] | None = None,
    progress: Progress | None = None,
) -> Workspace:
    """Workspace: the positions at which the cables can balance every load of a set, and all criteria are met.

    The boundary is computed for sagging cables from the sign of `margin`. The workspace can have any shape and any
    number of parts. The vertices of the surface are on the exact boundary, with flat triangles between them. The error
    bar of the volume includes the effect of the flat triangles, and the uncertainty of the margin at vertices. Parts
    that are thinner than a cell can be missed; only `prove` is certain for a whole box.

    With three or four cables and six degrees of freedom, the robot is underconstrained: each position has one rotation
    and one set of tensions, those of a stable equilibrium, as in `inverse`. The margin is the smallest distance of a
    tension from its limits. It is computed for the middle and for each corner of the loads, with a rotation for each.

    Args:
        robot: The robot. The workspace of a planar robot is an area. The plane_normal of a planar robot must be along
            x, y or z.
        box: Box of positions; a box without extent along an axis is a part of a plane. A tilt of the box has the
            meaning of `Tilts`. None: the whole frame of the robot, or the box of its anchors down to the floor.
        wrenches: Loads on the platform in addition to its weight; None for the weight alone.
        orientations: Orientations of the platform, `Tilts` or `Orientations`; None for the level orientation.
        criteria: Further criteria, for example `MaximumSag(0.05)`. Criteria on tensions use the tensions for the load
            in the middle of the set.
        model: Cable model; the default is the exact model.
        tension: Tension distribution method for criteria on tensions; its tensions must be continuous.
        cells: Number of cells along the box's longest edge, 4 to 128.
        refine: Number of times that cells at the boundary are halved, 0 to 3; True means 1.
        moment_arm: Lever arm that converts moments to forces in the margin [m]; None for the mean lever arm.
        hull: Margin that determines the boundary. "exact": its value. "inner": its lower bound; every position inside
            is proved feasible. "outer": its upper bound; every position outside is proved infeasible.
        given: Given values of an underconstrained platform, as in `inverse`: the position, and with four cables "yaw"
            or "level". The yaw is that of `orientations`. None: "level" with four cables.
        progress: Function that is called from time to time with the number of finished poses and the expected total.

    Returns:
        Workspace.

    Raises:
        InvalidValueError: If an argument is of the wrong kind. If `box` and `orientations` both have a tilt, or if the
            platform cannot rotate in this way. If a criterion needs continuous tensions, but `tension` does not give
            them.
        FileError: If a package of the extra "workspace" is not installed.

    Examples:
        >>> import sagline as sl
        >>> space = sl.workspace(sl.load_robot("article-suspended"), cells=16)
        >>> print(f"{space.volume:.0f} m3, open at {space.open_faces[0]}")
        789 m3, open at z low
        >>> print(f"limited by the {space.limits[0].criterion}")
        limited by the margin

    Source:
        docs/model.md, section 13; Bouchard, Gosselin & Moore 2010 (margin); Lorensen & Cline 1987 (marching cubes).
    """
    model, tension = model_of(model), method_of(tension)
    asked, report = _checked(robot, criteria, tension), callback(progress, "progress")
    region = region_of(robot, box, whole_number(cells, "cells", LEAST_CELLS, MOST_CELLS))
    turned = orientations_of(robot, orientations, region.box.tilt)
    loads, chosen = load_of(wrenches), choice(hull, "hull", get_args(Hull))
    arm = None if moment_arm is None else number(moment_arm, "moment_arm", "m", low=0.0)
    if is_underconstrained(robot):
        check_arguments(robot, turned, chosen, arm)
    held = check_given(robot, given)
    levels = Levels(robot, loads, turned, asked, model, tension, arm, flat_axis(region.box), hull=chosen, given=held)
    levels.on_block = None if report is None else _progress_of(report, region.cells)
    found = boundary(levels, region.low, region.high, region.cells, refine)
    surface, components = found.surface, found.components
    if components.count > 1:
        components = replace(components, separate=separated(components, exclusion(levels)))
    decided = levels.details(surface.vertices)
    uncertain = uncertain_volume(levels, surface, decided.uncertainty, float(found.grid.step.max()))
    on_box = _next_to(surface.vertices, region) & (decided.level > 1e-6)
    return Workspace(
        robot=robot,
        box=region.box,
        wrenches=loads,
        orientations=turned,
        criteria=asked,
        model=model,
        tension=tension,
        moment_arm=arm,
        hull=chosen,
        unit=region.unit,
        volume=found.volume / region.thickness,
        volume_error=(found.volume_error + uncertain) / region.thickness,
        components=replace(components, volume=locked(components.volume / region.thickness)),
        surface=surface,
        limiting=locked(np.where(on_box, BY_BOX, decided.criterion).astype(np.int8)),
        limiting_cable=locked(np.where(on_box, -1, decided.cable)),
        margin=decided.margin,
        open_faces=tuple(face for face in found.open_faces if region.flat is None or face[0] != AXES[region.flat]),
        x=found.grid.x,
        y=found.grid.y,
        z=found.grid.z,
        level=found.grid.values,
        nearest=None if len(surface.faces) else nearest_to(levels, found.grid, region.box.low, region.box.high),
        given=held,
    )


def _progress_of(progress: Progress, cells: tuple[int, int, int]) -> Callable[[int], None]:
    """Function that reports progress, relative to the estimated number of all poses (nodes and boundary cells)."""
    x, y, z = cells
    about, done = (x + 1) * (y + 1) * (z + 1) + _CROSSED * (x * y + y * z + z * x), 0

    def add(count: int) -> None:
        nonlocal done
        done += count
        progress(done, max(about, done))

    return add


def _next_to(points: Array, region: Region) -> Flags:
    """Mask (N,) of points that are next to a face of the region's box."""
    near = ON_BOX * float((region.high - region.low).max())
    beside = (points - region.low < near) | (region.high - points < near)
    return np.asarray(beside.any(axis=1))


def _checked(robot: Robot, criteria: Sequence[Criterion], tension: TensionMethod) -> tuple[Criterion, ...]:
    """Check the criteria. The result begins with the margin."""
    instance(robot, Robot, "robot")
    if not isinstance(criteria, list | tuple):
        raise InvalidValueError("criteria", brief(criteria), "a list of criteria", "Give [MaximumSag(0.05)].")
    for k, one in enumerate(criteria):
        instance(one, Criterion, f"criteria[{k}]").check(robot)
    check_continuous(tension, criteria)
    if any(isinstance(one, LeastMargin) for one in criteria):
        return tuple(sorted(criteria, key=lambda one: not isinstance(one, LeastMargin)))
    return LeastMargin(), *criteria

"""Workspace: the set of positions at which all criteria are met."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final, get_args

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import brief, callback, choice, instance, whole_number
from sagline.core.arrays import Array, Flags, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress
from sagline.robot.pose import PoseBox
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import DEFAULT, method_of
from sagline.workspaces.boundary import MOST_CELLS, boundary, uncertain_volume
from sagline.workspaces.criteria import LeastMargin
from sagline.workspaces.criterion import Criterion, check_continuous
from sagline.workspaces.levels import Hull, Levels
from sagline.workspaces.nearest import nearest_to
from sagline.workspaces.orientations import Orientations, Tilts, orientations_of
from sagline.workspaces.region import AXES, Region, flat_axis, region_of
from sagline.workspaces.separation import exclusion, separated
from sagline.workspaces.space import BY_BOX, Workspace
from sagline.workspaces.wrench_sets import WrenchSet, load_of

LEAST_CELLS: Final = 4
_CROSSED: Final = 100  # approximate number of evaluated poses per cell at the boundary
ON_BOX: Final = 1e-9  # a vertex is on a face if its distance from the face, relative to the box, is smaller
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
    progress: Progress | None = None,
) -> Workspace:
    """Workspace: the positions at which the cables can balance every load of a set, and all criteria are met.

    The boundary is computed for sagging cables from the sign of `margin`. The workspace can have any shape and any
    number of parts. The vertices of the surface are on the exact boundary, with flat triangles between them. The error
    bar of the volume includes the effect of the flat triangles, and the uncertainty of the margin at vertices. Parts
    that are thinner than a cell can be missed; only `prove` is certain for a whole box.

    Args:
        robot: The robot. The workspace of a planar robot is an area. The plane_normal of this robot must be along x, y
            or z.
        box: Box of positions; a box without extent along an axis is a part of a plane. Its tilt has the meaning of
            `Tilts`. None: the whole frame of the robot, or the box of its anchors down to the floor.
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
    asked = _checked(robot, criteria, tension)
    count = whole_number(cells, "cells", LEAST_CELLS, MOST_CELLS)
    report = callback(progress, "progress")
    region = region_of(robot, box, count)
    turned = orientations_of(robot, orientations, region.box.tilt)
    loads = load_of(wrenches)
    arm = None if moment_arm is None else number(moment_arm, "moment_arm", "m", low=0.0)
    chosen = choice(hull, "hull", get_args(Hull))
    levels = Levels(robot, loads, turned, asked, model, tension, arm, flat_axis(region.box), hull=chosen)
    levels.on_block = None if report is None else _progress_of(report, region.cells)
    found = boundary(levels, region.low, region.high, region.cells, refine)
    surface, components = found.surface, found.components
    if components.count > 1:
        components = replace(components, separate=separated(components, exclusion(levels)))
    decided = levels.details(surface.vertices)
    error = found.volume_error + uncertain_volume(levels, surface, decided.uncertainty, float(found.grid.step.max()))
    on_box = _on_box(surface.vertices, region) & (decided.level > 1e-6)
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
        volume_error=error / region.thickness,
        components=replace(components, volume=locked(components.volume / region.thickness)),
        surface=surface,
        limiting=locked(np.where(on_box, BY_BOX, decided.criterion).astype(np.int8)),
        limiting_cable=locked(np.where(on_box, -1, decided.cable)),
        margin=decided.margin,
        open_faces=_open_faces(found.open_faces, region),
        x=found.grid.x,
        y=found.grid.y,
        z=found.grid.z,
        level=found.grid.values,
        nearest=None if len(surface.faces) else nearest_to(levels, found.grid, region.box.low, region.box.high),
    )


def _progress_of(progress: Progress, cells: tuple[int, int, int]) -> Callable[[int], None]:
    """Function that reports progress, relative to the estimated number of poses at nodes and in boundary cells."""
    x, y, z = cells
    about, done = (x + 1) * (y + 1) * (z + 1) + _CROSSED * (x * y + y * z + z * x), 0

    def add(count: int) -> None:
        nonlocal done
        done += count
        progress(done, max(about, done))

    return add


def _checked(robot: Robot, criteria: Sequence[Criterion], tension: TensionMethod) -> tuple[Criterion, ...]:
    """Checked criteria; the margin is the first one."""
    instance(robot, Robot, "robot")
    if not isinstance(criteria, list | tuple):
        raise InvalidValueError("criteria", brief(criteria), "a list of criteria", "Give [MaximumSag(0.05)].")
    for k, one in enumerate(criteria):
        instance(one, Criterion, f"criteria[{k}]").check(robot)
    check_continuous(tension, criteria)
    if any(isinstance(one, LeastMargin) for one in criteria):
        return tuple(sorted(criteria, key=lambda one: not isinstance(one, LeastMargin)))
    return LeastMargin(), *criteria


def _on_box(vertices: Array, region: Region) -> Flags:
    """Mask of vertices on a face of the region."""
    near = ON_BOX * float((region.high - region.low).max())
    return np.asarray(((vertices - region.low < near) | (region.high - vertices < near)).any(axis=1))


def _open_faces(faces: Sequence[str], region: Region) -> tuple[str, ...]:
    """Faces of the box that the workspace reaches, without the faces of the slab around a plane."""
    flat = None if region.flat is None else AXES[region.flat]
    return tuple(face for face in faces if face[0] != flat)

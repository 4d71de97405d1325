"""Region of feasible positions, its slices, and the free travel from the pose that is shown."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, Final

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.viewer import workspace
from sagline.viewer.feature import BackgroundTask, Feature, View
from sagline.viewer.features.push import PushFeature
from sagline.viewer.page import Page
from sagline.viewer.player import InMotion
from sagline.viewer.readout import html_block, refused, sentence
from sagline.viewer.robot_scene import INFEASIBLE, NO_SHADOW, PLATFORM, REST, Nodes
from sagline.viewer.slices import MarginScale, Marks
from sagline.viewer.snapshot import given_yaw
from sagline.viewer.tension_scale import ForceUnit
from sagline.workspaces.levels import Levels, Plane, slice_of
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.wrench_sets import WrenchBox

BOUNDARY_WIDTH, LINE_WIDTH, LINE_COLOR = 4.0, 1.5, (120, 128, 138)  # widths of boundary and lines [px], color of lines
_SMALL, _TEXT_SCALE = 0.7, 0.85  # text scale of labels on lines and of other labels
INWARD, OUTWARD = REST, PLATFORM  # colors of arrows back to the workspace and to its boundary
_BELOW: Final = 0.04  # distance from the platform to the text below it, as a share of the robot's size
_ARROW: Final = np.array([0.002, 0.009, 0.03])  # radii of shaft and head, length of the head, per size of the robot
# rotations from x and y of a picture to the two axes of a plane, by the normal of the plane
_TURNS: Final = np.array([[0.5, 0.5, 0.5, 0.5], [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
POINTS: Final = 40  # points of a slice along each axis of its plane
COARSE: Final = 7  # points along each axis whose margins give the range of the colors
BY_CABLE, BY_MARGIN = "limiting cable", "margin"
PLANES: Final = {"level": 2, "upright, along x": 1, "upright, along y": 0}  # names of planes, and their normals
_NOTHING: Final = sentence("Choose one or several of these.")


# key of the workspace, True for the coarse hull, and the hull; None without one
_Result = tuple[Hashable, bool, workspace.Hull | None]
_NO_RESULT: Final[_Result] = (None, True, None)


class _SupersededError(SaglineError):
    """Signal that another workspace is requested."""


def planes_of(robot: Robot) -> tuple[int, ...]:
    """Normals of the planes of possible slices; for a planar robot, only the normal of its plane."""
    flat = region_of(robot, None, workspace.CELLS).flat
    return (2, 1, 0) if flat is None else (flat,)


class RegionFeature(Feature):
    """A tab with loads and a choice of region, slice and free travel, which are drawn in the scene."""

    live = True

    def __init__(self, page: Page) -> None:
        """Build the tab."""
        self._page, self._server, self._size, self._nodes = page, page.server, page.size, Nodes(page.server.scene)
        self._task: BackgroundTask = BackgroundTask(page.later)
        self._key: Hashable = None  # key of the workspace
        self._query: workspace.WorkspaceQuery | None = None
        self._levels: Levels | None = None
        self._region: Region | None = None
        self._place = np.zeros(3)  # position of the platform [m]
        self._scale = MarginScale(1.0)
        self._scale_key: Hashable = None  # key of the workspace of the scale
        self._result = _NO_RESULT
        self._hull_key: Hashable = None  # key of the drawn hull
        self._slice_key: Hashable = None  # key of the drawn slice
        self._progress = 0.0
        self._build_tab(page)

    def _build_tab(self, page: Page) -> None:
        gui = page.server.gui
        with page.panel.readings.add_tab("Workspace"):
            hint = "Additional force in the wrench set, up to this size along each axis."
            self._force = gui.add_number("Force ± [N]", 0.0, min=0.0, hint=hint)
            hint = "Additional moment about each axis through the center of mass."
            self._moment = gui.add_number("Moment ± [N m]", 0.0, min=0.0, hint=hint)
            hint = "Positions that are feasible at this orientation with these loads."
            self._region_box: Any = gui.add_checkbox("Region", False, hint=hint)
            self._color: Any = gui.add_dropdown("Region colored by", (BY_CABLE, BY_MARGIN), visible=False)
            self._hull_html = gui.add_html("")
            self._margin_html = gui.add_html("")
            self._slice_box: Any = gui.add_checkbox("Slice", False, hint="Margins on a plane through the platform.")
            names = tuple(name for name, normal in PLANES.items() if normal in planes_of(page.robot))
            self._plane: Any = gui.add_dropdown("Plane", names, visible=False)
            self._key_html = gui.add_html("")
            hint = "Free travel along each axis at this orientation."
            self._travel_box: Any = gui.add_checkbox("Where can I go", False, hint=hint)
            self._travel_html = gui.add_html(_NOTHING)
        boxes = self._region_box, self._slice_box, self._travel_box
        page.refresh_on(self._force, self._moment, self._color, self._plane, *boxes)

    @property
    def _without(self) -> str:
        return "" if self._query is None else self._query.without

    @property
    def _anything(self) -> bool:
        return bool(self._region_box.value or self._slice_box.value or self._travel_box.value)

    @property
    def _by_cable(self) -> bool:
        return bool(self._color.value != BY_MARGIN)

    @property
    def _scaled(self) -> bool:
        return bool(self._slice_box.value or (self._region_box.value and not self._by_cable))

    def depends(self, view: View) -> Hashable:
        """Key: the view if the user has chosen a drawing."""
        return view if self._anything else None

    def follow(self, view: View) -> None:
        """Draw the workspace at the orientation that is shown."""
        self._arrange()
        if not self._anything:
            self._clear()
            return
        robot, pose = view.snapshot.robot, view.snapshot.pose
        try:
            levels, region = self._prepare(self._query_of(view))
            self._follow_hull()
            self._place = pose.position
            self._follow_wall()
            self._follow_slice(levels, region, pose)
            self._follow_travel(levels, region, robot, pose)
        except SaglineError as error:
            self._clear()
            self._refuse(str(error))

    def tick(self) -> None:
        """Write the progress of a hull's computation."""
        if self._region_box.value and self._task.elapsed:
            text = f"Computing the region: {100.0 * self._progress:.0f} %, {self._task.elapsed:.0f} s so far"
            self._hull_html.content = sentence(text)

    def _arrange(self) -> None:
        """Show the choices of active drawings, and clear the texts of the others."""
        self._color.visible, self._plane.visible = bool(self._region_box.value), bool(self._slice_box.value)
        if not self._region_box.value:
            self._hull_html.content = self._margin_html.content = ""
        if not self._scaled:
            self._key_html.content = ""
        if not self._travel_box.value:
            self._travel_html.content = "" if self._anything else _NOTHING

    def _refuse(self, message: str) -> None:
        self._hull_html.content, self._margin_html.content = refused(message), ""

    def _query_of(self, view: View) -> workspace.WorkspaceQuery:
        """Robot, model, loads and broken cables of a view; the loads include the force of the user."""
        snapshot, model, wrench = view.snapshot, view.settings.model, view.wrench
        broken: tuple[int, ...] = ()
        if isinstance(snapshot, InMotion):  # its cables are exact
            model, broken = Catenary(), tuple(sorted(snapshot.broken))
        elif snapshot.plan is not None:
            model, wrench = snapshot.plan.state.cables.model, snapshot.plan.state.wrench
        push = self._page.feature(PushFeature).push if view.played is None else None
        center = np.zeros(6) if wrench is None else np.array(wrench)
        center += 0.0 if push is None else push.load(snapshot.robot, snapshot.pose)
        loads = WrenchBox(_load(self._force, "N"), _load(self._moment, "N m"), center)
        turn, given = snapshot.pose.quaternion, view.settings.given if view.played is None else None
        if is_underconstrained(snapshot.robot):
            turn = Pose.from_euler(np.zeros(3), given_yaw(snapshot.pose, given), 0.0, 0.0).quaternion
        return workspace.WorkspaceQuery(snapshot.robot, locked(np.array(turn)), model, loads, broken, given)

    def _prepare(self, query: workspace.WorkspaceQuery) -> tuple[Levels, Region]:
        """Levels and region, created again if the query has changed."""
        robot, loads = query.robot, (query.wrenches.center.tobytes(), query.wrenches.segments.tobytes())
        key = (id(robot), query.quaternion.tobytes(), type(query.model), *loads, query.broken)
        if key != self._key or self._levels is None or self._region is None:
            self._query = query  # keeps the robot alive, so that its id remains unique
            self._region, self._levels = region_of(robot, None, workspace.CELLS), query.levels()
            self._key = key
        if self._scale_key != key and self._scaled:
            self._scale_key, self._scale = key, _scale_of(self._levels, self._region)
        return self._levels, self._region

    def _show_hull(self, patches: list[workspace.Patch], *, opened: bool = False) -> None:
        """Draw the hull. With `opened`, its front faces are not drawn."""
        with self._server.atomic():
            _draw_patches(self._nodes, "/hull", patches, "back" if opened else "double")

    def _follow_hull(self) -> None:
        """Draw the latest hull, and start the computation of a better one."""
        if not self._region_box.value:
            self._show_hull([])
            self._hull_key, self._result = None, _NO_RESULT
            return
        known, rough, hull = self._result
        if (known != self._key or rough) and not self._task.busy:
            self._compute(rough=known != self._key)
        if hull is None:
            self._show_hull([])
            return
        opened = bool(self._slice_box.value)
        key = (known, rough, self._by_cable, opened)
        if key != self._hull_key:
            self._hull_key = key
            self._show_hull(hull.by_cable if self._by_cable else hull.by_margin(self._scale), opened=opened)
            self._hull_html.content = html_block(hull.text)

    def _compute(self, *, rough: bool) -> None:
        query, key = self._query, self._key
        assert query is not None
        self._progress = 0.0

        def progress(done: int, total: int) -> None:  # runs in the background thread
            self._progress = min(done / max(total, 1), 1.0)
            if self._key != key and not rough:  # a rough hull is shown while a slider moves
                raise _SupersededError

        def failed(message: str) -> None:
            if not message:  # a newer calculation has replaced this one
                self._receive(self._result)
            elif self._key == key:
                self._receive((key, False, None))
                self._refuse(message)

        self._task.start(
            lambda: workspace.region_hull(query, rough, progress),
            lambda hull: self._receive((key, rough, hull)),
            failed,
        )

    def _receive(self, result: _Result) -> None:
        if self._region_box.value and self._key is not None:
            self._result = result
            self._follow_hull()
            self._follow_wall()

    def _follow_wall(self) -> None:
        """Draw the wall near the platform, and write the margin."""
        text = ""
        patches: list[workspace.Patch] = []
        if self._region_box.value and self._levels is not None:
            here = self._levels.details(self._place[None])
            text = workspace.margin_text(float(here.margin[0]), int(here.cable[0]), ForceUnit.of(self._levels.robot))
            text += self._without
            *_, hull = self._result
            if hull is not None:
                patches = hull.near_patches(self._place, workspace.REACH * self._size)
            what = "tension to its nearest limit" if is_underconstrained(self._levels.robot) else "force with moment"
            self._margin_html.content = html_block(f"<b>Margin here</b>, {what}: {text}")
        with self._server.atomic():
            _draw_patches(self._nodes, "/wall", patches)
            self._nodes.label("/platform/left", text, (0.0, 0.0, -_BELOW * self._size), "top-center", _TEXT_SCALE)

    def _follow_slice(self, levels: Levels, region: Region, pose: Pose) -> None:
        unit = ForceUnit.of(levels.robot)
        if self._scaled:
            self._key_html.content = self._scale.key(unit)
        if not self._slice_box.value:
            self._nodes.remove("/slice")
            self._slice_key = None
            return
        normal = PLANES.get(self._plane.value, PLANES[self._plane.options[0]])
        plane = Plane(normal, float(pose.position[normal]))
        if self._slice_key != (self._key, plane):
            self._slice_key = (self._key, plane)
            cut = slice_of(levels.details, plane, region.low, region.high, (POINTS, POINTS))
            self._draw_slice(plane, region, self._scale.picture(cut, unit))

    def _draw_slice(self, plane: Plane, region: Region, drawn: tuple[Any, Array, Array, Marks]) -> None:
        nodes, (image, boundary, lines, marks) = self._nodes, drawn
        width, height = (region.high - region.low)[list(plane.axes)].tolist()
        middle = 0.5 * (region.low + region.high)
        middle[plane.normal] = plane.at
        looks: dict[str, Any] = {"wxyz": _TURNS[plane.normal], "position": middle, "format": "png", **NO_SHADOW}
        add = nodes.scene.add_image
        nodes.draw("/slice/picture", add, image=image, render_width=width, render_height=height, **looks)
        nodes.lines("/slice/boundary", boundary, INFEASIBLE, BOUNDARY_WIDTH)
        nodes.lines("/slice/lines", lines, LINE_COLOR, LINE_WIDTH)
        for k, mark in enumerate(marks):
            nodes.label(f"/slice/levels/{k}", *mark, "top-left", _SMALL)
        nodes.keep_first("/slice/levels", len(marks))

    def _follow_travel(self, levels: Levels, region: Region, robot: Robot, pose: Pose) -> None:
        if not self._travel_box.value:
            self._nodes.remove("/travel")
            return
        which = workspace.free_directions(robot, region.flat)
        travel = workspace.free_travel(levels.details, pose.position, which, region.low, region.high)
        self._travel_html.content = travel.text(ForceUnit.of(robot), self._without)
        # an arrow that ends at the boundary has its length as text
        ends = np.stack((np.broadcast_to(travel.start, travel.ends.shape), travel.ends), axis=1)
        self._nodes.arrows("/travel", ends, OUTWARD if travel.inside else INWARD, *(_ARROW * self._size))
        for k, which in enumerate(travel.which):
            text = f"{workspace.NAMES[which]} {travel.distance[k]:.2f} m" if travel.crossed[k] else ""
            self._nodes.label(f"/travel/{workspace.NAMES[which]}", text, travel.ends[k], scale=_TEXT_SCALE)

    def _clear(self) -> None:
        self._nodes.remove("/hull", "/wall", "/slice", "/travel")
        self._nodes.hide("/platform/left")
        self._hull_key = self._key = self._slice_key = None
        self._result = _NO_RESULT


def _draw_patches(nodes: Nodes, name: str, patches: list[workspace.Patch], side: str = "double") -> None:
    """Draw `patches` below `name`, instead of the previous patches."""
    for k, patch in enumerate(patches):
        nodes.mesh(f"{name}/{k}", *patch, side=side, **NO_SHADOW)
    nodes.keep_first(name, len(patches))


def _scale_of(levels: Levels, region: Region) -> MarginScale:
    """Colors for the range of margins in a region."""
    corners = np.linspace(region.low, region.high, COARSE)
    known = levels.details(np.stack(np.meshgrid(*corners.T), axis=-1).reshape(-1, 3)).margin
    return MarginScale.up_to(float(known[np.isfinite(known)].max(initial=0.0)))


def _load(field: Any, unit: str) -> float:
    value = float(field.value)
    if not 0.0 <= value < 1e12:
        raise InvalidValueError(field.label, value, f"0 {unit} or more", "Type a load, 0 for none.")
    return value

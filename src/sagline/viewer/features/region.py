"""Region of feasible positions, its slices, and the free travel from the pose that is shown."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Final, NamedTuple

import numpy as np
import viser

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, locked
from sagline.core.errors import SaglineError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.feature import Aside, Feature, Reading, View
from sagline.viewer.free_travel import NAMES, SpacePanel, WhereTo, free_ways, where_to
from sagline.viewer.hull import CELLS, REACH, Asked, Hull, Patch, Patches, hull_of, left, lit
from sagline.viewer.page import Page
from sagline.viewer.readout import LATER
from sagline.viewer.slices import MarginScale, Picture, picture_of
from sagline.viewer.stage import INFEASIBLE, PLATFORM, REST
from sagline.viewer.tension_scale import force_unit
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Plane, Region, region_of, slice_of
from sagline.workspaces.wrench_sets import WrenchBox

BOUNDARY, BETWEEN = INFEASIBLE, (120, 128, 138)
BOUNDARY_WIDTH, BETWEEN_WIDTH = 4.0, 1.5  # px
_SMALL, _SAID = 0.7, 0.85  # of what stands on lines, and at the platform
GO, STOP = PLATFORM, REST  # ways to where it has to stop, and ways back
_BELOW: Final = 0.04  # of the robot's size, from the platform to what is said under it
_SHAFT, _HEAD, _LONG = 0.002, 0.009, 0.03  # of an arrow, of the robot's size
# what lies in x and y of a picture: turned so that they are the two axes of a plane, by its normal
_TURNS: Final = np.array([[0.5, 0.5, 0.5, 0.5], [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])


class SpaceStage:
    """What is drawn of a workspace; nothing until it is asked for."""

    def __init__(self, server: viser.ViserServer, size: float) -> None:
        """Begin with nothing, for a robot of a size [m]."""
        self._server, self._scene, self.size = server, server.scene, size
        self._hull, self._wall = Patches(server.scene, "/hull"), Patches(server.scene, "/wall")
        self._left: Any = None
        self._slice: list[Any] = []
        self._levels: list[Any] = []
        self._plane: tuple[object, ...] = ()
        self._arrows: Any = None
        self._names: list[Any] = []

    def show_hull(self, patches: list[Patch], *, opened: bool) -> None:
        """Draw a hull in place of the one before; none for nothing."""
        with self._server.atomic():
            self._hull.show(patches, "back" if opened else "double")

    def show_wall(self, patches: list[Patch], left: str) -> None:
        """Draw what of the hull is lit in place of what was, and say at the platform how much is left."""
        with self._server.atomic():
            self._wall.show(patches)
            if self._left is None and left:
                self._left = self._scene.add_label(
                    "/platform/left",
                    left,
                    position=(0.0, 0.0, -_BELOW * self.size),
                    anchor="top-center",
                    font_screen_scale=_SAID,
                )
            if self._left is not None:
                self._left.text, self._left.visible = left, bool(left)

    def show_slice(self, plane: Plane, low: Array, high: Array, picture: Picture) -> None:
        """Draw a slice of a box in place of the one before."""
        first, second = plane.axes
        key = (plane.normal, float(low[first]), float(high[first]), float(low[second]), float(high[second]))
        place = 0.5 * (low + high)
        place[plane.normal] = plane.at
        if key != self._plane:
            self.hide_slice()
            self._plane = key
            size = high - low
            self._slice = [
                self._scene.add_image(
                    "/slice/picture", picture.image, float(size[first]), float(size[second]), format="png",
                    wxyz=_TURNS[plane.normal], position=place, cast_shadow=False, receive_shadow=False,
                ),
                *(
                    self._scene.add_line_segments(
                        f"/slice/{name}", np.zeros((1, 2, 3), dtype=np.float32), color, thickness=width,
                        thickness_units="screen",
                    )
                    for name, color, width in (
                        ("boundary", BOUNDARY, BOUNDARY_WIDTH), ("lines", BETWEEN, BETWEEN_WIDTH),
                    )
                ),
            ]  # fmt: skip
        image, *drawn = self._slice
        image.image, image.position = picture.image, place
        for handle, segments in zip(drawn, (picture.boundary, picture.lines), strict=True):
            handle.visible = len(segments) > 0
            if len(segments):
                handle.points = segments.astype(np.float32)
        for k, mark in enumerate(picture.marks):
            if k == len(self._levels):
                self._levels.append(self._scene.add_label(f"/slice/level{k}", "", font_screen_scale=_SMALL))
            self._levels[k].text, self._levels[k].position, self._levels[k].visible = mark.text, mark.place, True
        for handle in self._levels[len(picture.marks) :]:
            handle.visible = False

    def hide_slice(self) -> None:
        """Draw no slice."""
        _take_away(self._levels)
        _take_away(self._slice)
        self._plane = ()

    def show_ways(self, found: WhereTo) -> None:
        """Draw an arrow along each way, with its length in words."""
        ends = np.stack((np.broadcast_to(found.start, found.ends.shape), found.ends), axis=1).astype(np.float32)
        if self._arrows is None or len(self._names) != len(ends):
            self.hide_ways()
            self._arrows = self._scene.add_arrows(
                "/ways", ends, GO, shaft_radius=_SHAFT * self.size, head_radius=_HEAD * self.size,
                head_length=_LONG * self.size,
            )  # fmt: skip
            self._names = [
                self._scene.add_label(f"/ways/{NAMES[k]}", "", anchor="bottom-center", font_screen_scale=0.85)
                for k in found.which
            ]
        self._arrows.points = ends
        self._arrows.colors = np.tile(np.array(GO if found.inside else STOP, dtype=np.uint8), (len(ends), 1))
        for name, end, distance, which, crossed in zip(
            self._names, found.ends, found.distance, found.which, found.crossed, strict=True
        ):
            name.visible = bool(crossed)
            name.text = f"{NAMES[which]} {distance:.2f} m"
            name.position = end

    def hide_ways(self) -> None:
        """Draw no arrows."""
        _take_away(self._names)
        if self._arrows is not None:
            self._arrows.remove()
            self._arrows = None


def _take_away(handles: list[Any]) -> None:
    while handles:
        handles.pop().remove()


POINTS: Final = 40  # of a slice, along each axis of its plane
COARSE: Final = 7  # points along each axis whose margins say how far the colors reach

MakeHull = Callable[[Asked, bool, Callable[[int, int], None]], Hull]


class _SupersededError(SaglineError):
    """Something else is shown meanwhile."""


class _Made(NamedTuple):
    """A hull.

    Attributes:
        key: Of what.
        rough: Whether it is only the first.
        hull: It; None where it could not be had.
    """

    key: Hashable
    rough: bool
    hull: Hull | None


def planes_of(robot: Robot) -> tuple[int, ...]:
    """Axes at right angles to which a robot's space can be sliced: of a planar one its own."""
    flat = region_of(robot, None, CELLS).flat
    return (2, 1, 0) if flat is None else (flat,)


class RegionFeature(Feature):
    """Follows what is shown; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Build the tab."""
        self._panel = SpacePanel(page.server.gui, page.panel.readings, planes_of(page.robot), page.refresh)
        self._stage = SpaceStage(page.server, page.size)
        self._aside, self._ready = Aside(page.later), page.ready
        self._key: Hashable = None  # of what margins are of
        self._asked: Asked | None = None
        self._levels: Levels | None = None
        self._region: Region | None = None
        self._place = np.zeros(3)  # of the platform [m]
        self._scale = MarginScale(1.0)
        self._scaled: Hashable = None  # the key of what it is for
        self._made: _Made | None = None
        self._drawn: Hashable = None
        self._cut: Hashable = None  # what the slice is of
        self._share = 0.0

    @property
    def waiting(self) -> bool:
        """Whether something is to come without anybody's doing."""
        return self._aside.busy

    def depends(self, view: View) -> Hashable:
        """Nothing while nothing is asked for."""
        return view if self._panel.anything else None

    def follow(self, view: View) -> None:
        """A robot is shown at a pose; its workspace is that of this orientation."""
        panel = self._panel
        panel.arrange()
        if not self._ready(Reading.WORKSPACE):
            if panel.anything:
                panel.say(LATER.capitalize())
            return
        if not panel.anything:
            self._clear()
            return
        robot, pose, model, wrench = view.snapshot.robot, view.snapshot.pose, view.settings.model, view.wrench
        try:
            levels, region = self._prepared(robot, pose, model, wrench)
            self._follow_hull()
            self._place = pose.position
            self._follow_wall()
            self._follow_slice(levels, region, pose)
            self._follow_ways(levels, region, robot, pose)
        except SaglineError as error:
            self._clear()
            panel.refuse(str(error))

    def tick(self) -> None:
        """Say how far the hull is."""
        if self._panel.hull and self._aside.waited:
            self._panel.say(f"The region is worked out: {100.0 * self._share:.0f} %, {self._aside.waited:.0f} s so far")

    def _prepared(self, robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> tuple[Levels, Region]:
        """What gives levels and margins, made anew where it would give others; and where they are looked at."""
        loads = self._panel.loads
        key = (id(robot), pose.quaternion.tobytes(), type(model), loads, None if wrench is None else wrench.tobytes())
        if key != self._key or self._levels is None or self._region is None:
            turned = locked(np.array(pose.quaternion))
            self._asked = Asked(robot, turned, model, WrenchBox(*loads, center=wrench))  # and the id stays this robot's
            self._region, self._levels = region_of(robot, None, CELLS), self._asked.levels()
            self._key = key
        if self._scaled != key and (self._panel.slice or (self._panel.hull and not self._panel.by_cable)):
            self._scaled, self._scale = key, _scale_of(self._levels, self._region)
        return self._levels, self._region

    def _follow_hull(self) -> None:
        """Draw the latest hull there is, and have a better one made."""
        if not self._panel.hull:
            self._stage.show_hull([], opened=False)
            self._drawn = self._made = None
            return
        made = self._made
        if (made is None or made.key != self._key or made.rough) and not self._aside.busy:
            self._ask(rough=made is None or made.key != self._key)
        if made is None:
            return
        if made.hull is None:
            self._stage.show_hull([], opened=False)
            return
        look = (made.key, made.rough, self._panel.by_cable, self._panel.slice)
        if look != self._drawn:
            self._drawn = look
            patches = made.hull.by_cable if self._panel.by_cable else made.hull.by_margin(self._scale)
            self._stage.show_hull(patches, opened=self._panel.slice)
            self._panel.tell_hull(made.hull.told)

    def _ask(self, *, rough: bool) -> None:
        """Have a hull of what is shown made beside the page."""
        asked, key = self._asked, self._key
        assert asked is not None
        self._share = 0.0

        def told(done: int, total: int) -> None:  # in the thread that works it out
            self._share = min(done / max(total, 1), 1.0)
            if self._key != key and not rough:  # a rough one is shown all the same: something follows a slider
                raise _SupersededError

        def failed(message: str) -> None:
            if not message:  # superseded
                self._have(self._made)
            elif self._key == key:
                self._have(_Made(key, rough=False, hull=None))
                self._panel.refuse(message)

        self._aside.ask(lambda: hull_of(asked, rough, told), lambda hull: self._have(_Made(key, rough, hull)), failed)

    def _have(self, made: _Made | None) -> None:
        """A hull is there, or cannot be had."""
        if self._panel.hull and self._key is not None:
            self._made = made
            self._follow_hull()
            self._follow_wall()

    def _follow_wall(self) -> None:
        """Light the wall that the platform is near, and say how much is left."""
        if not self._panel.hull or self._levels is None:
            self._stage.show_wall([], "")
            return
        here = self._levels.details(self._place[None])
        text = left(float(here.margin[0]), int(here.cable[0]), force_unit(self._levels.robot))
        hull = None if self._made is None else self._made.hull
        patches = [] if hull is None else lit(hull, self._place, REACH * self._stage.size)
        self._stage.show_wall(patches, text)
        self._panel.tell_left(text)

    def _follow_slice(self, levels: Levels, region: Region, pose: Pose) -> None:
        panel, unit = self._panel, force_unit(levels.robot)
        if panel.slice or (panel.hull and not panel.by_cable):
            panel.explain(self._scale, unit)
        if not panel.slice:
            self._stage.hide_slice()
            self._cut = None
            return
        plane = Plane(panel.normal, float(pose.position[panel.normal]))
        if self._cut == (self._key, plane):
            return
        self._cut = (self._key, plane)
        cut = slice_of(levels.details, plane, region.low, region.high, (POINTS, POINTS))
        self._stage.show_slice(plane, region.low, region.high, picture_of(cut, self._scale, unit))

    def _follow_ways(self, levels: Levels, region: Region, robot: Robot, pose: Pose) -> None:
        if not self._panel.ways:
            self._stage.hide_ways()
            return
        found = where_to(levels.details, pose.position, free_ways(robot, region.flat), region.low, region.high)
        self._stage.show_ways(found)
        self._panel.tell_ways(found, force_unit(robot))

    def _clear(self) -> None:
        """Draw nothing, and forget what it was of."""
        self._stage.show_hull([], opened=False)
        self._stage.show_wall([], "")
        self._stage.hide_slice()
        self._stage.hide_ways()
        self._drawn = self._key = self._made = self._cut = None


def _scale_of(levels: Levels, region: Region) -> MarginScale:
    """Colors for all margins that there are in a region."""
    corners = np.linspace(region.low, region.high, COARSE)
    grid = np.stack(np.meshgrid(*corners.T), axis=-1).reshape(-1, 3)
    known = levels.details(grid).margin
    return MarginScale.up_to(float(known[np.isfinite(known)].max(initial=0.0)))

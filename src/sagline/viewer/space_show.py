"""The workspace beside the robot: slice, ends and wall follow the platform, the hull follows what is set.

A hull is worked out beside the page: first a rough one, then, if nothing has changed meanwhile, one in full. Until it
is there the one before stays.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, locked
from sagline.core.errors import SaglineError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.aside import Aside
from sagline.viewer.hull import CELLS, Asked, Hull
from sagline.viewer.margin_scale import MarginScale
from sagline.viewer.reading import Reading
from sagline.viewer.readout import LATER
from sagline.viewer.slice_picture import picture_of
from sagline.viewer.space_panel import SpacePanel
from sagline.viewer.space_stage import SpaceStage
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.view import View
from sagline.viewer.wall import REACH, left, lit
from sagline.viewer.where_to import free_ways, where_to
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.slice import Plane, slice_of
from sagline.workspaces.wrench_sets import WrenchBox

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
    """Axes at right angles to which a robot's space can be sliced: of a planar one its own.

    Args:
        robot: The robot.
    """
    flat = region_of(robot, None, CELLS).flat
    return (2, 1, 0) if flat is None else (flat,)


class SpaceShow:
    """Follows what is shown; all of it belongs to the thread that serves."""

    moving = False

    def __init__(
        self,
        panel: SpacePanel,
        stage: SpaceStage,
        aside: Aside,
        make: MakeHull,
        ready: Callable[[Reading], bool],
    ) -> None:
        """Begin with nothing.

        Args:
            panel: What is wanted.
            stage: Where it is drawn.
            aside: What works the hull out.
            make: Gives the hull, and tells how far it is.
            ready: Whether a reading can be had without waiting.
        """
        self._panel, self._stage, self._aside, self._make, self._ready = panel, stage, aside, make, ready
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
        asked, key, make = self._asked, self._key, self._make
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

        self._aside.ask(lambda: make(asked, rough, told), lambda hull: self._have(_Made(key, rough, hull)), failed)

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

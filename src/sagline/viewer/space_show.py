"""The workspace beside the robot: its slice and its ends follow the platform, its hull comes when nothing turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from typing import Final

import numpy as np

from sagline.arrays import Array, Indices, locked
from sagline.cables.model import CableModel
from sagline.errors import SaglineError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.aside import Aside
from sagline.viewer.hull import CELLS, Asked, Hull
from sagline.viewer.margin_scale import MarginScale
from sagline.viewer.readout import LATER, force_unit
from sagline.viewer.slice_picture import picture_of
from sagline.viewer.space_panel import SpacePanel
from sagline.viewer.space_stage import SpaceStage
from sagline.viewer.where_to import WAYS, where_to
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.slice import Plane, slice_of
from sagline.workspaces.wrench_sets import WrenchBox

POINTS: Final = 40  # of a slice, along each axis of its plane
COARSE: Final = 7  # points along each axis whose margins say how far the colors reach
RESTED: Final = 0.25  # s without a change: what is dragged has no hull on its way

MakeHull = Callable[[Asked, Callable[[int, int], None]], Hull]


def planes_of(robot: Robot) -> tuple[int, ...]:
    """Axes at right angles to which a robot's space can be sliced: of a planar one its own.

    Args:
        robot: The robot.
    """
    flat = region_of(robot, None, CELLS).flat
    return (2, 1, 0) if flat is None else (flat,)


class SpaceShow:
    """Follows what is shown; all of it belongs to the thread that serves."""

    def __init__(self, panel: SpacePanel, stage: SpaceStage, aside: Aside, make: MakeHull) -> None:
        """Begin with nothing.

        Args:
            panel: What is wanted.
            stage: Where it is drawn.
            aside: What works the hull out.
            make: Gives the hull, and tells how far it is.
        """
        self._panel, self._stage, self._aside, self._make = panel, stage, aside, make
        self._key: Hashable = None  # of what margins are of
        self._asked: Asked | None = None
        self._levels: Levels | None = None
        self._region: Region | None = None
        self._scale = MarginScale(1.0)
        self._hull: tuple[Hashable, Hull] | None = None  # with its key
        self._wanted: Hashable = None  # key of the hull that was asked for last
        self._due: float | None = None
        self._drawn: Hashable = None
        self._cut: Hashable = None  # what the slice is of
        self._share = 0.0

    @property
    def waiting(self) -> bool:
        """Whether something is to come without anybody's doing."""
        return self._due is not None or self._aside.busy

    def wait(self) -> None:
        """Say, to who asks for something, that what it takes is still compiled."""
        self._panel.arrange()
        if self._panel.anything:
            self._panel.say(LATER.capitalize())

    def follow(self, robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> None:
        """A robot is shown at a pose; its workspace is that of this orientation.

        Args:
            robot: As the settings have changed it.
            pose: Where the platform is.
            model: Cable model.
            wrench: External wrench on the platform, shape (6,); None for none.
        """
        panel = self._panel
        panel.arrange()
        if not panel.anything:
            self._clear()
            return
        try:
            levels, region = self._prepared(robot, pose, model, wrench)
            self._follow_hull()
            self._stage.open_hull(opened=panel.slice)
            self._follow_slice(levels, region, pose)
            self._follow_ways(levels, region, robot, pose)
        except SaglineError as error:
            self._clear()
            panel.refuse(str(error))

    def tick(self) -> None:
        """See whether the hull is due, and say how far it is."""
        if self._due is not None and time.monotonic() >= self._due and self._asked is not None:
            self._due, self._share = None, 0.0
            key, asked = self._key, self._asked
            self._panel.say("The hull is worked out …")
            self._aside.ask(
                lambda: self._make(asked, self._told), lambda hull: self._made(key, hull), self._panel.refuse
            )
        if self._panel.hull and self._aside.waited:
            self._panel.say(f"The hull is worked out: {100.0 * self._share:.0f} %, {self._aside.waited:.0f} s so far")

    def _told(self, done: int, total: int) -> None:
        """How far the hull is; from the thread that works it out."""
        self._share = min(done / max(total, 1), 1.0)

    def _prepared(self, robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> tuple[Levels, Region]:
        """What gives levels and margins, made anew where it would give others; and where they are looked at."""
        loads = self._panel.loads
        key = (id(robot), pose.quaternion.tobytes(), type(model), loads, None if wrench is None else wrench.tobytes())
        if key != self._key or self._levels is None or self._region is None:
            turned = locked(np.array(pose.quaternion))
            self._asked = Asked(robot, turned, model, WrenchBox(*loads, center=wrench))  # and the id stays this robot's
            self._region, self._levels = region_of(robot, None, CELLS), self._asked.levels()
            self._key, self._due, self._wanted = key, None, None
            corners = np.linspace(self._region.low, self._region.high, COARSE)
            grid = np.stack(np.meshgrid(*corners.T), axis=-1).reshape(-1, 3)
            known = self._levels.details(grid).margin
            self._scale = MarginScale.up_to(float(known[np.isfinite(known)].max(initial=0.0)))
        return self._levels, self._region

    def _follow_hull(self) -> None:
        if not self._panel.hull:
            self._stage.show_hull([])
            self._due = self._drawn = self._wanted = None
            return
        if self._hull is None or self._hull[0] != self._key:
            if self._drawn is not None:
                self._stage.show_hull([])
                self._drawn = None
            if self._wanted != self._key:
                self._wanted, self._due = self._key, time.monotonic() + RESTED
                self._panel.say("The hull comes when nothing turns or changes any more.")
            return
        hull, look = self._hull[1], (self._key, self._panel.by_cable)
        if look != self._drawn:
            self._drawn = look
            self._stage.show_hull(hull.patches(None if self._panel.by_cable else self._scale))
            self._panel.tell_hull(hull.told)

    def _made(self, key: Hashable, hull: Hull) -> None:
        self._hull = (key, hull)
        if key == self._key:
            self._follow_hull()

    def _follow_slice(self, levels: Levels, region: Region, pose: Pose) -> None:
        panel = self._panel
        if self._asked is not None and (panel.slice or (panel.hull and not panel.by_cable)):
            panel.explain(self._scale, force_unit(self._asked.robot))
        if not panel.slice:
            self._stage.hide_slice()
            self._cut = None
            return
        plane = Plane(panel.normal, float(pose.position[panel.normal]))
        if self._cut == (self._key, plane):
            return
        self._cut = (self._key, plane)
        cut = slice_of(levels.details, plane, region.low, region.high, (POINTS, POINTS))
        self._stage.show_slice(plane, region.low, region.high, picture_of(cut, self._scale))

    def _follow_ways(self, levels: Levels, region: Region, robot: Robot, pose: Pose) -> None:
        if not self._panel.ways:
            self._stage.hide_ways()
            return
        found = where_to(levels.details, pose.position, _free_ways(robot, region), region.low, region.high)
        self._stage.show_ways(found)
        self._panel.tell_ways(found, force_unit(robot))

    def _clear(self) -> None:
        """Draw nothing, and forget what it was of."""
        self._stage.show_hull([])
        self._stage.hide_slice()
        self._stage.hide_ways()
        self._due = self._drawn = self._key = self._wanted = self._cut = None


def _free_ways(robot: Robot, region: Region) -> Indices:
    """Ways along axes of the world that the platform may move along."""
    free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
    if region.flat is not None:
        free[region.flat] = False
    return np.flatnonzero(np.abs(WAYS) @ free > 0.5)

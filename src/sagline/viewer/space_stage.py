"""The workspace in the scene: its hull, a slice through it, and arrows to where it ends."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.viewer.patches import Patch, Patches
from sagline.viewer.slice_picture import Picture
from sagline.viewer.stage import INFEASIBLE, PLATFORM, REST
from sagline.viewer.where_to import NAMES, WhereTo
from sagline.workspaces.slice import Plane

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
        """Draw a hull in place of the one before; none for nothing.

        Args:
            patches: Its faces.
            opened: Whether those are left out that are nearer than the robot, which hide a slice.
        """
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

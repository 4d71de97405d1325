"""The workspace in the scene: its hull, a slice through it, and arrows to where it ends."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import viser
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sagline.arrays import Array
from sagline.viewer.slice_picture import Picture
from sagline.viewer.stage import INFEASIBLE, PLATFORM, REST
from sagline.viewer.where_to import NAMES, WhereTo
from sagline.workspaces.slice import Plane

HULL_OPACITY: Final = 0.35  # the robot inside is seen
BOUNDARY, BETWEEN = INFEASIBLE, (120, 128, 138)
BOUNDARY_WIDTH, BETWEEN_WIDTH = 3.0, 1.0  # px
GO, STOP = PLATFORM, REST  # ways to where it has to stop, and ways back
_SHAFT, _HEAD, _LONG = 0.002, 0.009, 0.03  # of an arrow, of the robot's size
# what lies in x and y of a picture: turned so that they are the two axes of a plane, by its normal
_TURNS: Final = np.array([[0.5, 0.5, 0.5, 0.5], [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])


class Patch(NamedTuple):
    """Faces of one color.

    Attributes:
        vertices: Corners [m], shape (V, 3).
        faces: Shape (F, 3).
        color: Red, green and blue, 0 to 255.
        name: What stands beside it; "" for nothing.
    """

    vertices: Array
    faces: Array
    color: tuple[int, int, int]
    name: str


class SpaceStage:
    """What is drawn of a workspace; nothing until it is asked for."""

    def __init__(self, scene: viser.SceneApi, size: float) -> None:
        """Begin with nothing, for a robot of a size [m]."""
        self._scene, self._size = scene, size
        self._meshes: list[Any] = []
        self._hull_names: list[Any] = []
        self._slice: list[Any] = []
        self._plane: tuple[object, ...] = ()
        self._arrows: Any = None
        self._names: list[Any] = []

    def show_hull(self, patches: list[Patch]) -> None:
        """Draw a hull in place of the one before; none for nothing."""
        _take_away(self._hull_names)  # before what they hang on
        _take_away(self._meshes)
        for k, patch in enumerate(patches):
            self._meshes.append(
                self._scene.add_mesh_simple(
                    f"/hull/{k}", patch.vertices.astype(np.float32), patch.faces.astype(np.uint32), color=patch.color,
                    opacity=HULL_OPACITY, side="double", cast_shadow=False, receive_shadow=False,
                )
            )  # fmt: skip
            if patch.name:
                place = _within(patch)
                name = self._scene.add_label(f"/hull/{k}/name", patch.name, position=place, font_screen_scale=0.8)
                self._hull_names.append(name)

    def open_hull(self, *, opened: bool) -> None:
        """Leave out the faces that are nearer than the robot, which hide a slice; or put them back."""
        side: Any = "back" if opened else "double"
        for mesh in self._meshes:
            if mesh.side != side:
                mesh.side = side

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

    def hide_slice(self) -> None:
        """Draw no slice."""
        _take_away(self._slice)
        self._plane = ()

    def show_ways(self, found: WhereTo) -> None:
        """Draw an arrow along each way, with its length in words."""
        ends = np.stack((np.broadcast_to(found.start, found.ends.shape), found.ends), axis=1).astype(np.float32)
        if self._arrows is None or len(self._names) != len(ends):
            self.hide_ways()
            self._arrows = self._scene.add_arrows(
                "/ways", ends, GO, shaft_radius=_SHAFT * self._size, head_radius=_HEAD * self._size,
                head_length=_LONG * self._size,
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


def _within(patch: Patch) -> Array:
    """A corner of the largest piece of the patch, as near to the piece's middle as there is."""
    ends = np.concatenate([patch.faces[:, [k, k - 1]] for k in range(3)])
    count = len(patch.vertices)
    joined = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    _, piece = connected_components(joined, directed=False)
    largest = np.bincount(piece[patch.faces[:, 0]]).argmax()
    own = patch.vertices[(piece == largest) & np.isin(np.arange(count), patch.faces)]
    return np.asarray(own[np.argmin(np.linalg.norm(own - own.mean(axis=0), axis=1))])

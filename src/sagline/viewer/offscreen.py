"""Off-screen scenes, their pictures, and the legends below the pictures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import atan, tan
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.viewer.feature import View
from sagline.viewer.player import Played
from sagline.viewer.readout import spaced_ticks
from sagline.viewer.robot_scene import TRACE_POINTS, RobotScene
from sagline.viewer.server import Messages
from sagline.viewer.tension_scale import force_unit

HEIGHT: Final = 4.0  # height of the legend in text sizes
_STOPS = 16  # number of colors of the bar


def strip_of(view: View, *remarks: str) -> dict[str, Any]:
    """Texts and colors below a picture of a view, as JSON."""
    settings, scale = view.settings, view.scale
    unit = force_unit(view.snapshot.robot)
    drawn = [(settings.sag_scale, "sag"), (settings.error_scale, "errors")]
    larger = [f"{what} drawn {factor:g} times as large" for factor, what in drawn if factor != 1.0]
    shares = np.linspace(0.0, 1.0, _STOPS)
    colors = scale.colors(scale.low * (scale.high / scale.low) ** shares)
    return {
        "title": view.snapshot.robot.name,
        "remark": ", ".join((*remarks, *larger)),
        "colors": ["#{:02x}{:02x}{:02x}".format(*map(int, color)) for color in colors],
        "ticks": [[f"{tick / unit.newtons:g}", place] for tick, place in spaced_ticks(scale)],
        "legend": f"Chord tension [{unit.name}]",
    }


PATIENCE: Final = 30.0  # longest wait for a picture [s]
NAMES: Final = ("/names", "/platform/notice")  # nodes that pictures omit
STATIC: Final = ("/hull", "/slice")  # nodes that do not change over time
BORDER: Final = 1.06  # factor on the robot's size, for a margin
SHAPES: Final = 0.8, 2.4  # smallest and largest ratio of width to height
DEEPEST: Final = 950.0  # largest depth [m]: viser does not draw objects beyond 1000 m in requested pictures
_FIRST: Final = 32  # size of the discarded first picture [px]


class Shot(NamedTuple):
    """A picture that is requested from a client's page."""

    height: int  # [px]
    width: int  # [px]
    field: float  # vertical field of view [rad]
    pixel: float  # size of a pixel at the distance of the robot [m]
    # advance of the client's camera, for robots that extend beyond the largest depth [m]
    forward: float

    @classmethod
    def of(cls, camera: viser.CameraHandle, low: Array, high: Array, width: int, height: int = 0) -> Shot:
        """Picture of the visible part of the box from `low` to `high`, for any proportions of the client's window."""
        right, up, far, forward = _seen(camera, low, high)
        rows = height or round(width / float(np.clip(right / up, *SHAPES)))
        slope = BORDER * max(up, right * rows / width)
        return cls(rows, width, 2.0 * atan(slope), 2.0 * far * slope / rows, forward)


def _seen(camera: viser.CameraHandle, low: Array, high: Array) -> tuple[float, float, float, float]:
    """Visible extents of a box, horizontal and vertical [slope], its distance, and the advance of the camera [m]."""
    try:
        eye = np.array(camera.position, dtype=np.float64).reshape(3)
        edge = tan(0.5 * float(camera.fov)) * np.array([float(camera.aspect), 1.0])
        corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        place = _turn(camera).inv().apply(corners - eye)
        if not (np.isfinite(place).all() and np.all((edge > 0.01) & (edge < 100.0))):
            raise ValueError(edge)
    except (TypeError, ValueError, ZeroDivisionError):
        step = "Reload the page."
        raise InvalidValueError("camera", "not known", "a position, a direction and a field of view", step) from None
    depth = place[:, 2]
    far, forward = float(depth.mean()), max(0.0, float(depth.max()) - DEEPEST)
    if depth.min() <= forward:  # part of the box is behind the camera
        return float(edge[0]), float(edge[1]), max(far, 0.1 * float(np.linalg.norm(high - low))), 0.0
    reach, nearer = (np.abs(place[:, :2] / (depth - nearer)[:, None]).max(axis=0) for nearer in (0.0, forward))
    right, up = (nearer * np.minimum(1.0, edge / reach)).tolist()  # the part within the window
    return right, up, far - forward, forward


def _turn(camera: viser.CameraHandle) -> Rotation:
    """Rotation from a camera's axes (right, down and forward) to the world axes."""
    return Rotation.from_quat(np.array(camera.wxyz, dtype=np.float64).reshape(4), scalar_first=True)


class _OffscreenScene:
    """A scene of one client, for pictures."""

    def __init__(
        self,
        client: viser.ClientHandle,
        server: viser.ViserServer,
        shot: Shot,
        view: View,
        played: Played | None,
        line_width: float,
    ) -> None:
        """Build the scene of the played motion, or of the view."""
        self._client, self._shot = client, shot
        snapshot = view.snapshot
        robot, home = (snapshot.robot, snapshot.pose) if played is None else (played.robot, played.at(0.0).pose)
        self._robot_scene = RobotScene(client.scene, robot, home, live=False, pixel=line_width * shot.pixel)
        if played is not None:
            self._robot_scene.show_traces(*played.traces(TRACE_POINTS, view.settings.error_scale))
        drawn = set(client.scene._handle_from_node_name)  # viser has no public list of its nodes
        for name in sorted(set(server.scene._handle_from_node_name) - drawn):
            if name.startswith(NAMES) or (played is not None and not name.startswith(STATIC)):
                client.scene.add_frame(name, show_axes=False, visible=False)
        self.show(view)
        self._render(_FIRST, _FIRST, "jpeg")  # labels appear one picture late

    def show(self, view: View) -> None:
        """Draw a view."""
        settings = view.settings
        with self._client.atomic():
            self._robot_scene.place(view.snapshot.pose)
            self._robot_scene.show(
                view.snapshot, view.scale, settings.sag_scale, settings.error_scale, ghost=view.ghost
            )

    def take(self, kind: Literal["png", "jpeg"]) -> None:
        """Make the page take and store a picture, and wait for it."""
        self._render(self._shot.height, self._shot.width, kind)

    def _render(self, height: int, width: int, kind: Literal["png", "jpeg"]) -> None:
        camera, shot = self._client.camera, self._shot
        place = camera.position + shot.forward * _turn(camera).apply([0.0, 0.0, 1.0])
        self._client.get_render(
            height, width, wxyz=camera.wxyz, position=place, fov=shot.field,
            transport_format=kind, timeout=PATIENCE,
        )  # fmt: skip


@contextmanager
def offscreen_scene(
    client: viser.ClientHandle,
    server: viser.ViserServer,
    shot: Shot,
    view: View,
    line_width: float,
    played: Played | None = None,
) -> Iterator[_OffscreenScene]:
    """Context manager of an off-screen scene."""
    try:
        yield _OffscreenScene(client, server, shot, view, played, line_width)
    finally:
        client.scene.reset()


TEXT: Final = 8.0  # text size [pt]
LINE: Final = 0.3  # points on paper per pixel on a screen; a cable is about 1 pt wide
TOPIC: Final = "picture"


class _Paper(NamedTuple):
    """Size of a printed picture."""

    width: float  # width [in]
    dots: int  # dots per inch

    @property
    def pixels(self) -> int:
        """Width [px]."""
        return round(self.width * self.dots)


# widths of IEEE columns; 600 dots per inch for line drawings
PAPERS: Final = {
    "Column, 89 mm at 600 dpi": _Paper(3.5, 600),
    "Page, 182 mm at 300 dpi": _Paper(7.16, 300),
    "Page, 182 mm at 600 dpi": _Paper(7.16, 600),
}


def save_picture(
    client: viser.ClientHandle,
    server: viser.ViserServer,
    messages: Messages,
    view: View,
    paper: _Paper,
    name: str,
    extent: tuple[Array, Array],
    *,
    strip: bool,
) -> None:
    """Make a client's page save a picture of the view from its camera, without gizmo and labels."""
    text = TEXT * paper.dots / 72.0
    beneath = round(HEIGHT * text) if strip else 0
    shot = Shot.of(client.camera, *extent, paper.pixels)
    about = {
        **strip_of(view), "name": name, "dots": paper.dots, "text": text, "strip": beneath,
        "width": shot.width, "height": shot.height + beneath,
    }  # fmt: skip
    try:
        with offscreen_scene(client, server, shot, view, LINE * paper.dots / 72.0) as scene:
            messages.send(TOPIC, about)
            scene.take("png")
    finally:
        messages.send(TOPIC, None)

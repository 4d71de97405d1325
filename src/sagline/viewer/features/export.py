"""Export of pictures, films and the scene as GLB."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import atan, ceil, log10
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.files.writing import file_stem
from sagline.robot.batch import on_platform, pulley_radius
from sagline.viewer import shapes
from sagline.viewer.camera import Camera
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.player import InMotion, Played
from sagline.viewer.readout import css_color, headline, spaced_ticks
from sagline.viewer.robot_scene import DRUM, INFEASIBLE, PLATFORM, STEEL, TRACE_POINTS, RobotScene
from sagline.viewer.server import Messages
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import ForceUnit, TensionScale

STRIP: Final = 4.0  # height of the legend in text sizes
_STOPS = 16  # number of colors of the bar


def _strip_of(view: View, *remarks: str) -> dict[str, Any]:
    """Texts and colors below a picture of a view, as JSON."""
    settings, scale = view.settings, view.scale
    unit = ForceUnit.of(view.snapshot.robot)
    drawn = [(settings.sag_scale, "sag"), (settings.error_scale, "errors")]
    larger = [f"{what} drawn {factor:g} times as large" for factor, what in drawn if factor != 1.0]
    return {
        "title": view.snapshot.robot.name,
        "remark": ", ".join((*remarks, *larger)),
        "colors": [css_color(color) for color in scale.bar(_STOPS)],
        "ticks": [[f"{tick / unit.newtons:g}", place] for tick, place in spaced_ticks(scale)],
        "legend": f"Chord tension [{unit.name}]",
    }


PATIENCE: Final = 30.0  # longest wait for a picture [s]
NAMES: Final = ("/names", "/platform/notice")  # nodes that pictures omit
STATIC: Final = ("/hull", "/slice")  # nodes that do not change over time
BORDER: Final = 1.06  # factor on the size of the picture, for a margin around the robot
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
    def of(cls, camera: Camera, low: Array, high: Array, width: int, height: int = 0) -> Shot:
        """Picture of the visible part of the box from `low` to `high`, for any proportions of the client's window."""
        right, up, far, forward = _seen(camera, low, high)
        rows = height or round(width / float(np.clip(right / up, *SHAPES)))
        slope = BORDER * max(up, right * rows / width)
        return cls(rows, width, 2.0 * atan(slope), 2.0 * far * slope / rows, forward)


def _camera_of(client: viser.ClientHandle) -> Camera:
    """Camera of a client; an unknown or extreme camera is refused."""
    camera = Camera.of(client.camera)
    if camera is None or not np.all((camera.reach > 0.01) & (camera.reach < 100.0)):
        allowed = "a position, a direction and a field of view"
        raise InvalidValueError("camera", "not known", allowed, "Reload the page.")
    return camera


def _seen(camera: Camera, low: Array, high: Array) -> tuple[float, float, float, float]:
    """Visible extents of a box, horizontal and vertical [slope], its distance, and the advance of the camera [m]."""
    place, edge = (shapes.box_corners(low, high) - camera.place) @ camera.axes, camera.reach
    depth = place[:, 2]
    far, forward = float(depth.mean()), max(0.0, float(depth.max()) - DEEPEST)
    if depth.min() <= forward:  # part of the box is behind the camera
        return float(edge[0]), float(edge[1]), max(far, 0.1 * float(np.linalg.norm(high - low))), 0.0
    reach, nearer = (np.abs(place[:, :2] / (depth - nearer)[:, None]).max(axis=0) for nearer in (0.0, forward))
    right, up = (nearer * np.minimum(1.0, edge / reach)).tolist()  # the part within the window
    return right, up, far - forward, forward


Show: TypeAlias = Callable[[View], None]  # draws a view
Take: TypeAlias = Callable[..., None]  # makes the page take a picture, "png" or "jpeg", and waits for it


WIDTH, HEIGHT, TEXT = 1920, 1080, 26  # size of a film and of its text [px]
RATE = 30.0  # pictures of a film per second
LONGEST = 120.0  # longest film [s]; a longer one would fill the memory of a browser
LINE_WIDTH = 1.4  # line width relative to that on the screen
TOPIC: Final = "film"  # topic of the description of the film
CLOCK: Final = "film clock"  # topic of the texts of its strip, before each picture
PICTURE: Final = "picture"  # topic of the description of a picture
LETTERS: Final = 8.0  # text size of a picture [pt]
LINE: Final = 0.3  # points on paper per pixel on a screen; a cable is about 1 pt wide
# width [in] and dots per inch of printed pictures: widths of IEEE columns; 600 dots per inch for line drawings
PAPERS: Final = {
    "Column, 89 mm at 600 dpi": (3.5, 600),
    "Page, 182 mm at 300 dpi": (7.16, 300),
    "Page, 182 mm at 600 dpi": (7.16, 600),
}

_CABLE_RADIUS = 0.0012  # radius of cables, as a share of the robot's size; real cables would be too thin to see
_DEAD_RADIUS = 0.0006  # radius of dead lengths, as a share of the robot's size
_Z_UP_TO_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def scene_as_glb(snapshot: Snapshot | InMotion, scale: TensionScale, sag_scale: float = 1.0) -> bytes:
    """Frame, pulleys, winches, platform and cables in meters, with y upward as in glTF."""
    import trimesh  # imported only when needed, because it takes a fifth of the start time
    from trimesh.transformations import compose_matrix, quaternion_matrix

    robot = snapshot.robot
    scene = trimesh.Scene()
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = snapshot.pose.matrix, snapshot.pose.position
    _add(scene, "frame", shapes.Solid.frame(robot), STEEL)
    for name, aboard in (("winches", False), ("winches on the platform", True)):
        winches = shapes.Solid.winches(robot, aboard=aboard)
        if len(winches.faces):
            _add(scene, name, winches, DRUM, place if aboard else None)
    for i, (radius, center, turn) in enumerate(zip(pulley_radius(robot), *snapshot.wheels(), strict=True)):
        if radius > 0.0:
            placed = compose_matrix(scale=np.full(3, radius), translate=center)
            _add(scene, f"pulley {i}", shapes.Solid.wheel(), DRUM, placed @ quaternion_matrix(turn))
    thin, with_platform = _DEAD_RADIUS * shapes.size_of(robot), on_platform(robot)
    for i, (run, known) in enumerate(zip(*shapes.dead_runs(robot), strict=True)):
        if (run[0] != run[1]).any():
            name = f"dead length {i}" if known else f"dead length {i}, path not known"
            _add(scene, name, shapes.Solid.rod(run, thin), STEEL, place if with_platform[i] else None)
    _add(scene, "platform", shapes.Solid.platform(robot), PLATFORM if snapshot.solved else INFEASIBLE, place)
    colors = scale.colors(snapshot.tension)
    for i, course in enumerate(snapshot.courses(sag_scale)):
        gaps = np.flatnonzero(np.isnan(course[:, 0]))
        for piece in np.split(course, gaps):
            known = piece[np.isfinite(piece[:, 0])]
            if len(known) > 1:
                solid = shapes.Solid.tube(known, _CABLE_RADIUS * shapes.size_of(robot))
                _add(scene, f"cable {i}", solid, tuple(colors[i]))
    scene.apply_transform(_Z_UP_TO_Y_UP)
    return bytes(scene.export(file_type="glb"))


def _add(scene: Any, name: str, solid: shapes.Solid, color: tuple[int, ...], place: Any = None) -> None:
    import trimesh

    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    shade = [*(int(part) for part in color[:3]), 255]
    look = trimesh.visual.material.PBRMaterial(baseColorFactor=shade, metallicFactor=0.1, roughnessFactor=0.7)
    mesh.visual = trimesh.visual.TextureVisuals(material=look)
    scene.add_geometry(mesh, node_name=name, geom_name=name, transform=place)


def moments(duration: float, speed: float) -> Array:
    """Times of a film's pictures [s], from 0 to the end, shape (n,), n >= 2; too long a film is refused."""
    length = duration / speed
    if length > LONGEST:
        step = "Choose a higher speed on the timeline; the film has the same speed."
        raise InvalidValueError("film", f"{length:,.0f} s long at this speed", f"at most {LONGEST:g} s", step)
    return np.linspace(0.0, duration, max(2, 1 + round(length * RATE)))


def _clock(view: View, time: float, speed: float) -> dict[str, Any]:
    digits = max(1, ceil(-log10(speed / RATE)))
    text = headline(view.snapshot) if isinstance(view.snapshot, Snapshot) else view.snapshot.notice
    return {"time": f"{time:.{digits}f} s", "text": "" if view.snapshot.solved else text}


class _Exporter:
    """Exports of one client, one at a time."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self.client = client
        self.messages = Messages(client.gui)
        self.busy = threading.Lock()
        self.cancelled = threading.Event()


Send = Callable[[_Exporter], None]


class ExportFeature(Feature):
    """Buttons for a picture, the scene, and a film; an export runs in a thread and does not block other clients."""

    def __init__(self, page: Page) -> None:
        """Build the panel."""
        server, channel = page.server, page.channel
        self._page, self._server = page, server
        self._exporters: dict[int, _Exporter] = {}
        gui = server.gui
        with gui.add_folder("Export", expand_by_default=False):
            self._paper = gui.add_dropdown("Picture for", tuple(PAPERS))
            self._strip = gui.add_checkbox("With legend", True, hint="The robot's name and the colors of tensions.")
            picture = gui.add_button("Picture (PNG)", icon=viser.Icon.CAMERA)
            scene = gui.add_button("Scene (GLB)", icon=viser.Icon.BOX)
            self._film: Any = gui.add_button("Film", icon=viser.Icon.MOVIE, visible=False)
        for button, send in ((picture, self._send_picture), (scene, self._send_scene), (self._film, self._send_film)):
            button.on_click(partial(self._export, send))
        channel.on(TOPIC, self._cancel)
        server.on_client_disconnect(self._remove)
        self.put_on(page.player.played)

    def depends(self, view: View) -> Hashable:
        """Constant key, because the panel does not depend on the view."""
        return None

    def put_on(self, played: Played | None) -> None:
        """Show the controls for a film if a motion is played."""
        self._film.visible = played is not None
        self._film.label = f"Film of the {None if played is None else played.name}"

    def _send_picture(self, exporter: _Exporter) -> None:
        """Make the client's page save a picture of the view from its camera, without gizmo and labels."""
        view, paper, client = self._page.view, PAPERS.get(self._paper.value), exporter.client
        if view is None or paper is None:
            return
        width, dots = paper
        text = LETTERS * dots / 72.0
        beneath = round(STRIP * text) if self._strip.value else 0
        shot = Shot.of(_camera_of(client), *self._page.extent, round(width * dots))
        about = {
            **_strip_of(view), "name": self._name(), "dots": dots, "text": text, "strip": beneath,
            "width": shot.width, "height": shot.height + beneath,
        }  # fmt: skip
        try:
            with self._offscreen_scene(client, shot, view, LINE * dots / 72.0) as (_, take):
                exporter.messages.send(PICTURE, about)
                take("png")
        finally:
            exporter.messages.send(PICTURE, None)

    def _send_scene(self, exporter: _Exporter) -> None:
        view = self._page.view
        if view is not None:
            glb = scene_as_glb(view.snapshot, view.scale, view.settings.sag_scale)
            exporter.client.send_file_download(f"{self._name()}.glb", glb, save_immediately=True)

    def _send_film(self, exporter: _Exporter) -> None:
        """Make the client's page record a film of the played motion from its camera; others are not affected."""
        # the settings of the view are used for all configurations; the server's scene is hidden from the client
        view, played, speed = self._page.view, self._page.player.played, self._page.player.speed
        if played is None or view is None:
            return
        exporter.cancelled.clear()
        client, send, times = exporter.client, exporter.messages.send, moments(played.duration, speed)
        strip = round(STRIP * TEXT)
        pace = () if speed == 1.0 else (f"{speed:g} × its speed",)
        about = {
            **_strip_of(view, played.name, *pace), "name": f"{self._name()}-{played.name}", "count": len(times),
            "rate": RATE, "width": WIDTH, "height": HEIGHT, "text": TEXT, "strip": strip,
        }  # fmt: skip
        shot = Shot.of(_camera_of(client), *self._page.extent, WIDTH, HEIGHT - strip)
        send(CLOCK, None)  # pictures without a clock do not belong to the film
        send(TOPIC, about)
        try:
            with self._offscreen_scene(client, shot, view, LINE_WIDTH, played) as (show, take):
                for time in times:
                    if exporter.cancelled.is_set():
                        return
                    frame = replace(view, snapshot=played.at(float(time)))
                    show(frame)
                    send(CLOCK, _clock(frame, float(time), speed))
                    take("jpeg")
        finally:
            send(TOPIC, None)  # a page with all pictures completes the film

    @contextmanager
    def _offscreen_scene(
        self, client: viser.ClientHandle, shot: Shot, view: View, line_width: float, played: Played | None = None
    ) -> Iterator[tuple[Show, Take]]:
        """Context manager of a scene of one client, for pictures of the played motion or of the view."""

        def show(view: View) -> None:
            settings = view.settings
            with client.atomic():
                scene.place(view.snapshot.pose)
                scene.show(view.snapshot, view.scale, settings.sag_scale, settings.error_scale, ghost=view.ghost)

        def take(kind: Literal["png", "jpeg"], height: int = shot.height, width: int = shot.width) -> None:
            camera = _camera_of(client)
            place = camera.place + shot.forward * camera.axes[:, 2]
            looks: dict[str, Any] = {"wxyz": client.camera.wxyz, "position": place, "fov": shot.field}
            client.get_render(height, width, transport_format=kind, timeout=PATIENCE, **looks)

        snapshot = view.snapshot
        robot, home = (snapshot.robot, snapshot.pose) if played is None else (played.robot, played.at(0.0).pose)
        try:
            scene = RobotScene(client.scene, robot, home, live=False, pixel=line_width * shot.pixel)
            if played is not None:
                scene.show_traces(*played.traces(TRACE_POINTS, view.settings.error_scale))
            drawn = set(client.scene._handle_from_node_name)  # viser has no public list of its nodes
            for name in sorted(set(self._server.scene._handle_from_node_name) - drawn):
                if name.startswith(NAMES) or (played is not None and not name.startswith(STATIC)):
                    client.scene.add_frame(name, show_axes=False, visible=False)
            show(view)
            take("jpeg", _FIRST, _FIRST)  # labels appear one picture late
            yield show, take
        finally:
            client.scene.reset()

    def _cancel(self, _: Any, client: int) -> None:
        if client in self._exporters:
            self._exporters[client].cancelled.set()

    def _remove(self, client: viser.ClientHandle) -> None:
        self._exporters.pop(client.client_id, None)

    def _name(self) -> str:
        view = self._page.view
        return "sagline" if view is None else file_stem(view.snapshot.robot.name)

    def _export(self, send: Send, event: viser.GuiEvent[Any]) -> None:
        """Export for the client of an event. No export if the client has disconnected or does not send a picture."""
        client = event.client
        if client is None:
            return
        exporter = self._exporters.setdefault(client.client_id, _Exporter(client))
        if not exporter.busy.acquire(blocking=False):
            return  # the button was pressed twice
        try:
            send(exporter)
        except (RuntimeError, TimeoutError, SaglineError) as error:
            if client.client_id in self._server.get_clients():
                late = "The page sent no picture in time. Keep it visible until the pictures are taken."
                why = late if isinstance(error, TimeoutError) else str(error)
                client.add_notification("Nothing exported", why, with_close_button=True, auto_close_seconds=8.0)
        finally:
            exporter.busy.release()

"""Export of pictures, films and the scene as GLB."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from math import ceil, log10
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.files.writing import file_stem
from sagline.robot.batch import pulleys_of
from sagline.viewer import shapes
from sagline.viewer.feature import Feature, View
from sagline.viewer.offscreen import HEIGHT as STRIP
from sagline.viewer.offscreen import PAPERS, Shot, offscreen_scene, save_picture, strip_of
from sagline.viewer.page import Page
from sagline.viewer.player import InMotion, Played
from sagline.viewer.readout import headline
from sagline.viewer.robot_scene import DRUM, INFEASIBLE, PLATFORM, STEEL
from sagline.viewer.server import Messages
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale

WIDTH, HEIGHT, TEXT = 1920, 1080, 26  # size of a picture [px]
RATE = 30.0  # pictures of a film per second
LONGEST = 120.0  # longest film [s]; a longer one would fill the memory of a browser
LINE_WIDTH = 1.4  # line width relative to that on the screen
TOPIC: Final = "film"  # topic of the description of the film
CLOCK: Final = "film clock"  # topic of the texts of its strip, before each picture


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
    _add(scene, "frame", shapes.frame_solid(robot), STEEL)
    winches = shapes.winch_solid(robot)
    if len(winches.faces):
        _add(scene, "winches", winches, DRUM)
    for i, (radius, turn) in enumerate(
        zip(pulleys_of(robot).radius, shapes.pulley_rotations(robot, snapshot.pose), strict=True)
    ):
        if radius > 0.0:
            placed = compose_matrix(scale=np.full(3, radius), translate=robot.frame_anchors[i])
            _add(scene, f"pulley {i}", shapes.wheel(), DRUM, placed @ quaternion_matrix(turn))
    thin = _DEAD_RADIUS * shapes.size_of(robot)
    for i, (run, known) in enumerate(zip(*shapes.dead_runs(robot), strict=True)):
        if run[0, 2] != run[1, 2]:
            name = f"dead length {i}" if known else f"dead length {i}, path not known"
            _add(scene, name, shapes.rod(run, thin), STEEL)
    _add(scene, "platform", shapes.platform_solid(robot), PLATFORM if snapshot.solved else INFEASIBLE, place)
    colors = scale.colors(snapshot.tension)
    for i, course in enumerate(snapshot.courses(sag_scale)):
        _add(scene, f"cable {i}", shapes.tube(course, _CABLE_RADIUS * shapes.size_of(robot)), tuple(colors[i]))
    scene.apply_transform(_Z_UP_TO_Y_UP)
    glb: bytes = scene.export(file_type="glb")
    return glb


def _add(scene: Any, name: str, solid: shapes.Solid, color: tuple[int, ...], place: Any = None) -> None:
    """Add a colored solid to a scene of trimesh."""
    import trimesh

    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    shade = [*(int(part) for part in color[:3]), 255]
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=shade, metallicFactor=0.1, roughnessFactor=0.7)
    )
    scene.add_geometry(mesh, node_name=name, geom_name=name, transform=place)


def _filmed(
    client: viser.ClientHandle,
    server: viser.ViserServer,
    messages: Messages,
    played: Played,
    view: View,
    speed: float,
    name: str,
    extent: tuple[Array, Array],
    cancelled: Callable[[], bool],
) -> None:
    """Make a client's page record a film of the played motion from its camera; other clients are not affected.

    Args:
        client: The client.
        server: The server; its scene is hidden from the client until the film is complete.
        messages: Messages to the client's page.
        played: Played motion: a run, a simulation or a log.
        view: View whose settings are used for all configurations of the motion.
        speed: Ratio of the time of the played motion to the time of the film.
        name: Name of the file, without suffix.
        extent: Lowest and highest corner of everything that is drawn [m].
        cancelled: Function that returns True if the film was cancelled.

    Raises:
        InvalidValueError: If the film would be too long.
        RuntimeError: If the client disconnects or does not send a picture.
        TimeoutError: If a picture does not arrive in time.
    """
    times = moments(played.duration, speed)
    strip = round(STRIP * TEXT)
    pace = () if speed == 1.0 else (f"{speed:g} × its speed",)
    about = {
        **strip_of(view, played.name, *pace), "name": name, "count": len(times), "rate": RATE,
        "width": WIDTH, "height": HEIGHT, "text": TEXT, "strip": strip,
    }  # fmt: skip
    shot = Shot.of(client.camera, *extent, WIDTH, HEIGHT - strip)
    messages.send(CLOCK, None)  # pictures without a clock do not belong to the film
    messages.send(TOPIC, about)
    try:
        with offscreen_scene(client, server, shot, view, LINE_WIDTH, played) as scene:
            for time in times:
                if cancelled():
                    return
                frame = replace(view, snapshot=played.at(float(time)))
                scene.show(frame)
                messages.send(CLOCK, _clock(frame, float(time), speed))
                scene.take("jpeg")
    finally:
        messages.send(TOPIC, None)  # a page with all pictures completes the film


def moments(duration: float, speed: float) -> Array:
    """Times of a film's pictures [s], from 0 to the end, shape (n,), n >= 2.

    Raises:
        InvalidValueError: If the film would be too long.
    """
    length = duration / speed
    if length > LONGEST:
        step = "Choose a higher speed on the timeline; the film has the same speed."
        raise InvalidValueError("film", f"{length:,.0f} s long at this speed", f"at most {LONGEST:g} s", step)
    return np.linspace(0.0, duration, max(2, 1 + round(length * RATE)))


def _clock(view: View, time: float, speed: float) -> dict[str, Any]:
    """Texts of the strip for one picture."""
    digits = max(1, ceil(-log10(speed / RATE)))
    text = headline(view.snapshot) if isinstance(view.snapshot, Snapshot) else view.snapshot.notice
    return {"time": f"{time:.{digits}f} s", "text": "" if view.snapshot.solved else text}


class _Exporter:
    """Exports of one client, one at a time."""

    def __init__(self, client: viser.ClientHandle) -> None:
        """Begin without exports."""
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
        self._page, self._server, self._extent = page, server, page.extent
        self._exporters: dict[int, _Exporter] = {}
        gui = server.gui
        with gui.add_folder("Export", expand_by_default=False):
            self._paper = gui.add_dropdown("Picture for", tuple(PAPERS))
            self._strip = gui.add_checkbox("With legend", True, hint="The robot's name and the colors of tensions.")
            buttons = [
                (gui.add_button("Picture (PNG)", icon=viser.Icon.CAMERA), self._send_picture),
                (gui.add_button("Scene (GLB)", icon=viser.Icon.BOX), self._send_scene),
            ]
            self._film: Any = gui.add_button("Film", icon=viser.Icon.MOVIE, visible=False)
            buttons.append((self._film, self._send_film))
        for button, send in buttons:
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
        view, paper = self._page.view, PAPERS.get(self._paper.value)
        if view is not None and paper is not None:
            messages, strip = exporter.messages, bool(self._strip.value)
            save_picture(exporter.client, self._server, messages, view, paper, self._name(), self._extent, strip=strip)

    def _send_scene(self, exporter: _Exporter) -> None:
        view = self._page.view
        if view is not None:
            glb = scene_as_glb(view.snapshot, view.scale, view.settings.sag_scale)
            exporter.client.send_file_download(f"{self._name()}.glb", glb, save_immediately=True)

    def _send_film(self, exporter: _Exporter) -> None:
        view, played, speed = self._page.view, self._page.player.played, self._page.player.speed
        if played is not None and view is not None:
            exporter.cancelled.clear()
            client, name = exporter.client, f"{self._name()}-{played.name}"
            messages, cancelled = exporter.messages, exporter.cancelled.is_set
            _filmed(client, self._server, messages, played, view, speed, name, self._extent, cancelled)

    def _cancel(self, _: Any, client: int) -> None:
        """Cancel the film of a client."""
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
                client.add_notification("Nothing exported", _why(error), with_close_button=True, auto_close_seconds=8.0)
        finally:
            exporter.busy.release()


def _why(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return "The page sent no picture in time. Keep it visible until the pictures are taken."
    return str(error)

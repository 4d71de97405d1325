"""The panel of what one takes away, and how it gets to the client that asked."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import viser

from sagline.files.names import file_stem
from sagline.viewer.export import picture_as_png, pictures_as_gif, scene_as_glb
from sagline.viewer.run import Run
from sagline.viewer.view import View

Send = Callable[[viser.ClientHandle], None]

WIDTH, HEIGHT = 1600, 1000  # px, of a picture
FILM_WIDTH, FILM_HEIGHT, FILM_FRAMES, FILM_TIME = 720, 450, 60, 0.08  # px, px, frames, s a frame
PATIENCE = 20.0  # s to wait for a client's picture


class ExportPanel:
    """Buttons for a picture, the scene, and a film of the run."""

    def __init__(
        self,
        server: viser.ViserServer,
        soon: Callable[[Callable[[], None]], None],
        view: Callable[[], View | None],
        show_at: Callable[[float], None],
        run: Run | None,
    ) -> None:
        """Build the panel.

        Args:
            server: The server.
            soon: Has the serving thread do something.
            view: What is shown now.
            show_at: Shows the run at a time [s].
            run: The run, if there is one.
        """
        self._view = view
        self._show_at = show_at
        self._run = run
        with server.gui.add_folder("Take away", expand_by_default=False):
            buttons = [
                (server.gui.add_button("Picture (PNG)", icon=viser.Icon.CAMERA), self._send_picture),
                (server.gui.add_button("Scene (GLB)", icon=viser.Icon.BOX), self._send_scene),
            ]
            if run is not None:
                buttons.append((server.gui.add_button("Film of the run (GIF)", icon=viser.Icon.MOVIE), self._send_film))
        for button, send in buttons:
            button.on_click(partial(_ordered, soon, send))

    def _send_picture(self, client: viser.ClientHandle) -> None:
        height, width = _fitting(client, WIDTH, HEIGHT)
        picture = client.get_render(height, width, transport_format="png", timeout=PATIENCE)
        client.send_file_download(f"{self._name()}.png", picture_as_png(picture), save_immediately=True)

    def _send_scene(self, client: viser.ClientHandle) -> None:
        view = self._view()
        if view is not None:
            glb = scene_as_glb(view.snapshot, view.scale, view.settings.sag_scale)
            client.send_file_download(f"{self._name()}.glb", glb, save_immediately=True)

    def _send_film(self, client: viser.ClientHandle) -> None:
        if self._run is None:
            return
        height, width = _fitting(client, FILM_WIDTH, FILM_HEIGHT)
        pictures = []
        for moment in np.linspace(0.0, self._run.duration, FILM_FRAMES):
            self._show_at(float(moment))
            pictures.append(client.get_render(height, width, transport_format="jpeg", timeout=PATIENCE))
        client.send_file_download(f"{self._name()}.gif", pictures_as_gif(pictures, FILM_TIME), save_immediately=True)

    def _name(self) -> str:
        view = self._view()
        return "sagline" if view is None else file_stem(view.snapshot.robot.name)


def _ordered(soon: Callable[[Callable[[], None]], None], send: Send, event: viser.GuiEvent[Any]) -> None:
    soon(lambda: _sent(event.client, send))


def _sent(client: viser.ClientHandle | None, send: Send) -> None:
    """Send something to a client; one that has gone, or gives no picture, gets nothing."""
    if client is None:
        return
    try:
        send(client)
    except (RuntimeError, TimeoutError) as error:
        client.add_notification("Nothing to take away", str(error), with_close_button=True, auto_close_seconds=8.0)


def _fitting(client: viser.ClientHandle, width: int, height: int) -> tuple[int, int]:
    """Height and width of a picture of the client's own proportions, no larger than asked."""
    aspect = client.camera.aspect
    scale = min(width / aspect, float(height)) if aspect > 0.0 else float(height)
    return max(1, round(scale)), max(1, round(scale * aspect)) if aspect > 0.0 else width

"""The panel of what one takes away, and how it gets to the client that asked."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from sagline.files.names import file_stem
from sagline.viewer.export import picture_as_png, pictures_as_gif, scene_as_glb
from sagline.viewer.film import FRAME_TIME, PATIENCE, filmed, fitting
from sagline.viewer.played import Played
from sagline.viewer.view import View

Send = Callable[[viser.ClientHandle], None]

WIDTH, HEIGHT = 1600, 1000  # px, of a picture


class ExportPanel:
    """Buttons for a picture, the scene, and a film of the run; who asks waits in a thread of viser, others do not."""

    def __init__(
        self, server: viser.ViserServer, view: Callable[[], View | None], played: Callable[[], Played | None]
    ) -> None:
        """Build the panel.

        Args:
            server: The server.
            view: What is shown now.
            played: What is played now, if anything is.
        """
        self._server = server
        self._view = view
        self._played = played
        self._filming: set[int] = set()  # clients
        with server.gui.add_folder("Take away", expand_by_default=False):
            buttons = [
                (server.gui.add_button("Picture (PNG)", icon=viser.Icon.CAMERA), self._send_picture),
                (server.gui.add_button("Scene (GLB)", icon=viser.Icon.BOX), self._send_scene),
            ]
            self._film: Any = server.gui.add_button("Film", icon=viser.Icon.MOVIE, visible=False)
            buttons.append((self._film, self._send_film))
        for button, send in buttons:
            button.on_click(partial(self._sent, send))

    def offer_film(self, of: str | None) -> None:
        """Offer a film of what is played, or none."""
        self._film.visible = of is not None
        self._film.label = f"Film of the {of} (GIF)"

    def _send_picture(self, client: viser.ClientHandle) -> None:
        height, width = fitting(client, WIDTH, HEIGHT)
        picture = client.get_render(height, width, transport_format="png", timeout=PATIENCE)
        client.send_file_download(f"{self._name()}.png", picture_as_png(picture), save_immediately=True)

    def _send_scene(self, client: viser.ClientHandle) -> None:
        view = self._view()
        if view is not None:
            glb = scene_as_glb(view.snapshot, view.scale, view.settings.sag_scale)
            client.send_file_download(f"{self._name()}.glb", glb, save_immediately=True)

    def _send_film(self, client: viser.ClientHandle) -> None:
        view, played = self._view(), self._played()
        if played is None or view is None or client.client_id in self._filming:
            return
        self._filming.add(client.client_id)
        try:
            film = pictures_as_gif(filmed(client, played, view), FRAME_TIME)
        finally:
            self._filming.discard(client.client_id)
        client.send_file_download(f"{self._name()}.gif", film, save_immediately=True)

    def _name(self) -> str:
        view = self._view()
        return "sagline" if view is None else file_stem(view.snapshot.robot.name)

    def _sent(self, send: Send, event: viser.GuiEvent[Any]) -> None:
        """Send something to the client that asked; one that has gone, or gives no picture, gets nothing."""
        client = event.client
        if client is None:
            return
        try:
            send(client)
        except (RuntimeError, TimeoutError) as error:
            if client.client_id in self._server.get_clients():
                client.add_notification(
                    "Nothing to take away", str(error), with_close_button=True, auto_close_seconds=8.0
                )

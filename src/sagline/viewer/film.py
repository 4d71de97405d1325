"""A film of a run, made in the browser of the one who asked: in a scene of its own that nobody else sees."""

from __future__ import annotations

import numpy as np
import viser

from sagline.viewer.export import Picture
from sagline.viewer.played import Played
from sagline.viewer.stage import TRACE_POINTS, Stage
from sagline.viewer.view import View

WIDTH, HEIGHT, FRAMES, FRAME_TIME = 720, 450, 60, 0.08  # px, px, frames, s a frame
PATIENCE = 20.0  # s to wait for a picture


def filmed(client: viser.ClientHandle, run: Played, view: View) -> list[Picture]:
    """Pictures of a run from its beginning to its end, from where a client's camera is.

    The client's own scene hides the server's while the film is made: other clients see and drag what they did.

    Args:
        client: Who asked; is told how far it is.
        run: The run, or simulation.
        view: How it is drawn.

    Returns:
        Pictures of the client's proportions, shape (h, w, 3).

    Raises:
        RuntimeError: If the client goes, or gives no picture.
        TimeoutError: If it gives none for too long.
    """
    height, width = fitting(client, WIDTH, HEIGHT)
    stage = Stage(client.scene, run.robot, run.home, draggable=False)
    note = client.add_notification(f"Film of the {run.name}", "", loading=True, with_close_button=False)
    settings, pictures = view.settings, []
    try:
        stage.show_traces(*run.traces(TRACE_POINTS, settings.error_scale))
        client.get_render(height, width, transport_format="jpeg", timeout=PATIENCE)  # names come a picture late
        for i, moment in enumerate(np.linspace(0.0, run.duration, FRAMES)):
            note.body = f"Picture {i + 1} of {FRAMES}. Others see nothing of it."
            snapshot = run.sight(float(moment))
            with client.atomic():
                stage.place(snapshot.pose)
                stage.show(snapshot, view.scale, settings.sag_scale, settings.error_scale, ghost=view.ghost)
            pictures.append(client.get_render(height, width, transport_format="jpeg", timeout=PATIENCE))
    finally:
        client.scene.reset()
        note.remove()
    return pictures


def fitting(client: viser.ClientHandle, width: int, height: int) -> tuple[int, int]:
    """Height and width of a picture of the client's own proportions, no larger than asked."""
    aspect = client.camera.aspect
    if aspect <= 0.0:
        return height, width
    scale = min(width / aspect, float(height))
    return max(1, round(scale)), max(1, round(scale * aspect))

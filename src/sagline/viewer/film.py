"""A film of what is played, made in the browser of the one who asked; `browser/film.js` keeps its pictures and records.

A browser that may not encode a film by itself records in real time, whatever a picture took: then all pictures are
taken first, as long as that lasts, and shown to its recorder at the pace of the film.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import ceil, log10
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.viewer.channel import Told
from sagline.viewer.played import Played
from sagline.viewer.readout import headline
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.strip import HEIGHT as STRIP
from sagline.viewer.strip import strip_of
from sagline.viewer.studio import Shot, studio
from sagline.viewer.view import View

WIDTH, HEIGHT, TEXT = 1920, 1080, 26  # px
RATE = 30.0  # pictures a second
LONGEST = 120.0  # s of film: more pictures than that fill a browser's memory
LINE_WIDTH = 1.4  # for those of a screen
TOPIC: Final = "film"  # what the film is, once
CLOCK: Final = "film clock"  # what its strip says, before each picture


def filmed(
    client: viser.ClientHandle,
    server: viser.ViserServer,
    told: Told,
    played: Played,
    view: View,
    speed: float,
    name: str,
    extent: tuple[Array, Array],
    cancelled: Callable[[], bool],
) -> None:
    """Have a client's page film what is played from its beginning to its end, from where its camera is.

    Args:
        client: Who asked.
        server: The server, whose scene is hidden from that client meanwhile; others see and drag what they did.
        told: What that page is told.
        played: The run, or simulation.
        view: How it is drawn.
        speed: Time of what is played a second of film.
        name: Of the file, without its suffix.
        extent: Lowest and highest corner of what there is to see [m].
        cancelled: Whether nobody wants it any more.

    Raises:
        InvalidValueError: If the film would be too long.
        RuntimeError: If the client goes, or gives no picture.
        TimeoutError: If it gives none for too long.
    """
    times = moments(played.duration, speed)
    strip = round(STRIP * TEXT)
    pace = () if speed == 1.0 else (f"{speed:g} × its speed",)
    about = {
        **strip_of(view, played.name, *pace), "name": name, "count": len(times), "rate": RATE,
        "width": WIDTH, "height": HEIGHT, "text": TEXT, "strip": strip,
    }  # fmt: skip
    shot = Shot.of(client.camera, *extent, WIDTH, HEIGHT - strip)
    told.tell(CLOCK, None)  # pictures without a clock are none of the film's
    told.tell(TOPIC, about)
    try:
        with studio(client, server, shot, view, LINE_WIDTH, played) as scene:
            for time in times:
                if cancelled():
                    return
                sight = replace(view, snapshot=played.sight(float(time)))
                scene.show(sight)
                told.tell(CLOCK, _clock(sight, float(time), speed))
                scene.take("jpeg")
    finally:
        told.tell(TOPIC, None)  # nothing more comes; a page that has all pictures records them nevertheless


def moments(duration: float, speed: float) -> Array:
    """Times of a film's pictures [s], from 0 to the end, shape (n,), n >= 2.

    Raises:
        InvalidValueError: If the film would be too long.
    """
    length = duration / speed
    if length > LONGEST:
        step = "Choose a higher speed above: the film has the speed at which it plays."
        raise InvalidValueError("film", f"{length:,.0f} s long at this speed", f"at most {LONGEST:g} s", step)
    return np.linspace(0.0, duration, max(2, 1 + round(length * RATE)))


def _clock(view: View, time: float, speed: float) -> dict[str, Any]:
    """What changes in the strip from picture to picture."""
    digits = max(1, ceil(-log10(speed / RATE)))
    said = headline(view.snapshot) if isinstance(view.snapshot, Snapshot) else view.snapshot.notice
    return {"time": f"{time:.{digits}f} s", "said": "" if view.snapshot.feasible else said}

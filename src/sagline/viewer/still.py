"""A picture for paper: as wide as a column or a page, whatever the window, with what its colors mean beneath it."""

from __future__ import annotations

from typing import Final, NamedTuple

import viser

from sagline.core.arrays import Array
from sagline.viewer.channel import Told
from sagline.viewer.strip import HEIGHT as STRIP
from sagline.viewer.strip import strip_of
from sagline.viewer.studio import Shot, studio
from sagline.viewer.view import View

TEXT: Final = 8.0  # pt
LINE: Final = 0.3  # pt on paper for a pixel on a screen: about one for a cable
TOPIC: Final = "picture"


class Paper(NamedTuple):
    """Where a picture is printed.

    Attributes:
        width: Of the picture [in].
        dots: An inch.
    """

    width: float
    dots: int

    @property
    def pixels(self) -> int:
        """Columns of the picture."""
        return round(self.width * self.dots)


# widths of the IEEE's columns; what is finer than 300 dots an inch is for lines
PAPERS: Final = {
    "Column, 89 mm at 600 dpi": Paper(3.5, 600),
    "Page, 182 mm at 300 dpi": Paper(7.16, 300),
    "Page, 182 mm at 600 dpi": Paper(7.16, 600),
}


def pictured(
    client: viser.ClientHandle,
    server: viser.ViserServer,
    told: Told,
    view: View,
    paper: Paper,
    name: str,
    extent: tuple[Array, Array],
    *,
    strip: bool,
) -> None:
    """Have a client's page save a picture of what is shown, from where its camera is, without gizmo and names.

    Args:
        client: Who asked.
        server: The server.
        told: What that page is told.
        view: What is shown.
        paper: For where.
        name: Of the file, without its suffix.
        extent: Lowest and highest corner of what there is to see [m].
        strip: Whether it is said beneath what it is, and what its colors mean.

    Raises:
        InvalidValueError: If the client has told no camera that could be.
        RuntimeError: If the client goes, or gives no picture.
        TimeoutError: If it gives none for too long.
    """
    text = TEXT * paper.dots / 72.0
    beneath = round(STRIP * text) if strip else 0
    shot = Shot.of(client.camera, *extent, paper.pixels)
    about = {
        **strip_of(view), "name": name, "dots": paper.dots, "text": text, "strip": beneath,
        "width": shot.width, "height": shot.height + beneath,
    }  # fmt: skip
    try:
        with studio(client, server, shot, view, LINE * paper.dots / 72.0) as scene:
            told.tell(TOPIC, about)
            scene.take("png")
    finally:
        told.tell(TOPIC, None)

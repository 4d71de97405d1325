"""The page: viser's client with a title, an icon, styles and scripts of our own in its head.

viser has no setting for any of these. Its web server reads the client from a folder, and this stands in that folder's
place; nothing is written to disk, and the client itself stays what it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, cast
from urllib.parse import quote

from viser import infra

STYLES: Final = ("page.css", "state.css", "keys.css", "balance.css", "film.css", "timeline.css")
SCRIPTS: Final = (  # in the order in which they run, before viser's client
    "theme.js", "channel.js", "choices.js", "dress.js", "dialog.js",
    "pose.js", "copies.js", "link.js", "names.js", "said.js", "keys.js",
    "dot.js", "hand.js",
    "strip.js", "pictures.js", "mp4.js", "recorder.js", "film.js",
    "timeline_plot.js", "timeline.js",
)  # fmt: skip
_STOCK = infra.WebsockServer
_ICON = (  # a platform on two cables that sag
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" fill="#10335c"/>'
    '<path d="M4 6Q7 19 13 20M28 6Q25 19 19 20" fill="none" stroke="#f9973f"'
    ' stroke-width="2.6" stroke-linecap="round"/>'
    '<rect x="11" y="18" width="10" height="7" rx="1.5" fill="#5fa5e1"/></svg>'
)


@dataclass(frozen=True, slots=True)
class Page:
    """A file or folder of viser's client, as much of a path as its web server asks for.

    Attributes:
        path: Where it is.
        title: Title of the page.
    """

    path: Path
    title: str

    def __truediv__(self, name: str) -> Page:
        """A file in this folder."""
        return Page(self.path / name, self.title)

    def is_file(self) -> bool:
        """Whether it is a file."""
        return self.path.is_file()

    def read_bytes(self) -> bytes:
        """Its content; of the first page, dressed."""
        content = self.path.read_bytes()
        return dressed(content.decode(), self.title).encode() if self.path.name == "index.html" else content


def dressed(html: str, title: str) -> str:
    """A page with our title, icon, styles and scripts at the end of its head: what comes last holds."""
    ours = files("sagline.viewer").joinpath("browser")
    style, script = ("".join(ours.joinpath(name).read_text("utf-8") for name in names) for names in (STYLES, SCRIPTS))
    html = html.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1).replace('rel="icon"', "", 1)
    icon = f'<link rel="icon" href="data:image/svg+xml,{quote(_ICON)}">'
    before, after = html.split("</head>", 1)
    return f"{before}{icon}<style>{style}</style><script>{script}</script></head>{after}"


@contextmanager
def served(title: str) -> Iterator[None]:
    """While inside, a viser server that is made serves our page."""

    class PageServer(_STOCK):
        def __init__(self, **options: Any) -> None:
            page = cast("Path", Page(options.pop("http_server_root"), title))
            super().__init__(http_server_root=page, **options)

    infra.WebsockServer = PageServer  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        infra.WebsockServer = _STOCK  # type: ignore[misc]

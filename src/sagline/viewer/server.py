"""Web server: viser on the loopback address, with our title, styles and scripts in its page."""

from __future__ import annotations

import errno
import logging
import socket
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from io import StringIO
from pathlib import Path
from typing import Any, Final, cast
from urllib.parse import quote

import viser
from viser import infra

from sagline.core.errors import InvalidValueError

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
class ClientFile:
    """A file or folder of viser's client, as much of a path as its web server asks for."""

    path: Path  # where it is
    title: str  # title of the page

    def __truediv__(self, name: str) -> ClientFile:
        """A file in this folder."""
        return ClientFile(self.path / name, self.title)

    def is_file(self) -> bool:
        """True if it is a file."""
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
            page = cast("Path", ClientFile(options.pop("http_server_root"), title))
            super().__init__(http_server_root=page, **options)

    infra.WebsockServer = PageServer  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        infra.WebsockServer = _STOCK  # type: ignore[misc]


LOOPBACK = "127.0.0.1"
PORT = 8080
NAME = "sagline"
LOUD = ("websockets.server", "asyncio")  # loggers

_running: list[Server] = []
_quieted = ExitStack()  # what is quiet for the whole process while any server runs


class Server(viser.ViserServer):
    """A viser server with our page, that no page can ask to open a tunnel to the internet."""

    def __init__(self, host: str, port: int, title: str) -> None:
        """Start serving; `title` stands at the top of the panel and in the browser's tab."""
        with served(title if title == NAME else f"{title} – {NAME}"):
            super().__init__(host=host, port=port, label=title, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: viser would publish this machine's page under a public address."""
        return None


def started(host: str = LOOPBACK, port: int = PORT, title: str = NAME) -> Server:
    """A running server.

    Args:
        host: Address to listen on; "0.0.0.0" is every one.
        port: Port; 0 for any that is free.
        title: What stands at the top of the panel.

    Raises:
        InvalidValueError: If nothing can listen there; viser itself would take the next port, or wait for ever.
    """
    _check(host, port)
    with ExitStack() as quieted:
        if not _running:
            quieted.enter_context(_quiet())
        with redirect_stdout(StringIO()):
            server = Server(host, port, title)
        _running.append(server)
        _quieted.push(quieted.pop_all())
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    return server


def stop(server: Server) -> None:
    """Stop it and its threads; after the last one, logging and warnings are as they were before the first."""
    with redirect_stdout(StringIO()):
        server.stop()
    _running[:] = [other for other in _running if other is not server]
    if not _running:
        _quieted.close()


def url(server: Server, host: str) -> str:
    """The address to open in a browser on this machine."""
    shown = "localhost" if host in ("0.0.0.0", "::", "") else f"[{host}]" if ":" in host else host
    return f"http://{shown}:{server.get_port()}"


@contextmanager
def _quiet() -> Iterator[None]:
    """A client that says nonsense is cut off or not heard, one that leaves gets no more; neither is news to anybody.

    Nor is it that a platform which stands on end has many triples of angles: one of them is shown.
    """
    levels = {name: logging.getLogger(name).level for name in LOUD}
    for name in LOUD:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    ours = []
    for message in ("Queued a .* on a closed connection", "Gimbal lock detected"):
        warnings.filterwarnings("ignore", message=message)
        ours.append(warnings.filters[0])
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)
        for each in ours:
            with suppress(ValueError):  # somebody may have taken it away
                warnings.filters.remove(each)  # type: ignore[attr-defined]


def _check(host: str, port: int) -> None:
    if not 0 <= port <= 65535:
        raise InvalidValueError("port", port, "0 to 65535", "Choose another with --port.")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except (OSError, UnicodeError) as error:
        if getattr(error, "errno", None) == errno.EADDRINUSE:
            step = "Choose another with --port; --port 0 takes any that is free."
            raise InvalidValueError(f"port {port}", f"in use on {host}", "a free port", step) from None
        reason = getattr(error, "strerror", None) or error
        raise InvalidValueError(
            f"{host}:{port}",
            f"nothing to listen on ({reason})",
            "an address of this machine and a free port",
            "Choose others with --host and --port; --port 0 takes any that is free.",
        ) from None

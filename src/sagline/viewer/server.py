"""Web server of viser's page with additional title, styles and scripts, and the channel for messages of pages.

The channel, whose other end is browser/channel.js, is independent of viser's own messages. Messages from pages arrive
in a hidden text field. Messages to pages are hidden pieces of HTML, which viser repeats to clients that connect later.
"""

from __future__ import annotations

import errno
import json
import logging
import socket
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from html import escape
from importlib.resources import files
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, NamedTuple, cast
from urllib.parse import quote

import numpy as np
import viser
import websockets
from viser import infra
from viser.infra import _infra

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.viewer.access import Access, bracketed

STYLES: Final = ("page.css", "state.css", "keys.css", "balance.css", "film.css", "timeline.css")
SCRIPTS: Final = (  # in the order of execution, before viser's client
    "theme.js", "channel.js", "choices.js", "dress.js", "dialog.js",
    "pose.js", "factors.js", "control.js", "copies.js", "link.js", "names.js", "said.js", "keys.js",
    "dot.js", "hand.js",
    "strip.js", "pictures.js", "mp4.js", "recorder.js", "film.js",
    "timeline_plot.js", "timeline.js",
)  # fmt: skip
NAME: Final = "sagline"  # title, label of the hidden text field, and prefix of the hidden pieces of HTML
LOOPBACK: Final = "127.0.0.1"
PORT: Final = 8080
LOUD: Final = ("websockets.server", "asyncio")  # loggers whose entries are suppressed
LONGEST: Final = 10_000  # largest number of characters in a message from a page
_STOCK = infra.WebsockServer
_ICON = (  # icon: a platform on two cables that sag
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" fill="#10335c"/>'
    '<path d="M4 6Q7 19 13 20M28 6Q25 19 19 20" fill="none" stroke="#f9973f"'
    ' stroke-width="2.6" stroke-linecap="round"/>'
    '<rect x="11" y="18" width="10" height="7" rx="1.5" fill="#5fa5e1"/></svg>'
)


Handler = Callable[[Any, int], None]


class ClientFile(NamedTuple):
    """A file or folder of viser's client, with the methods of `Path` that the web server uses."""

    path: Path
    title: str  # title of the page

    def __truediv__(self, name: str) -> ClientFile:
        """A file or folder in this folder."""
        return ClientFile(self.path / name, self.title)

    def is_file(self) -> bool:
        """True if it is a file."""
        return self.path.is_file()

    def read_bytes(self) -> bytes:
        """Content of the file; the content of the first page is `_own_page`."""
        content = self.path.read_bytes()
        return page_html(content.decode(), self.title).encode() if self.path.name == "index.html" else content


def page_html(html: str, title: str) -> str:
    """Page of viser with another title and icon; the last styles and scripts in its head take precedence."""
    ours = files("sagline.viewer").joinpath("browser")
    style, script = ("".join(ours.joinpath(name).read_text("utf-8") for name in names) for names in (STYLES, SCRIPTS))
    html = html.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1).replace('rel="icon"', "", 1)
    icon = f'<link rel="icon" href="data:image/svg+xml,{quote(_ICON)}">'
    before, after = html.split("</head>", 1)
    return f"{before}{icon}<style>{style}</style><script>{script}</script></head>{after}"


@contextmanager
def _serving_our_page(title: str, access: Access) -> Iterator[None]:
    """Context manager. A viser server that is created inside serves the changed page and checks requests."""

    class PageServer(_STOCK):
        def __init__(self, **options: Any) -> None:
            page = cast("Path", ClientFile(options.pop("http_server_root"), title))
            super().__init__(http_server_root=page, **options)

    checked = SimpleNamespace(server=SimpleNamespace(serve=access.checked_serve))
    infra.WebsockServer = PageServer  # type: ignore[misc, assignment]
    module: Any = _infra
    module.websockets = SimpleNamespace(**vars(websockets) | {"asyncio": checked})
    try:
        yield
    finally:
        infra.WebsockServer = _STOCK  # type: ignore[misc]
        module.websockets = websockets


_running: list[PageServer] = []
_quiet_process = ExitStack()  # suppresses the logs of the whole process while a server runs


class PageServer(viser.ViserServer):
    """A viser server with the changed page and checked requests; no page can make it open a tunnel to the internet."""

    def __init__(self, host: str, port: int, title: str, access: Access) -> None:
        """Start serving, with a title for the panel and the browser's tab."""
        self.access = access
        with _serving_our_page(title if title == NAME else f"{title} – {NAME}", access):
            super().__init__(host=host, port=port, label=title, verbose=False)

    @property
    def url(self) -> str:
        """The address for a browser on this computer, with the token."""
        return self.url_at(self.access.path)

    def url_at(self, path: str, host: str = "") -> str:
        """The address of a path, at a host; "" for an address for this computer."""
        own = self.get_host()
        place = host or ("localhost" if own in ("0.0.0.0", "::", "") else own)
        return f"http://{bracketed(place)}:{self.get_port()}{path}"

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Reject the request for a tunnel, because viser would publish the page under a public address."""
        return None


def start_server(host: str = LOOPBACK, port: int = PORT, title: str = NAME, **limits: Any) -> PageServer:
    """Start a server on an address and a port (0: any free port); `limits`: arguments of `Access`."""
    _check(host, port)  # viser itself would take the next port or wait forever
    access = Access(host, **limits)
    with ExitStack() as quiet:
        if not _running:
            quiet.enter_context(_quiet())
        with redirect_stdout(StringIO()):
            server = PageServer(host, port, title, access)
            if not access.guards:
                server.stop()
                allowed = "a version that serves with websockets.asyncio.server.serve"
                raise InvalidValueError("viser", viser.__version__, allowed, "Install viser==1.1.1.")
        _running.append(server)
        _quiet_process.push(quiet.pop_all())
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    return server


def stop_server(server: PageServer) -> None:
    """Stop a server and its threads; after the last one, logging and warnings are restored."""
    with redirect_stdout(StringIO()):
        server.stop()
    _running[:] = [other for other in _running if other is not server]
    if not _running:
        _quiet_process.close()


@contextmanager
def _quiet() -> Iterator[None]:
    """Context without log entries and warnings about disconnected clients, invalid messages and gimbal lock."""
    # a rotation with gimbal lock has many sets of three angles; one of them is shown
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
            with suppress(ValueError):  # another thread may have removed it
                warnings.filters.remove(each)  # type: ignore[attr-defined]


def _check(host: str, port: int) -> None:
    if not 0 <= port <= 65535:
        raise InvalidValueError("port", port, "0 to 65535", "Choose another with --port.")
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, address = found[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except (OSError, UnicodeError) as error:
        if getattr(error, "errno", None) == errno.EADDRINUSE:
            step = "Choose another with --port; --port 0 takes any that is free."
            raise InvalidValueError(f"port {port}", f"in use on {host}", "a free port", step) from None
        value = f"nothing to listen on ({getattr(error, 'strerror', None) or error})"
        allowed = "an address of this machine and a free port"
        step = "Choose others with --host and --port; --port 0 takes any that is free."
        raise InvalidValueError(f"{host}:{port}", value, allowed, step) from None


def typed(field: Any, longest: int = 40) -> str:
    """Text of a field without superfluous spaces, up to `longest` characters."""
    return " ".join(str(field.value).split())[:longest]


def toggle(field: Any, value: Any) -> None:
    """Write a clicked value into a field; a second click empties the field."""
    field.value = "" if str(value) == typed(field) else str(value)


def finite_numbers(value: Any, count: int, largest: float) -> Array | None:
    """Exactly `count` numbers of magnitudes up to `largest`, from the unchecked list of a message; None for others."""
    if not isinstance(value, list) or len(value) != count:
        return None
    if not all(type(each) in (int, float) and abs(each) <= largest for each in value):  # also excludes NaN
        return None
    return np.array(value, dtype=np.float64)


class Messages:
    """Messages to pages, the latest of each topic; values are JSON values."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Begin without messages."""
        self._gui = gui
        self._sent: dict[str, Any] = {}  # HTML, by topic

    def send(self, topic: str, value: Any) -> None:
        """Send a value under a topic; it replaces the previous value."""
        content = f"{NAME}:{topic}:{json.dumps(value, separators=(',', ':'), allow_nan=False)}"
        if topic not in self._sent:
            self._sent[topic] = self._gui.add_html(content, visible=False)
        elif self._sent[topic].content != content:
            self._sent[topic].content = content


class Channel(Messages):
    """Messages between server and pages."""

    def __init__(self, gui: viser.GuiApi, later: Callable[[Callable[[], None]], None]) -> None:
        """Add the text field; `later` makes the serving thread call a function."""
        super().__init__(gui)
        self._later = later
        self._handlers: dict[str, Handler] = {}
        self._clients: dict[int, Messages] = {}  # clients by number
        self._field = gui.add_text(NAME, "", visible=False)

        @self._field.on_update
        async def _(event: Any) -> None:  # coroutines preserve the order of messages, which viser's threads do not
            self._receive(event.target.value, event.client_id)

    def on(self, topic: str, handler: Handler) -> None:
        """Make the serving thread call a handler with the messages of a topic."""
        self._handlers[topic] = handler

    def send_to(self, client: int, topic: str, value: Any) -> None:
        """Send a value to one client, unless it has disconnected."""
        messages = self._clients.get(client)
        if messages is not None:
            messages.send(topic, value)

    async def connect(self, client: viser.ClientHandle) -> None:
        """Confirm to a client that its messages arrive from now on; viser drops earlier messages."""
        # a coroutine without await runs before the next message of the client is read; a thread may run later
        messages = self._clients[client.client_id] = Messages(client.gui)
        messages.send("welcome", True)

    async def disconnect(self, client: viser.ClientHandle) -> None:
        """Remove a client that has disconnected."""
        self._clients.pop(client.client_id, None)

    def _receive(self, text: Any, client: int | None) -> None:
        """Pass a message to the serving thread, and ignore invalid messages."""
        if client is None or not isinstance(text, str) or len(text) > LONGEST:
            return
        try:
            message = json.loads(text)
            topic, value = message["topic"], message["value"]
            handler = self._handlers[topic]
            json.dumps(value, ensure_ascii=False, allow_nan=False).encode()  # an incomplete surrogate pair is invalid
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        self._later(lambda: handler(value, client))

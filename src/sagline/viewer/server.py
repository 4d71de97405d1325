"""The web server: viser's, on the loopback address unless told otherwise, quiet, and never shared to the outside."""

from __future__ import annotations

import errno
import logging
import socket
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from io import StringIO

import viser

from sagline.core.errors import InvalidValueError
from sagline.viewer import page

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
        with page.served(title if title == NAME else f"{title} – {NAME}"):
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

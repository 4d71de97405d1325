"""The server of `sagline view`."""

from __future__ import annotations

import os
import signal
import sys
import webbrowser
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from importlib.util import find_spec
from socket import gethostname
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from sagline.cli.terminal import show_note, show_text
from sagline.core.errors import FileError
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.page import Page

LATER = "trimesh"  # a package that the viewer imports only when it is needed


class ServerAddress(NamedTuple):
    """Address and port of the page (0: any free port); `browser`: open a browser here; `access`: see `start_server`."""

    host: str
    port: int
    browser: bool
    access: Mapping[str, Any] = MappingProxyType({})


def check_viewer() -> None:
    """Raise FileError if a package that the viewer needs is not installed."""
    try:
        import sagline.viewer.features  # noqa: F401
    except ModuleNotFoundError as error:
        raise FileError.not_installed(error.name, "The viewer needs it", "viewer") from None
    if find_spec(LATER) is None:
        raise FileError.not_installed(LATER, "The viewer needs it", "viewer")


def serve(
    robot: Robot,
    address: ServerAddress,
    *,
    meanwhile: Callable[[Page], AbstractContextManager[None]] = lambda _: nullcontext(),
    **page: Any,
) -> int:
    """Serve a page until Ctrl-C, inside the context `meanwhile`; returns the exit code. `page`: arguments of `Page`."""
    from sagline.viewer import server as web
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page

    server = web.start_server(address.host, address.port, robot.name, **address.access)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # Ctrl-C is the normal end of the command from here
    try:
        show_text(f"{robot.name} is at {server.url}   (Ctrl-C stops it)", whole=True)
        if not server.access.local:
            who = "who has this address" if server.access.path else "who can reach this machine"
            place = server.url_at(server.access.path, gethostname())
            text = f"on other machines it is {place}. Everyone {who} can see the page and drag the platform."
            show_note("Note: ", text, style="bold")
        viewer = Page(server, FEATURES, robot, **page)
        if address.browser and _has_display():
            webbrowser.open(server.url_at(server.access.path_once()))
        with meanwhile(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        show_note("", "Stopped.")
    finally:
        web.stop_server(server)
    return 0


def _has_display() -> bool:
    """True if a browser can open a window. Over SSH, the browser would open in the terminal."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))

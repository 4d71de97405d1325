"""The server of `sagline view`."""

from __future__ import annotations

import os
import signal
import sys
import webbrowser
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

from sagline.cli.terminal import show_note, show_text
from sagline.core.errors import FileError
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.page import Page

LATER = "trimesh"  # a package that the viewer loads on demand


class ServerAddress(NamedTuple):
    """Address and port (0: any free port) of the page, and True to open a browser on this computer."""

    host: str
    port: int
    browser: bool


def check_viewer() -> None:
    """Raise FileError if a package of the viewer is not installed."""
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
    """Serve a page until Ctrl-C inside the context `meanwhile`; `page`: arguments of `Page`. Returns the exit code."""
    from sagline.viewer import server as web
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page

    server = web.start_server(address.host, address.port, robot.name)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # from now on Ctrl-C is the normal end
    try:
        url = web.url(server, address.host)
        show_text(f"{robot.name} is at {url}   (Ctrl-C stops it)", whole=True)
        if address.host not in ("127.0.0.1", "::1", "localhost"):
            show_note(
                "Note: ", "everyone who can reach this machine can see the page and drag the platform.", style="bold"
            )
        viewer = Page(server, FEATURES, robot, **page)
        if address.browser and _has_display():
            webbrowser.open(url)
        with meanwhile(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        show_note("", "Stopped.")
    finally:
        web.stop_server(server)
    return 0


def _has_display() -> bool:
    """True if there is a display for a browser; over SSH, the browser would open in the terminal."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))

"""A robot on a page of its own until Ctrl-C."""

from __future__ import annotations

import os
import signal
import sys
import webbrowser
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple

from sagline.cli.terminal import note, show, working
from sagline.core.arrays import Array
from sagline.core.errors import FileError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.calibration.result import Calibration
    from sagline.viewer.player import Beside, Played
    from sagline.viewer.state_code import Source
    from sagline.viewer.viewer import Viewer

LATER = "trimesh"  # what the viewer loads when somebody asks for it


class Start(NamedTuple):
    """How a robot is shown at first.

    Attributes:
        pose: Where its platform is; None for its home.
        mode: Name of the mode that moves, "" for none.
        wrench: On the platform, shape (6,); None for none.
    """

    pose: Pose | None = None
    mode: str = ""
    wrench: Array | None = None


def check_viewer() -> None:
    """Find out that the packages of the viewer are there.

    Raises:
        FileError: If one is not.
    """
    try:
        import sagline.viewer.viewer  # noqa: F401
    except ModuleNotFoundError as error:
        raise FileError.not_installed(error.name, "The viewer needs it", "viewer") from None
    if find_spec(LATER) is None:
        raise FileError.not_installed(LATER, "The viewer needs it", "viewer")


def hosted(
    machine: Robot,
    course: Played | None,
    host: str,
    port: int,
    *,
    browser: bool,
    start: Start | None = None,
    found: Calibration | None = None,
    source: Source | None = None,
    other: Beside | None = None,
    beside: Callable[[Viewer], AbstractContextManager[None]] = lambda _: nullcontext(),
) -> int:
    """Serve a robot until Ctrl-C; returns the exit code.

    Args:
        machine: The robot.
        course: What is played; None for the robot alone.
        host: Address to listen on.
        port: Port; 0 for any that is free.
        browser: Whether to open one here.
        start: How the robot is shown at first; None for its home.
        found: A calibration to show with it; None for none.
        source: Where all this came from; None if nobody knows.
        other: What is played with the same clock; None for nothing.
        beside: What goes on beside the viewer, as long as it serves.
    """
    from sagline.cli.readings import Readings
    from sagline.viewer import server as web
    from sagline.viewer.viewer import Viewer

    start = start or Start()
    server = web.started(host, port, machine.name)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # from here on Ctrl-C is how one ends, and no failure
    try:
        address = web.url(server, host)
        show(f"{machine.name} is at {address}   (Ctrl-C stops it)", whole=True)
        if host not in ("127.0.0.1", "::1", "localhost"):
            note("Note: ", "everyone who can reach this machine can look at it and drag it.", style="bold")
        readings = Readings()
        viewer = Viewer(
            server, machine, course, readings.ready, start.wrench, start.pose, start.mode, found, source, other
        )
        if browser and has_display():
            webbrowser.open(address)
        with working("") if readings.cold else nullcontext(), readings.compiled_beside(viewer), beside(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        note("", "Stopped.")
    finally:
        web.stop(server)
    return 0


def has_display() -> bool:
    """Whether a browser could open: over SSH it would open in the terminal, in the way."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))

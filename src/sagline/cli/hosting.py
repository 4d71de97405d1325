"""The server of `sagline view`, and the first run of the viewer.

Cables can be dragged as soon as they are compiled; further readings are compiled by another process meanwhile.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

from sagline.cli.compilation import (
    CompilerProcess,
    Stage,
    available_cores,
    compilation_events,
    first_run_text,
    not_compiled,
)
from sagline.cli.entries import (
    ANSWERS,
    ENTRIES,
    FORWARD,
    MARGINS,
    MODES,
    POLYGON,
    SHARING,
    SIGNED_MARGINS,
    SIMULATION,
    VERDICTS,
    VIBRATION,
)
from sagline.cli.terminal import note, show, working
from sagline.core.errors import FileError
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.feature import Reading
    from sagline.viewer.page import Page

LATER = "trimesh"  # what the viewer loads when somebody asks for it
ENTRY_OF = {  # by the names of the viewer's readings
    "MARGIN": MARGINS,
    "POLYGON": POLYGON,
    "SHARING": SHARING,
    "FREQUENCIES": VIBRATION,
    "REST": FORWARD,
    "MODES": ANSWERS,  # the modes, and the response
    "SIMULATION": SIMULATION,
    "WORKSPACE": SIGNED_MARGINS,
    "VERDICTS": VERDICTS,
}
ORDER = (
    SIGNED_MARGINS,  # where the platform may go is there with its cables
    MARGINS,
    POLYGON,
    SHARING,
    VIBRATION,
    VERDICTS,
    MODES,
    ANSWERS,
    FORWARD,
    SIMULATION,
)  # as they are looked at
PATIENCE = 5.0  # s: how long the end may wait for a compilation


class Address(NamedTuple):
    """Address of the page.

    Attributes:
        host: Address to listen on.
        port: Port; 0 for any that is free.
        browser: Whether to open one here.
    """

    host: str
    port: int
    browser: bool


def check_viewer() -> None:
    """Check that the packages of the viewer are installed.

    Raises:
        FileError: If one is not.
    """
    try:
        import sagline.viewer.features  # noqa: F401
    except ModuleNotFoundError as error:
        raise FileError.not_installed(error.name, "The viewer needs it", "viewer") from None
    if find_spec(LATER) is None:
        raise FileError.not_installed(LATER, "The viewer needs it", "viewer")


def serve(
    robot: Robot,
    address: Address,
    *,
    meanwhile: Callable[[Page], AbstractContextManager[None]] = lambda _: nullcontext(),
    **page: Any,
) -> int:
    """Serve a page until Ctrl-C; returns the exit code.

    Args:
        robot: The robot.
        address: Where to listen.
        meanwhile: What goes on beside the viewer, as long as it serves.
        page: What is on the page, as `Page` takes it: played, wrench, pose, mode, found, source, beside.
    """
    from sagline.viewer import server as web
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page

    server = web.start_server(address.host, address.port, robot.name)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # from here on Ctrl-C is how one ends, and no failure
    try:
        url = web.url(server, address.host)
        show(f"{robot.name} is at {url}   (Ctrl-C stops it)", whole=True)
        if address.host not in ("127.0.0.1", "::1", "localhost"):
            note("Note: ", "everyone who can reach this machine can look at it and drag it.", style="bold")
        readings = Readings()
        viewer = Page(server, FEATURES, robot, ready=readings.ready, **page)
        if address.browser and has_display():
            webbrowser.open(url)
        with working("") if readings.missing else nullcontext(), readings.compiled_for(viewer), meanwhile(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        note("", "Stopped.")
    finally:
        web.stop_server(server)
    return 0


def has_display() -> bool:
    """True if there is a display for a browser; over SSH it would open in the terminal."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


class Readings:
    """The readings of the viewer that need no compilation any more.

    Attributes:
        missing: Words of the entries that are still to be compiled.
    """

    def __init__(self) -> None:
        """Find the entries that are not compiled."""
        self.missing = not_compiled(ORDER)  # replaced as a whole, by the thread that compiles

    def ready(self, reading: Reading) -> bool:
        """True if a reading needs no compilation."""
        return ENTRY_OF[reading.name] not in self.missing

    @contextmanager
    def compiled_for(self, viewer: Page) -> Iterator[None]:
        """Compile what is missing in another process while inside, and refresh the viewer after each entry.

        The page shows only what the calling thread, which serves it, has to wait for.
        """
        serving = threading.get_ident()

        def tell(stage: Stage) -> None:
            if threading.get_ident() == serving:  # what is compiled beside makes nobody wait
                viewer.wait(first_run_text([stage]))

        ended = threading.Event()
        thread = threading.Thread(target=self._compile, args=(viewer, ended), daemon=True)
        thread.start()
        try:
            with compilation_events(tell):
                yield
        finally:
            ended.set()
            thread.join(PATIENCE)

    def _compile(self, viewer: Page, ended: threading.Event) -> None:
        if available_cores() < 2:
            while not (viewer.shown.wait(0.1) or ended.is_set()):
                pass
        if ended.is_set() or not self.missing:
            return
        with suppress(OSError), CompilerProcess(self.missing) as side:

            def end() -> None:
                ended.wait()
                side.kill()

            threading.Thread(target=end, daemon=True).start()
            for stage in side.stages():
                if stage.finished and not ended.is_set():
                    side.move_kernels()
                    self._arrived(stage.words, viewer)
        for name in self.missing:  # the other process failed: dragging is slow until it is made up for
            if not ended.is_set():
                ENTRIES[name].compile()
                self._arrived(name, viewer)

    def _arrived(self, name: str, viewer: Page) -> None:
        self.missing = [each for each in self.missing if each != name]
        viewer.refresh()

"""The server of `sagline view`; kernels of further displayed values are compiled in another process meanwhile."""

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
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.errors import FileError
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.feature import Computation
    from sagline.viewer.page import Page

LATER = "trimesh"  # a package that the viewer loads when it is needed
ENTRY_OF = {  # entry by the name of the viewer's computation, in the order of compilation
    "WORKSPACE": SIGNED_MARGINS,
    "MARGIN": MARGINS,
    "POLYGON": POLYGON,
    "SHARING": SHARING,
    "FREQUENCIES": VIBRATION,
    "VERDICTS": VERDICTS,
    "MODES": ANSWERS,  # the modes, and the response
    "REST": FORWARD,
    "SIMULATION": SIMULATION,
}
ORDER = tuple(each for entry in ENTRY_OF.values() for each in ((MODES, entry) if entry == ANSWERS else (entry,)))
PATIENCE = 5.0  # s: longest wait for a compilation at the end


class ServerAddress(NamedTuple):
    """Address and port (0: any free port) of the page, and true to open a browser on this computer."""

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
        readings = CompiledReadings()
        viewer = Page(server, FEATURES, robot, ready=readings.ready, **page)
        if address.browser and _has_display():
            webbrowser.open(url)
        with working("") if readings.missing else nullcontext(), readings.compiled_for(viewer), meanwhile(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        show_note("", "Stopped.")
    finally:
        web.stop_server(server)
    return 0


def _has_display() -> bool:
    """True if there is a display for a browser; over SSH it would open in the terminal."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


class CompiledReadings:
    """State of compilation of the viewer's computations; `missing` has the words of the entries not yet compiled."""

    def __init__(self) -> None:
        """Find the entries that are not compiled."""
        self.missing = not_compiled(ORDER)  # the compiling thread replaces the whole list

    def ready(self, reading: Computation) -> bool:
        """True if a computation needs no compilation."""
        return ENTRY_OF[reading.name] not in self.missing

    @contextmanager
    def compiled_for(self, viewer: Page) -> Iterator[None]:
        """Compile the missing entries in another process while inside; the viewer is refreshed after each of them."""
        serving = threading.get_ident()

        def tell(stage: Stage) -> None:
            if threading.get_ident() == serving:  # the page shows only compilations that its own thread waits for
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
        for name in self.missing:  # the other process failed: dragging is slow until this is done
            if not ended.is_set():
                ENTRIES[name].compile()
                self._arrived(name, viewer)

    def _arrived(self, name: str, viewer: Page) -> None:
        self.missing = [each for each in self.missing if each != name]
        viewer.refresh()

"""The first run of the viewer: cables can be dragged as soon as they stand, further readings are compiled beside."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from sagline.cli.cold_start import Side, cold, cores
from sagline.cli.compiling import Stage, first_run_text, heard
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
from sagline.viewer.feature import Reading
from sagline.viewer.viewer import Viewer

ENTRY_OF = {
    Reading.MARGIN: MARGINS,
    Reading.POLYGON: POLYGON,
    Reading.SHARING: SHARING,
    Reading.FREQUENCIES: VIBRATION,
    Reading.REST: FORWARD,
    Reading.MODES: ANSWERS,  # the modes, and the response
    Reading.SIMULATION: SIMULATION,
    Reading.WORKSPACE: SIGNED_MARGINS,
    Reading.VERDICTS: VERDICTS,
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


class Readings:
    """Which readings a viewer can have without waiting."""

    def __init__(self) -> None:
        """Look at what is compiled."""
        self._waiting = cold(ORDER)  # replaced as a whole, by the thread that compiles

    @property
    def cold(self) -> bool:
        """Whether something is missing."""
        return bool(self._waiting)

    def ready(self, reading: Reading) -> bool:
        """Whether a reading can be had without waiting."""
        return ENTRY_OF[reading] not in self._waiting

    @contextmanager
    def compiled_beside(self, viewer: Viewer) -> Iterator[None]:
        """While inside, what is missing is compiled by another process, and the viewer told what is there.

        The page tells what the calling thread, which serves it, has to wait for.
        """
        serving = threading.get_ident()

        def tell(stage: Stage) -> None:
            if threading.get_ident() == serving:  # what is compiled beside makes nobody wait
                viewer.wait(first_run_text([stage]))

        ended = threading.Event()
        thread = threading.Thread(target=self._compile, args=(viewer, ended), daemon=True)
        thread.start()
        try:
            with heard(tell):
                yield
        finally:
            ended.set()
            thread.join(PATIENCE)

    def _compile(self, viewer: Viewer, ended: threading.Event) -> None:
        if cores() < 2:
            while not (viewer.shown.wait(0.1) or ended.is_set()):
                pass
        if ended.is_set() or not self._waiting:
            return
        with suppress(OSError), Side(self._waiting) as side:

            def end() -> None:
                ended.wait()
                side.kill()

            threading.Thread(target=end, daemon=True).start()
            for stage in side.stages():
                if stage.finished and not ended.is_set():
                    side.take_over()
                    self._arrived(stage.words, viewer)
        for name in self._waiting:  # the other process failed: dragging is slow until it is made up for
            if not ended.is_set():
                ENTRIES[name].compile()
                self._arrived(name, viewer)

    def _arrived(self, name: str, viewer: Viewer) -> None:
        self._waiting = [each for each in self._waiting if each != name]
        viewer.refresh()

"""Ctrl-C: heard at once, and once more at the end where Python has lost it."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType
from typing import Any


class Interrupts:
    """Listens to Ctrl-C in the main thread, unless whoever started the process told it not to."""

    def __init__(self) -> None:
        """Begin to listen."""
        self.heard = False
        main = threading.current_thread() is threading.main_thread()
        self._before: Any = signal.getsignal(signal.SIGINT) if main else None
        self._listens = main and self._before is signal.default_int_handler
        self._hook = sys.unraisablehook
        if self._listens:
            signal.signal(signal.SIGINT, self._hear)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self.heard = True
        sys.unraisablehook = lambda _: None  # what half-made objects say when they are thrown away helps nobody
        signal.default_int_handler(number, frame)

    def deafen(self) -> None:
        """From here on Ctrl-C does nothing: all is done, or being told."""
        if self._listens:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    def restore(self) -> None:
        """Leave everything as it was before."""
        sys.unraisablehook = self._hook
        if self._listens:
            signal.signal(signal.SIGINT, self._before)

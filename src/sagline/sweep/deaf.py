"""Loaded by each worker process as it starts: Ctrl-C in the terminal is for the process that has the workers."""

from __future__ import annotations

import signal
import threading
from contextlib import suppress


def dask_setup(worker: object) -> None:
    """Hear no Ctrl-C: the task that runs is finished.

    Args:
        worker: Of Dask, which asks for this function by its name.
    """
    if threading.current_thread() is threading.main_thread():
        with suppress(ValueError, OSError):
            signal.signal(signal.SIGINT, signal.SIG_IGN)

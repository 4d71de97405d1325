"""What may not disturb a motion: the garbage collector, and Ctrl-C, which stops it first."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


class Garbage:
    """Whether garbage is collected: not while something moves, as that takes longer than a cycle."""

    def __init__(self) -> None:
        """Leave it as it is."""
        self._stopped = False

    def stop(self) -> None:
        """Collect none from here on; what there is now is not looked at any more."""
        if not self._stopped and gc.isenabled():
            self._stopped = True
            gc.disable()
            gc.freeze()

    def go_on(self) -> None:
        """Collect again, if it was so before."""
        if self._stopped:
            self._stopped = False
            gc.unfreeze()
            gc.enable()


@contextmanager
def interrupt_calls(stop: Callable[[], object]) -> Iterator[None]:
    """Within, Ctrl-C calls a function and does nothing else, a second one nothing; at the end it interrupts.

    It does so in the main thread alone, and not where Ctrl-C is ignored.

    Args:
        stop: Called between two instructions of Python, wherever they are.

    Raises:
        KeyboardInterrupt: At the end, if Ctrl-C was pressed.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    pressed = False

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        if not pressed:
            pressed = True
            stop()

    signal.signal(signal.SIGINT, hear)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt

"""Real time: ticks, planning in the background, garbage collection and Ctrl-C."""

from __future__ import annotations

import gc
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from math import inf
from types import FrameType
from typing import Final, TypeVar

import numpy as np

from sagline.control.link import PERIOD
from sagline.core.arrays import Indices, locked, number
from sagline.core.errors import InvalidValueError

BIN: Final = 1e-4  # s
BINS: Final = 1000  # and one for all that is longer


class Histogram:
    """How often which duration occurred, in bins of 0.1 ms up to 100 ms."""

    def __init__(self) -> None:
        """Begin with none."""
        self._counts = [0] * (BINS + 1)  # a list counts quicker than an array
        self.longest = 0.0

    def add(self, duration: float) -> None:
        """Count one.

        Args:
            duration: [s], >= 0.
        """
        self._counts[min(int(duration / BIN), BINS)] += 1
        self.longest = max(self.longest, duration)

    @property
    def counts(self) -> Indices:
        """How many durations are in each bin, shape (1001,); the last has all from 100 ms on."""
        return locked(np.array(self._counts))

    def quantile(self, share: float) -> float:
        """The duration that so many do not exceed, rounded up to the end of its bin [s]; 0 where there are none.

        Args:
            share: Of all, 0 to 1.

        Raises:
            InvalidValueError: If it is no such number.
        """
        if not number(share, "share", "", low=0.0) <= 1.0:
            raise InvalidValueError("share", f"{share:g}", "0 to 1", "Give 0.999 for what 999 of 1000 do not exceed.")
        counts = np.cumsum(self._counts)
        if not counts[-1]:
            return 0.0
        k = int(np.searchsorted(counts, share * counts[-1]))
        return min((k + 1) * BIN if k < BINS else inf, self.longest)


class Pace:
    """Waits for the next tick of a clock that does not drift: ticks are a period apart, whatever a cycle takes.

    It sleeps and does not spin: threads of the link need the time. Where a cycle is late by more than a period, the
    ticks begin anew there: set points that were missed are not sent in a burst.
    """

    def __init__(self, period: float = PERIOD) -> None:
        """Begin at the first wait.

        Args:
            period: Between two ticks [s], > 0.

        Raises:
            InvalidValueError: If it is no such number.
        """
        self.period = number(period, "period", "s", above=0.0)
        self.lateness = Histogram()
        self.periods = Histogram()  # from the beginning of a cycle to that of the next
        self._next: float | None = None
        self._began = 0.0

    def wait(self) -> float:
        """Wait for the next tick.

        Returns:
            By how much the cycle begins too late [s], >= 0.
        """
        now = time.perf_counter()
        if self._next is None:
            self._next = self._began = now
        if self._next > now:
            time.sleep(self._next - now)
            now = time.perf_counter()
        late = max(now - self._next, 0.0)
        self.lateness.add(late)
        self.periods.add(now - self._began)
        self._began = now
        self._next = (now if late > self.period else self._next) + self.period
        return late


T = TypeVar("T")


def aside(work: Callable[[], T], threaded: bool) -> Future[T]:
    """Begin it in a thread of its own; on a lockstep clock, where nobody waits, do it at once.

    Args:
        work: Reads nothing that cycles change.
        threaded: Whether time goes on beside it.

    Returns:
        What becomes of it; done already without a thread.
    """
    if threaded:
        pool = ThreadPoolExecutor(1, "sagline planning")
        begun = pool.submit(work)
        pool.shutdown(wait=False)
        return begun
    done: Future[T] = Future()
    try:
        done.set_result(work())
    except Exception as error:
        done.set_exception(error)
    return done


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

"""Real time: when the next cycle begins, and how late it was."""

from __future__ import annotations

import time
from math import inf
from typing import Final

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

"""Limits of time that a slow or a busy machine keeps too; what takes seconds too much keeps them nowhere.

A limit is one of an ordinary machine. Only what exceeds it is done again, and then judged by how long a fixed piece of
work takes here and now.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np

ORDINARY = 0.1  # s, that the piece of work takes where the limits were set
AGAIN = 3


def piece(clock: Callable[[], float] = time.thread_time) -> float:
    """How long a fixed piece of work takes [s], half of it of Python and half of numpy."""
    numbers, found, start = np.linspace(0.0, 1.0, 4000), 0.0, clock()
    for k in range(600):
        found += sum(j * k % 7 for j in range(500)) + np.sort(np.sin(k * numbers))[0]
    return clock() - start


def slowness() -> float:
    """How many times as long as on an ordinary machine work takes the processor now; at least 1."""
    return max(1.0, piece() / ORDINARY)


def slowness_of_waiting() -> float:
    """As `slowness`, by the clock on the wall: of another process, which no thread of this one holds up."""
    done = subprocess.run([sys.executable, "-P", __file__], stdout=subprocess.PIPE, text=True, check=True)
    return max(1.0, float(done.stdout) / ORDINARY)


def least_seconds(work: Callable[[], object], limit: float, seen: float | None = None) -> float:
    """Processor time that work takes [s of an ordinary machine]; how it ends does not matter.

    Args:
        work: Does it; more than once, if it takes longer than the limit.
        limit: What it may take [s].
        seen: What it took already [s].
    """
    least = _seconds(work) if seen is None else seen
    for _ in range(AGAIN):
        if least <= limit:
            break
        before = slowness()
        took = _seconds(work)
        least = min(least, took / max(before, slowness()))
    return least


def _seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    with suppress(Exception):
        work()
    return time.process_time() - start


def best_rate(measure: Callable[[], float], wanted: float) -> float:
    """The highest of some measurements of a rate [1/s of an ordinary machine]; one, if that is as wanted."""
    best = measure()
    for _ in range(AGAIN):
        if best >= wanted:
            break
        best = max(best, measure() * slowness_of_waiting())
    return best


if __name__ == "__main__":
    print(piece(time.perf_counter))

"""Time limits that also hold on slow or busy machines.

A limit applies to an ordinary machine. Only work that exceeds its limit is repeated. The limit is then scaled by the
time of a fixed piece of work on the present machine.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np

ORDINARY = 0.1  # s, duration of the fixed piece of work on the machine of the limits
AGAIN = 3


def duration_of_fixed_work(clock: Callable[[], float] = time.thread_time) -> float:
    """Duration of a fixed piece of work [s], half of it Python and half numpy."""
    numbers, found, start = np.linspace(0.0, 1.0, 4000), 0.0, clock()
    for k in range(600):
        found += sum(j * k % 7 for j in range(500)) + np.sort(np.sin(k * numbers))[0]
    return clock() - start


def slowness() -> float:
    """Ratio of the present processor time of the fixed piece to its time on an ordinary machine, at least 1."""
    return max(1.0, duration_of_fixed_work() / ORDINARY)


def slowness_of_waiting() -> float:
    """As `slowness`, with wall time in another process, which the threads of this process do not delay."""
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
    """Highest measurement of a rate [1/s of an ordinary machine]; measurements end at the wanted rate."""
    best = measure()
    for _ in range(AGAIN):
        if best >= wanted:
            break
        best = max(best, measure() * slowness_of_waiting())
    return best


if __name__ == "__main__":
    print(duration_of_fixed_work(time.perf_counter))

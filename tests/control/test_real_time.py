"""Ticks without drift, and their delays, on a simulated clock."""

import os
import time

import pytest

from sagline.control.real_time import Histogram, Pace, set_priority
from sagline.core.errors import InvalidValueError


class Clock:
    """A clock set by the test; sleeping advances it by slightly too much."""

    def __init__(self, over: float) -> None:
        self.now, self._over = 100.0, over

    def sleep(self, seconds: float) -> None:
        self.now += seconds + self._over


def turned(monkeypatch: pytest.MonkeyPatch, over: float = 0.0) -> Clock:
    clock = Clock(over)
    monkeypatch.setattr(time, "perf_counter", lambda: clock.now)
    monkeypatch.setattr(time, "sleep", clock.sleep)
    return clock


def test_ticks_do_not_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = turned(monkeypatch, over=2e-4)
    pace = Pace(0.01)
    begins = []
    for k in range(200):
        late = pace.wait()
        begins.append(clock.now)
        assert late == pytest.approx(0.0 if k == 0 else 2e-4, abs=1e-9)
        clock.now += (0.001, 0.004, 0.009)[k % 3]
    assert begins[-1] == pytest.approx(100.0 + 199 * 0.01 + 2e-4, abs=1e-9)
    assert pace.periods.quantile(0.999) == pytest.approx(0.0102, abs=2e-4)


def test_a_long_cycle_is_reported_and_missed_ticks_are_skipped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = turned(monkeypatch)
    pace = Pace(0.01)
    pace.wait()
    clock.now += 0.013
    assert pace.wait() == pytest.approx(0.003, abs=1e-9)  # less than a period: the ticks are unchanged
    assert pace.wait() == 0.0
    assert clock.now == pytest.approx(100.02, abs=1e-9)
    clock.now += 0.05
    assert pace.wait() == pytest.approx(0.04, abs=1e-9)
    before = clock.now
    assert pace.wait() == 0.0
    assert clock.now - before == pytest.approx(0.01, abs=1e-9)
    assert pace.lateness.longest == pytest.approx(0.04, abs=1e-9)


def test_the_priority_is_set_and_a_missing_permission_names_the_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[int, int, int]] = []

    def schedule(process: int, policy: int, given: os.sched_param) -> None:
        asked.append((process, policy, given.sched_priority))
        if given.sched_priority > 50:
            raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", schedule)
    set_priority(50)
    assert asked == [(0, os.SCHED_FIFO, 50)]
    with pytest.raises(InvalidValueError, match="--rtprio=51"):
        set_priority(51)
    for wrong in (0, 100, True):
        with pytest.raises(InvalidValueError, match="1 to 99"):
            set_priority(wrong)
    monkeypatch.delattr(os, "sched_setscheduler")
    with pytest.raises(InvalidValueError, match="Linux"):
        set_priority(50)


def test_quantiles_are_upper_ends_of_bins() -> None:
    histogram = Histogram()
    assert histogram.quantile(0.5) == 0.0
    for duration in [0.00005] * 90 + [0.00125] * 9 + [0.5]:
        histogram.add(duration)
    assert histogram.quantile(0.5) == pytest.approx(1e-4)
    assert histogram.quantile(0.95) == pytest.approx(1.3e-3)
    assert histogram.quantile(1.0) == histogram.longest == 0.5
    assert histogram.counts.sum() == 100
    assert histogram.counts[-1] == 1

"""Time limits: excessive time is found on every machine, and the delay of a slow machine is not reported."""

import time
from itertools import count

import pytest

from tests import effort
from tests.tiers import extended


def busy(seconds: float) -> None:
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


@extended
def test_slow_work_is_found_and_disturbed_work_is_not() -> None:
    assert effort.least_seconds(lambda: busy(0.8), 0.05) > 0.05
    assert effort.least_seconds(lambda: None, 0.05, seen=9.0) < 0.05  # another process, once


def test_fast_work_is_not_repeated() -> None:
    done = count()
    assert effort.least_seconds(done.__next__, 9.0) < 9.0
    assert effort.least_seconds(done.__next__, 9.0, seen=1.0) == 1.0
    assert next(done) == 1


def test_a_machine_with_half_the_speed_has_twice_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effort, "duration_of_fixed_work", lambda: 2.0 * effort.ORDINARY)
    assert effort.least_seconds(lambda: busy(0.15), 0.1) == pytest.approx(0.075, rel=0.2)
    monkeypatch.setattr(effort, "slowness_of_waiting", lambda: 2.0)
    assert effort.best_rate(lambda: 20.0, 30.0) == 40.0


def test_the_limit_of_a_fast_machine_is_not_shorter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effort, "duration_of_fixed_work", lambda: 0.1 * effort.ORDINARY)
    assert effort.slowness() == 1.0


def test_a_slow_rate_on_an_ordinary_machine_is_not_scaled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effort, "slowness_of_waiting", lambda: 1.0)
    assert effort.best_rate(lambda: 20.0, 30.0) == 20.0
    assert effort.slowness() >= 1.0


def test_another_process_measures_the_slowness() -> None:
    assert 1.0 <= effort.slowness_of_waiting() < 1e3

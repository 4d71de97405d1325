"""Limits of time: what is too much is found on every machine, and what only a slow machine makes long is not."""

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
def test_work_that_takes_too_long_is_found_and_what_was_disturbed_is_not() -> None:
    assert effort.least_seconds(lambda: busy(0.8), 0.05) > 0.05
    assert effort.least_seconds(lambda: None, 0.05, seen=9.0) < 0.05  # it was something else, once


def test_what_is_quick_enough_is_not_done_again() -> None:
    done = count()
    assert effort.least_seconds(done.__next__, 9.0) < 9.0
    assert effort.least_seconds(done.__next__, 9.0, seen=1.0) == 1.0
    assert next(done) == 1


def test_a_machine_of_half_the_speed_has_twice_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effort, "piece", lambda: 2.0 * effort.ORDINARY)
    assert effort.least_seconds(lambda: busy(0.15), 0.1) == pytest.approx(0.075, rel=0.2)
    monkeypatch.setattr(effort, "slowness_of_waiting", lambda: 2.0)
    assert effort.best_rate(lambda: 20.0, 30.0) == 40.0


def test_a_fast_machine_has_no_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effort, "piece", lambda: 0.1 * effort.ORDINARY)
    assert effort.slowness() == 1.0


def test_a_rate_that_nothing_excuses_is_told_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effort, "slowness_of_waiting", lambda: 1.0)
    assert effort.best_rate(lambda: 20.0, 30.0) == 20.0
    assert effort.slowness() >= 1.0


def test_another_process_tells_how_slow_the_machine_is() -> None:
    assert 1.0 <= effort.slowness_of_waiting() < 1e3

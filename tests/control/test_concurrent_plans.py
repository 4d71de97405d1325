"""Plans beside the cycles of a controller in real time: cycles continue, errors are delivered, Ctrl-C does not wait."""

from __future__ import annotations

import signal
import threading
import time
from functools import partial

import numpy as np
import pytest

import sagline as sl
from sagline.control.checks import plan_motion
from sagline.control.real_time import Pace, result_in_thread
from sagline.control.states import RefusedError, State
from tests.control.rigs import HOME, Watcher, at, prototype, rig, state_of

PATIENCE = 60.0  # s


class Instant(Pace):
    """Real time that passes at once: plans are made in a thread, and cycles do not wait for ticks."""

    def wait(self) -> float:
        time.sleep(1e-4)
        return 0.0


def test_a_concurrent_plan_is_the_same_and_cycles_continue() -> None:
    watcher = Watcher()
    control, _ = rig(pace=Instant(), record=watcher)
    seen: list[int] = []
    watcher.cycle = lambda cycle: seen.append(threading.active_count())  # type: ignore[method-assign]
    path = sl.septic_path([HOME, at(0.1, 0.0, 1.5), HOME], speed=0.01)
    there = control.plan(path)
    here = plan_motion(prototype(), path, 0.01, sl.Catenary(), sl.Closest(), control._context.previous_plan)
    for name in ("length", "rate", "tension", "drum_tension", "wrench"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))
    assert len(seen) > 3
    with pytest.raises(RefusedError, match="9"):
        control.plan(sl.septic_path([HOME, at(9.0, 0.0, 1.5)], speed=0.1))


def test_ctrl_c_does_not_wait_for_a_plan() -> None:
    watcher = Watcher()
    control, _ = rig(pace=Instant(), record=watcher)
    begun = time.monotonic()
    watcher.cycle = lambda cycle: (  # type: ignore[method-assign]
        signal.raise_signal(signal.SIGINT) if time.monotonic() > begun + 0.2 and control.homed else None
    )
    before = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a shell can start this process with Ctrl-C ignored
    release = threading.Event()
    try:
        with pytest.raises(KeyboardInterrupt):
            control._result_of(partial(release.wait, 1e3))
    finally:
        signal.signal(signal.SIGINT, before)
        release.set()
    assert time.monotonic() - begun < PATIENCE
    assert state_of(control) is State.IDLE
    watcher.cycle = lambda cycle: None  # type: ignore[method-assign]
    assert len(control.plan(sl.septic_path([HOME, at(0.1, 0.0, 1.5)], speed=0.1))) > 100


@pytest.mark.parametrize("fails", [False, True])
def test_an_abandoned_result_is_discarded(fails: bool) -> None:
    release = threading.Event()

    def work() -> None:
        release.wait(PATIENCE)
        if fails:
            raise RefusedError("the path", "too late", "Wait.")

    result = result_in_thread(work)
    thread = next(thread for thread in threading.enumerate() if thread.name == "sagline planning")
    assert result.cancel()
    release.set()
    thread.join(PATIENCE)  # an exception in it would be a warning, which is an error
    assert result.cancelled()

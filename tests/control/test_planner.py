"""Planning in another process: results, errors, and what happens when it or its parent is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control.checks import plan_motion
from sagline.control.planner import Planner, planner_of
from sagline.control.real_time import Pace
from sagline.control.states import RefusedError, State
from tests.control.rigs import HOME, Watcher, at, prototype, rig, state_of
from tests.tiers import extended

PATIENCE = 60.0  # s: a new process on a busy machine
ROOT = Path(__file__).parents[2]


class Instant(Pace):
    """Real time that passes at once: plans are made in the other process, and a cycle does not wait for a tick."""

    def wait(self) -> float:
        time.sleep(1e-4)
        return 0.0


def answer(planner: Planner, work: Any) -> Any:
    return planner.submit(prototype(), work).result(PATIENCE)


def planner() -> Planner:
    """That of all controllers of this process."""
    return planner_of(os.getpid())


def process_of(planner: Planner) -> int:
    return int(answer(planner, os.getpid))


def planning(x: float) -> Any:
    path = sl.septic_path([HOME, at(x, 0.0, 1.5)], speed=0.1)
    return partial(plan_motion, prototype(), path, 0.01, sl.Catenary(), sl.Closest(), None)


def test_a_motion_is_the_same_to_the_last_bit_and_of_the_same_robot() -> None:
    there, here = answer(planner(), planning(0.1)), planning(0.1)()
    assert process_of(planner()) != os.getpid()
    assert there.robot is there.plan.state.one_robot is prototype()
    for name in ("length", "rate", "tension", "drum_tension", "wrench"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))
    for one, other in zip(there.gains.at(0.3), here.gains.at(0.3), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_refusal_is_that_of_the_check() -> None:
    with pytest.raises(RefusedError) as there:
        answer(planner(), planning(9.0))
    with pytest.raises(RefusedError) as here:
        planning(9.0)()
    assert str(there.value) == str(here.value)


def test_work_that_cannot_be_sent_is_an_error_and_the_next_request_is_answered() -> None:
    with pytest.raises((AttributeError, TypeError), match=r"lambda|pickle"):
        answer(planner(), lambda: 1)
    assert answer(planner(), partial(abs, -2)) == 2


def test_a_process_that_is_killed_at_work_is_a_refusal_and_the_next_request_starts_another() -> None:
    first = process_of(planner())
    begun = planner().submit(prototype(), partial(time.sleep, 1e3))
    time.sleep(0.1)
    os.kill(first, signal.SIGKILL)
    with pytest.raises(RefusedError, match=f"code -{int(signal.SIGKILL)}"):
        begun.result(PATIENCE)
    assert process_of(planner()) != first
    assert answer(planner(), planning(0.1)).robot is prototype()  # the robot was sent again


def test_a_machine_that_can_start_no_process_is_a_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(RefusedError, match="/nowhere/python"):
        answer(Planner(), partial(abs, -2))


def test_ctrl_c_does_not_wait_for_a_plan() -> None:
    watcher = Watcher()
    control, _ = rig(pace=Instant(), record=watcher)
    begun = time.monotonic()
    watcher.cycle = lambda cycle: (  # type: ignore[method-assign]
        signal.raise_signal(signal.SIGINT) if time.monotonic() > begun + 0.2 and control.homed else None
    )
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may start this with Ctrl-C ignored
    try:
        with pytest.raises(KeyboardInterrupt):
            control._result_of(partial(time.sleep, 1e3))
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begun < PATIENCE
    assert state_of(control) is State.IDLE
    watcher.cycle = lambda cycle: None  # type: ignore[method-assign]
    assert len(control.plan(sl.septic_path([HOME, at(0.1, 0.0, 1.5)], speed=0.1))) > 100


def test_a_stop_needs_no_planner(monkeypatch: pytest.MonkeyPatch) -> None:
    control, _ = rig(pace=Instant())
    control.start(control.path_to(at(0.1, 0.0, 1.5)))
    for _ in range(80):
        control.cycle()
    monkeypatch.setattr(Planner, "submit", None)
    control.stop()
    for _ in range(30):
        control.cycle()
    assert state_of(control) is State.IDLE


PARENT = """
import os, signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in its background
import sagline as sl
from functools import partial
from sagline.control.planner import Planner
planner, robot = Planner(), sl.load_robot("article-prototype")
print(planner.submit(robot, os.getpid).result(), flush=True)
planner.submit(robot, partial(time.sleep, 1e3))
time.sleep(1e3)
"""


def is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{process}/stat")
    return not status.exists() or status.read_text().rpartition(")")[2].split()[0] != "Z"


@extended
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_it_ends_with_its_parent_even_at_work(number: int) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PARENT], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as parent:
        assert parent.stdout is not None
        planner = int(parent.stdout.readline())
        parent.send_signal(number)
        end = time.monotonic() + PATIENCE
        while is_alive(planner):
            assert time.monotonic() < end
            time.sleep(0.02)


@extended
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_it_ignores_the_signals_that_stop_its_parent(number: int) -> None:
    begun = process_of(planner())
    os.kill(begun, number)
    assert process_of(planner()) == begun

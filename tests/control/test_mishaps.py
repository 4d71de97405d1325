"""Exceptions in a cycle, missing answers and a lost pose: the winches come to rest."""

from __future__ import annotations

import gc
from typing import Any

import pytest

from sagline import ForwardStatus
from sagline.control.execution import ExecutionStatus
from sagline.control.link import GroupStatus, Missing, Mode, Sample
from sagline.control.recording import EventKind
from sagline.control.states import State
from sagline.core.arrays import Array
from tests.control.rigs import Watcher, at, rig, spy_of, state_of
from tests.tiers import wide


class Bursting(Watcher):
    """An observer that raises an exception: in a given motion cycle, or when its state is requested."""

    def __init__(self, where: str) -> None:
        """Raise the exception in this method."""
        super().__init__(30, lambda: setattr(self, "_now", True))
        self._where, self._now = where, False

    def _burst(self, where: str) -> None:
        if self._now and where == self._where:
            raise OSError("disk\ngone")

    @property
    def stopped(self) -> str:  # type: ignore[override]
        self._burst("stopped")
        return ""

    def cycle(self, cycle: Any) -> None:
        super().cycle(cycle)
        self._burst("cycle")

    def ends(self, status: Any, reason: str) -> None:
        self._burst("ends")

    def event(self, event: Any) -> None:
        super().event(event)
        self._burst("event")


@pytest.mark.parametrize("where", wide(["cycle", "event", "stopped", "ends"], first=2))
def test_an_observer_that_raises_is_removed_and_the_motion_continues(where: str) -> None:
    control, _ = rig(record=Bursting(where))
    done = control.go_to(at(0.05, 0.0, 1.5))
    assert (done.status, control.state) == (ExecutionStatus.DONE, State.IDLE)
    told = [event for event in control.events if event.name == "recording stopped"]
    assert len(told) == 1
    assert "OSError: disk gone" in told[0].text
    assert gc.isenabled()
    assert control.go_to(at(0.0, 0.0, 1.5)).status is ExecutionStatus.DONE


def burst(*_: Any) -> Any:
    raise ArithmeticError("no")


def link_that_bursts(control: Any, once: bool) -> None:
    spy: Any = spy_of(control)
    good = spy.exchange

    def exchange(command: Any) -> Any:
        if once:
            spy.exchange = good
        raise ArithmeticError("no")

    spy.exchange = exchange


BURSTS: list[tuple[Any, bool]] = [
    (lambda control: setattr(control._context.estimator._solver, "step_into", burst), True),
    (lambda control: setattr(control._loop.active.source, "step", burst), True),
    (lambda control: setattr(control._context.faults[0], "look", burst), True),
    (lambda control: link_that_bursts(control, once=True), True),
    (lambda control: link_that_bursts(control, once=False), False),
]


@pytest.mark.parametrize(("break_it", "sends"), BURSTS)
def test_an_exception_in_a_cycle_holds_the_winches_and_is_raised_again(break_it: Any, sends: bool) -> None:
    """Formerly the state stayed MOVING with a set point in the command, and garbage was never collected again."""
    control, machine = rig()
    control.start(control.path_to(at(0.2, 0.0, 1.5)))
    for _ in range(50):
        control.cycle()
    break_it(control)
    with pytest.raises(ArithmeticError, match="no"):
        control.cycle()
    assert state_of(control) is State.FAULT
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0
    assert control._context.sender.command is not None
    assert control._context.sender.command.mode is Mode.HOLD
    fault = next(event for event in control.events if event.name == "cycle broken off")
    assert fault.kind is EventKind.FAULT
    assert "ArithmeticError: no" in fault.text
    assert control.execution is not None
    assert control.execution.status is ExecutionStatus.FAULT
    if sends:  # the PLCs already stop with a ramp, although no next cycle is called
        assert spy_of(control).commands[-1] is control._context.sender.command
        for _ in range(22):
            machine.advance()
        for group in range(4):
            report = machine.report(group)
            assert report is not None
            assert not report.status & (GroupStatus.FOLLOWING | GroupStatus.RAMPING)


def test_an_exception_during_connecting_releases_the_grants() -> None:
    control, _ = rig(home=False)
    control.claim()
    for _ in range(4):
        control.cycle()
    assert control.sample is not None
    assert set(control.sample.owner.tolist()) == {control.owner}
    link_that_bursts(control, once=True)
    with pytest.raises(ArithmeticError):
        control.cycle()
    assert state_of(control) is State.OFF
    for _ in range(3):
        control.cycle()
    assert set(control.sample.owner.tolist()) == {0}


def test_missing_answers_stop_the_machine() -> None:
    """Formerly a link that had lost its samples disabled all rules."""
    control, _ = rig()
    control.start(control.path_to(at(0.2, 0.0, 1.5)))
    for _ in range(50):
        control.cycle()
    spy: Any = spy_of(control)
    good = spy.exchange

    def exchange(command: Any) -> Missing:
        answer = good(command)
        return Missing(answer.time, (1,), ("gone",))

    spy.exchange = exchange
    for _ in range(12):
        control.cycle()
    assert state_of(control) is State.STOPPING
    assert any(event.name == "group silent" for event in control.events)
    assert isinstance(control.sample, Sample)
    assert control.sample.age.min() > 0.1


def test_a_lost_pose_stops_the_machine() -> None:
    control, _ = rig()
    control.start(control.path_to(at(0.2, 0.0, 1.5)))
    for _ in range(50):
        control.cycle()
    solver: Any = control._context.estimator._solver

    class Lost:
        def step_into(self, length: Array, place: Array, turn: Array, wrench: Array | None) -> ForwardStatus:
            solver.step_into(length, place, turn, wrench)
            return ForwardStatus.NOT_CONVERGED

    control._context.estimator._solver = Lost()  # type: ignore[assignment]
    control.cycle()
    assert state_of(control) is State.STOPPING
    done = control.wait()
    assert (done.status, state_of(control)) == (ExecutionStatus.FAULT, State.FAULT)
    assert done.reason == next(event.text for event in control.events if event.name == "estimate")

"""Lasting faults of a machine in one process: the resulting state, which acknowledging does not end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

import sagline as sl
from sagline.control.controller import Controller
from sagline.control.link import Command, Missing, Sample
from sagline.control.null_space import TensionSettings
from sagline.control.real_time import Pace
from sagline.control.states import RefusedError, State
from sagline.twin.machine import Machine
from tests.control.lockstep import one
from tests.control.rigs import HOME, Watcher, at, imperfect, prototype, state_of
from tests.tiers import extended, wide

Edit = Callable[[Sample], Sample]


class Edited:
    """A link that changes the samples of the machine from a given time on."""

    def __init__(self, link: Any) -> None:
        self._link, self.groups, self.period = link, link.groups, link.period
        self.edit: Edit | None = None

    def exchange(self, command: Command | None) -> Sample | Missing:
        answer: Sample | Missing = self._link.exchange(command)
        return self.edit(answer) if self.edit is not None and isinstance(answer, Sample) else answer

    def close(self) -> None:
        """Nothing to do."""


class Clock(Pace):
    """A clock without waiting, on which every cycle has a given delay."""

    late = 0.0

    def wait(self) -> float:
        return self.late


class Stage(NamedTuple):
    """Objects that a case may change."""

    control: Controller
    machine: Machine
    link: Edited
    clock: Clock
    watcher: Watcher


class Case(NamedTuple):
    """A lasting fault.

    Attributes:
        begin: Cause of the fault.
        name: The first reported fault.
        state: State that follows within 60 cycles and lasts.
    """

    begin: Callable[[Stage], None]
    name: str
    state: State


def edits(edit: Edit) -> Callable[[Stage], None]:
    return lambda stage: setattr(stage.link, "edit", edit)


def injects(what: str) -> Callable[[Stage], None]:
    return lambda stage: stage.machine.inject(f"{what} at {stage.machine.time:.3f} s")


def reads(cable: int, tension: float, torque: float) -> Callable[[Stage], None]:
    """A cable with a given tension in load cell and motor."""
    return edits(
        lambda sample: sample._replace(
            tension=one(sample.tension, cable, tension + 1e-3 * (sample.counter[0] % 7)),
            torque=one(sample.torque, cable, torque),
        )
    )


FAULT, EMERGENCY, MOVING = State.FAULT, State.EMERGENCY, State.MOVING
CORRECTION = "correction at its limit"
STOPPING = {
    "over-tension": Case(reads(3, 2100.0, -3.0), "over-tension", FAULT),
    "slack": Case(reads(4, 2.0, 0.0), "slack", FAULT),
    "cycles are lost": Case(lambda stage: setattr(stage.clock, "late", 0.15), "cycle lost", FAULT),
    "servo 3 is limited": Case(injects("servo 3 is limited to 60 N"), "following error", FAULT),
    "group 1 is silent": Case(injects("group 1 is silent"), "group stale", FAULT),
    "commands stop": Case(injects("commands stop"), "group acts by itself", FAULT),
    "servo 3 trips": Case(injects("servo 3 trips"), "group acts by itself", FAULT),
    "group 1 is taken": Case(injects("group 1 is taken"), "owner lost", FAULT),
}
GOES_ON = {
    "cycles are late": Case(lambda stage: setattr(stage.clock, "late", 0.03), "cycle late", MOVING),
    "recording stops": Case(lambda stage: setattr(stage.watcher, "stopped", "disk full"), "recording stopped", MOVING),
}


def set_off(true: sl.Robot | None = None, moves: bool = True, **settings: Any) -> Stage:
    """A homed controller during a motion."""
    machine = Machine(true or prototype(), nominal=prototype(), start=HOME, seed=1)
    link, clock, watcher = Edited(machine.link()), Clock(), Watcher()
    control = Controller(prototype(), link, pace=clock, record=watcher, seed=2, **settings)
    control.connect()
    control.home(HOME)
    if moves:
        control.start(control.path_to(at(0.3, 0.0, 1.5)))
        cycles(control, 100)
    return Stage(control, machine, link, clock, watcher)


def told_of(control: Controller, first: int) -> list[str]:
    return [event.name for event in control.events_from(first) if event.kind.name == "FAULT"]


def cycles(control: Controller, count: int) -> None:
    for _ in range(count):
        control.cycle()


@pytest.mark.parametrize("name", wide([*GOES_ON, *STOPPING], first=5))
def test_a_lasting_fault_cannot_be_acknowledged(name: str) -> None:
    case, stage = (STOPPING | GOES_ON)[name], set_off()
    control, first = stage.control, len(stage.control.events)
    assert state_of(control) is State.MOVING
    case.begin(stage)
    cycles(control, 60)
    assert told_of(control, first)[0] == case.name
    assert state_of(control) is case.state
    if case.state is not State.FAULT:
        return
    try:
        control.acknowledge()
    except RefusedError:
        assert state_of(control) is State.FAULT
        return
    cycles(control, 60)
    assert state_of(control) is State.FAULT
    assert told_of(control, first).count(case.name) == 2


def test_a_correction_at_its_limit_stops_and_asks_for_homing() -> None:
    stage = set_off(imperfect(zero=2e-3), moves=False, loop=TensionSettings(largest=2e-4))
    control = stage.control
    cycles(control, 300)
    assert CORRECTION in told_of(control, 0)
    assert control.state is State.FAULT
    assert not control.homed


@extended  # test_controller.py tests links of one machine
def test_a_second_controller_is_refused_and_the_first_continues() -> None:
    stage = set_off()
    beside = stage.machine.link(moves=False)

    class Other(Edited):
        def exchange(self, command: Command | None) -> Sample | Missing:
            stage.control.cycle()
            return super().exchange(command)

    second, first = Controller(prototype(), Other(beside), seed=3), len(stage.control.events)
    with pytest.raises(RefusedError, match=f"controller, {stage.control.owner}"):
        second.connect()
    assert second.state is State.OFF
    assert told_of(stage.control, first) == []
    assert stage.control.state in (State.MOVING, State.IDLE)
    assert stage.control.homed

"""Requests that need all groups are refused while a group disagrees, in one line with the group and the next step."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control.commands import disagreement
from sagline.control.controller import Controller
from sagline.control.link import COUNTERS, GroupStatus, Mode, Sample, WinchState
from sagline.control.states import RefusedError, State
from sagline.twin.machine import Machine
from tests.control.rigs import HOME, at, prototype, rig, spy_of, state_of

OWN, COUNTER = 77, 1000
GROUPS = ((0, 1), (2, 3), (4, 5), (6, 7))


def agreeing() -> Sample:
    """Sample of four groups in agreement."""
    four, eight = np.ones(4), np.ones(8)
    whole, none = four.astype(np.int64), np.zeros(8, dtype=np.int64)
    return Sample(
        time=1.0, age=0.01 * four, counter=whole, plc_time=four, owner=OWN * whole, echo=(COUNTER - 2) * whole,
        status=int(GroupStatus.READY | GroupStatus.FOLLOWING) * whole, fault=0 * whole, length=eight, rate=0 * eight,
        torque=eight, tension=eight, filtered=eight, counts=none, state=none + int(WinchState.ENABLED),
        winch_fault=none, discarded=0 * whole,
    )  # fmt: skip


LOCKED = int(GroupStatus.READY | GroupStatus.LOCKED)
BAD: dict[str, tuple[str, int, float, int]] = {
    "old": ("age", 2, 0.04, 2),
    "without an age": ("age", 2, np.nan, 2),
    "of another owner": ("owner", 1, 5, 1),
    "of no owner": ("owner", 1, 0, 1),
    "locked": ("status", 3, LOCKED, 3),
    "emergency": ("status", 3, int(GroupStatus.EMERGENCY), 3),
    "not ready": ("status", 0, int(GroupStatus.BRAKED), 0),
    "stopped": ("fault", 0, 3, 0),
    "drive fault": ("winch_fault", 4, 1, 2),
    "drive state": ("state", 7, int(WinchState.FAULT), 3),
    "without an echo": ("echo", 1, COUNTER - 11, 1),
}


@pytest.mark.parametrize("name", BAD)
def test_each_disagreement_is_refused_with_its_group_cause_and_next_step(name: str, snapshot: Any) -> None:
    field, index, value, group = BAD[name]
    assert disagreement(agreeing(), OWN, COUNTER, GROUPS)[0] is None
    wrong = getattr(agreeing(), field).copy()
    wrong[index] = value
    found, _ = disagreement(agreeing()._replace(**{field: wrong}), OWN, COUNTER, GROUPS)
    assert found is not None
    error = RefusedError("it", *found)
    assert (error.item, error.reason.partition(":")[0]) == ("it", f"group {group}")
    assert str(error) == snapshot
    assert len(str(error)) < 300


def test_an_echo_may_be_ten_commands_old_across_the_end_of_the_counters() -> None:
    sample = agreeing()._replace(echo=np.full(4, COUNTERS - 4))
    assert disagreement(sample, OWN, 6, GROUPS)[0] is None
    assert disagreement(sample, OWN, 7, GROUPS)[0] is not None


MISHAPS = [
    ("servo 2 trips", "group 1: .*drive"),
    ("group 1 is taken", "group 1: .*controller"),
]


@pytest.mark.parametrize(("mishap", "why"), MISHAPS)
def test_a_lasting_disagreement_cannot_be_acknowledged(mishap: str, why: str) -> None:
    """Formerly it could be, and the next path moved the platform by 94 mm with six of eight winches."""
    control, machine = rig()
    machine.inject(mishap)
    for _ in range(60):
        control.cycle()
    assert state_of(control) is State.FAULT
    with pytest.raises(RefusedError, match=why):
        control.acknowledge()
    assert state_of(control) is State.FAULT


def test_a_drive_that_was_reset_can_be_acknowledged() -> None:
    control, machine = rig()
    machine.inject("servo 2 trips")
    for _ in range(60):
        control.cycle()
    machine.reset()
    for _ in range(30):
        control.cycle()
    control.acknowledge()
    assert state_of(control) is State.IDLE
    assert np.linalg.norm(control.go_to(at(0.02, 0.0, 1.5)).position[-1] - [0.02, 0.0, 1.5]) < 3e-4


BEGINNINGS: list[Callable[[Controller], object]] = [
    lambda control: control.start(sl.quintic_path([(0, 0, 1.5), (0, 0, 1.52)], speed=0.1)),
    lambda control: control.start_jog(0, 1e-3),
    lambda control: control.start_jog_platform([1e-3, 0.0, 0.0]),
]


@pytest.mark.parametrize("begin", BEGINNINGS)
def test_nothing_moves_while_a_group_does_not_agree(begin: Callable[[Controller], object]) -> None:
    control, _ = rig()
    assert control.sample is not None
    control._context.sample = control.sample._replace(age=np.array([0.01, 0.01, 0.05, 0.01]))
    with pytest.raises(RefusedError, match=r"group 2: .*0\.05 s"):
        begin(control)
    assert state_of(control) is State.IDLE


def test_locked_drums_are_released_before_connecting() -> None:
    control, machine = rig()
    machine.inject("cable 1 breaks")
    for _ in range(60):
        control.cycle()
    assert state_of(control) is State.EMERGENCY
    control.off()
    began = machine.time
    with pytest.raises(RefusedError, match=r"group 0, 1, 2, 3: .*locked"):
        control.connect()
    assert state_of(control) is State.OFF
    assert machine.time - began < 0.3  # waiting does not help
    machine.reset()
    control.connect()
    assert state_of(control) is State.READY


def owners(machine: Machine) -> set[int]:
    """Owners of the groups in their blocks."""
    return {report.owner for group in range(4) if (report := machine.report(group)) is not None}


def test_a_refused_controller_has_released_its_grants() -> None:
    machine = Machine(prototype(), start=HOME, seed=1, faults=["group 2 is taken"])
    control = Controller(prototype(), machine.link(), seed=2)
    with pytest.raises(RefusedError, match=r"group 2: .*controller"):
        control.connect()
    assert control.owner not in owners(machine)


def test_ctrl_c_during_connecting_releases_the_grants(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        control, machine = rig(home=False)
        cycles = []
        look = control.cycle

        def cycle() -> None:
            cycles.append(control.owner in owners(machine))
            if len(cycles) == 4:
                signal.raise_signal(signal.SIGINT)
            look()

        monkeypatch.setattr(control, "cycle", cycle)
        with pytest.raises(KeyboardInterrupt):
            control.connect()
    finally:
        signal.signal(signal.SIGINT, before)
    assert any(cycles)
    assert control.state is State.OFF
    assert control.owner not in owners(machine)


def test_grants_are_claimed_only_during_connecting() -> None:
    control, _ = rig()
    control.go_to(at(0.01, 0.0, 1.5))
    control.off()
    commands = [command for command in spy_of(control).commands if command is not None]
    first = next(k for k, command in enumerate(commands) if command.mode is Mode.HOLD and not command.claims)
    assert all(command.claims for command in commands[:first])
    assert not any(command.claims for command in commands[first:])
    assert first < 20

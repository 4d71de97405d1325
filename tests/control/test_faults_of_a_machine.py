"""Faults of a machine in one process with its controller: the resulting state and the delay."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.control.recording import EventKind
from sagline.control.states import State
from tests.control.rigs import Busy, at
from tests.control.stops import HOME, PROTOTYPE
from tests.tiers import extended

BIAS = np.array([2.0, -1.0, 1.5, -2.0, 0.5, 2.0, -2.0, 1.0])  # N
CASES = {  # injected fault: reported fault, following state, and the largest delay of each in ms
    "cell 3 reads 0 N": ((("cell zero or saturated", 30),), None),
    "cell 5 fails": ((("cell lost", 10),), (State.STOPPING, 10)),
    "cable 2 breaks": ((("cable broken", 40),), (State.EMERGENCY, 40)),
    "encoder 5 jumps by 2 mm": ((("encoder jump", 10),), (State.STOPPING, 10)),
    "group 1 is silent": ((("group stale", 30), ("group silent", 100)), (State.STOPPING, 100)),
    "commands stop": ((("group acts by itself", 110),), (State.STOPPING, 110)),
    "emergency stop": ((("emergency stop", 20),), (State.EMERGENCY, 20)),
}
MORE = {
    "cell 3 sticks": ((("cell stuck", 500),), None),
    "cell 3 reads -50 N": ((("cell zero or saturated", 10),), None),
    "cell 3 is wrong by 30 N": ((("cell wrong", 500),), None),
    "cell 6 is wrong by -25 N": ((("cell wrong", 500),), None),
    "load grows by 5 kg": ((), None),
    "load grows by -10 kg": ((), None),
    "servo 3 is limited to 60 N": (
        (("following error", 200), ("group acts by itself", 600)),  # reported when the others stop
        (State.STOPPING, 200),
    ),
    "servo 3 trips": ((("group acts by itself", 20),), (State.STOPPING, 20)),
    "group 1 repeats": (
        (("block discarded", 20), ("group stale", 30), ("group silent", 100)),
        (State.STOPPING, 100),
    ),
    "group 2 is torn": (
        (("block discarded", 20), ("group stale", 30), ("group silent", 100)),
        (State.STOPPING, 100),
    ),
    "group 0 is foreign": (
        (("block discarded", 20), ("group stale", 30), ("group silent", 100)),
        (State.STOPPING, 100),
    ),
    "group 3 goes back": (
        (("block discarded", 20), ("group stale", 30), ("group silent", 100)),
        (State.STOPPING, 100),
    ),
    "group 1 is taken": ((("owner lost", 20), ("group acts by itself", 600)), (State.STOPPING, 20)),
    "commands repeat": ((("group acts by itself", 110),), (State.STOPPING, 110)),
    "commands are foreign": ((("group acts by itself", 110),), (State.STOPPING, 110)),
}


def happens(what: str) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]:
    """Reported faults and entered states after an injection during a motion, each with its time [ms]."""
    winch = PROTOTYPE.winches
    assert winch is not None
    home = sl.Pose(HOME, np.eye(3))
    true = PROTOTYPE.replace(winches=winch.replace(load_cell_bias=BIAS))
    machine = sl.twin.Machine(true, nominal=PROTOTYPE, start=home, surveyed=True, seed=1)
    control = sl.control.Controller(PROTOTYPE, link=machine.link())
    control.connect()
    control.home(home)
    control.start(control.plan(sl.quintic_path([HOME, (-0.05, 0.5, 1.2)], durations=3.0)))
    for _ in range(100):
        control.cycle()
    before, begin = len(control.events), machine.time
    machine.inject(f"{what} at {begin:.3f} s")
    for _ in range(60):
        control.cycle()
    new = control.events[before:]
    faults = [(event.name, 1e3 * (event.time - begin)) for event in new if event.kind == EventKind.FAULT]
    states = [(event.name, 1e3 * (event.time - begin)) for event in new if event.kind == EventKind.STATE]
    return faults, states


@pytest.mark.parametrize("what", [*CASES, *(pytest.param(what, marks=pytest.mark.soak) for what in MORE)])
def test_a_fault_is_reported_once_and_leads_to_its_state_in_time(what: str) -> None:
    told, state = (CASES | MORE)[what]
    faults, states = happens(what)
    assert [name for name, _ in faults] == [name for name, _ in told]
    for (_, after), (name, most) in zip(faults, told, strict=True):
        assert after <= most + 1e-6, name
    if state is None:
        assert states == []
    else:
        assert states[0][0] == state[0].name
        assert states[0][1] <= state[1] + 1e-6


@extended
@pytest.mark.parametrize("seed", range(2))
def test_a_busy_computer_causes_no_encoder_fault(seed: int) -> None:
    """Drives follow late commands as fast as they can."""
    machine = sl.twin.Machine(PROTOTYPE, seed=seed)
    control = sl.control.Controller(PROTOTYPE, Busy(machine.link(), seed), seed=1)
    control.connect()
    control.home(at(*HOME))
    done = control.go_to(at(0.2, -0.4, 1.4))
    assert done.status is sl.control.ExecutionStatus.DONE

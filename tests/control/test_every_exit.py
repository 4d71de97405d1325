"""Every transition of the table of states is executed once with a machine."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from sagline.control.controller import Controller
from sagline.control.recording import EventKind
from sagline.control.states import TABLE, RefusedError, State
from sagline.twin.machine import Machine
from tests.control.rigs import HOME, at, rig
from tests.tiers import extended

pytestmark = extended  # the table itself is tested in test_states.py

Drive = Callable[[Controller, Machine], object]


def cycles(control: Controller, count: int) -> None:
    for _ in range(count):
        control.cycle()


def until_it_stands(control: Controller) -> None:
    while control.moving:
        control.cycle()


def on_the_way(control: Controller) -> None:
    control.start(control.path_to(at(0.1, 0.0, 1.5)))
    cycles(control, 60)


def paused(control: Controller) -> None:
    on_the_way(control)
    control.pause()
    cycles(control, 5)


def stopping(control: Controller) -> None:
    on_the_way(control)
    control.stop()
    cycles(control, 5)


def jogging(control: Controller) -> None:
    control.start_jog_platform([0.02, 0.0, 0.0])
    cycles(control, 20)


def homing(control: Controller) -> None:
    control.off()
    control.connect()
    control.begin_homing(HOME)
    cycles(control, 5)


def jog_in_homing(control: Controller) -> None:
    homing(control)
    control.start_jog(0, 2e-3)
    cycles(control, 5)


def ready(control: Controller) -> None:
    control.off()
    control.connect()
    cycles(control, 5)


def idle(control: Controller) -> None:
    """The initial state."""


def mended(control: Controller, machine: Machine) -> None:
    machine.inject("servo 2 trips")
    cycles(control, 40)
    machine.reset()
    cycles(control, 30)


def connecting_in_vain(control: Controller, machine: Machine) -> None:
    control.off()
    machine.emergency_stop()
    with pytest.raises(RefusedError):
        control.connect()


def falls(begin: Callable[[Controller], object], what: str) -> Drive:
    """A fault after a beginning."""

    def drive(control: Controller, machine: Machine) -> None:
        begin(control)
        machine.inject(what)
        cycles(control, 40)

    return drive


def both(first: Drive, second: Drive) -> Drive:
    """Both steps in order."""

    def drive(control: Controller, machine: Machine) -> None:
        first(control, machine)
        second(control, machine)

    return drive


def asked(what: Callable[[Controller], object]) -> Drive:
    """A request of the operator."""
    return lambda control, machine: what(control)


def does(begin: Callable[[Controller], object], then: Callable[[Controller], object]) -> Drive:
    """A request after a beginning."""

    def drive(control: Controller, machine: Machine) -> None:
        begin(control)
        then(control)
        cycles(control, 30)
        until_it_stands(control)

    return drive


STOP, TRIP, OFF = "emergency stop", "servo 2 trips", Controller.off
TOURS: dict[str, Drive] = {
    "connect, home, go, off": does(lambda control: control.go_to(at(0.01, 0.0, 1.5)), OFF),
    "connecting in vain": connecting_in_vain,
    "off from ready": does(ready, OFF),
    "off from homing": does(homing, OFF),
    "off from a fault": both(mended, asked(OFF)),
    "off from an emergency": both(falls(idle, STOP), asked(OFF)),
    "acknowledged": both(mended, asked(Controller.acknowledge)),
    "jogged": does(jogging, until_it_stands),
    "paused": does(paused, until_it_stands),
    "stopped in homing": does(jog_in_homing, Controller.stop),
    "stopped on the way": does(on_the_way, Controller.stop),
    "stopped in a jog": does(jogging, Controller.stop),
    "stopped in a pause": does(paused, Controller.stop),
    **{
        f"{what} after {begin.__name__}": falls(begin, what)
        for begin in (ready, homing, idle, on_the_way, jogging, paused, stopping)
        for what in (STOP, TRIP)
    },
    "emergency stop in a fault": both(falls(idle, TRIP), falls(idle, STOP)),
}


def test_exactly_the_listed_transitions_occur() -> None:
    driven = set()
    for drive in TOURS.values():
        control, machine = rig()
        drive(control, machine)
        changes = [event.state for event in control.events if event.kind is EventKind.STATE]
        driven |= set(pairwise([State.OFF, *changes]))
    listed = {(state, after) for state, (_, exits) in TABLE.items() for after in exits}
    names = {(a.name, b.name) for a, b in listed - driven}
    assert names == set()
    assert driven <= listed

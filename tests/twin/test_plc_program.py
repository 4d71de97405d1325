"""Behavior of a PLC, scan by scan."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sagline.control import Mode
from sagline.twin.plc_program import Order, PlcLimits, Program
from tests.control.protocol import COUNTERS, HEARTBEAT, OWNER_TIMEOUT, RAMP, GroupFault, GroupStatus, WinchState
from tests.tiers import extended

PERIOD = 0.01
LIMITS = PlcLimits([0.5, 0.5], [8.0, 9.0], [0.4, 0.5], [1000.0, 2000.0])


class Group:
    """A program whose drives are at their set points by default."""

    def __init__(self) -> None:
        self.program, self.now, self.counter = Program(LIMITS, PERIOD), 100.0, 0
        self.encoder, self.cell = [3.0, 4.0], [150.0, 160.0]
        self.owner = 7

    def scan(self) -> Program:
        before = list(self.program.powered)
        self.program.scan(self.now, list(self.encoder), list(self.cell))
        self.now += PERIOD
        for i, (was, has) in enumerate(zip(before, self.program.powered, strict=True)):
            if was or has:
                self.encoder[i] = self.program.length[i]
        return self.program

    def order(
        self, mode: int, length: list[float] | None = None, rate: list[float] | None = None, **other: Any
    ) -> Order:
        self.counter += 1
        length, rate = length or list(self.program.length), rate or [0.0, 0.0]
        order = Order(self.counter, self.owner, mode, HEARTBEAT, length, rate, [150.0, 160.0], [True, True])
        return order._replace(**other)

    def do(
        self, mode: int, length: list[float] | None = None, rate: list[float] | None = None, **other: Any
    ) -> Program:
        self.program.take(self.order(mode, length, rate, **other))
        return self.scan()

    def ready(self) -> Program:
        self.program.claim(self.owner, self.now)
        self.do(Mode.HOLD)
        return self.do(Mode.HOLD)

    def moving(self, rate: tuple[float, float] = (0.2, -0.1), cycles: int = 5) -> Program:
        self.ready()
        for _ in range(cycles):
            length = [at + r * PERIOD for at, r in zip(self.program.length, rate, strict=True)]
            self.do(Mode.FOLLOW, length, list(rate))
        return self.program


def test_a_grant_has_one_owner() -> None:
    group = Group()
    program = group.scan()
    assert program.status == GroupStatus.READY | GroupStatus.BRAKED
    program.claim(0, group.now)
    assert program.owner == 0
    program.claim(7, group.now)
    program.claim(8, group.now)
    assert program.owner == 7
    program.take(group.order(Mode.HOLD, owner=8))
    assert program.echo == 0
    group.do(Mode.HOLD)
    begin = group.now - PERIOD
    while group.now < begin + OWNER_TIMEOUT - 1e-6:
        program.claim(8, group.now)
        assert program.owner == 7
        group.scan()
    program.claim(8, group.now)
    assert (program.owner, program.echo) == (8, 0)


def test_a_released_grant_applies_the_brakes() -> None:
    group = Group()
    program = group.ready()
    assert program.powered == [True, True]
    group.do(Mode.LEAVE)
    assert (program.owner, program.powered) == (0, [False, False])
    assert program.status == GroupStatus.READY | GroupStatus.BRAKED
    program.take(group.order(Mode.HOLD))
    assert group.scan().powered == [False, False]


@pytest.mark.parametrize("first", [1, COUNTERS - 2])
def test_commands_are_executed_once_and_in_order(first: int) -> None:
    group = Group()
    group.program.claim(7, group.now)
    taken = []
    for step in (0, 1, 1, 4, 3, 0, 5):
        counter = (first - 1 + step) % COUNTERS + 1
        group.program.take(group.order(Mode.HOLD, counter=counter))
        taken.append((group.program.echo - first) % COUNTERS)
    assert taken == [0, 1, 1, 4, 4, 4, 5]


def test_drives_reach_their_tension_before_the_brakes_open() -> None:
    group = Group()
    group.program.claim(7, group.now)
    program = group.do(Mode.HOLD)
    assert (program.powered, program.tension) == ([False, False], [150.0, 160.0])
    group.encoder = [3.001, 4.002]
    program = group.do(Mode.HOLD, enable=[True, False])
    assert program.powered == [True, False]
    assert program.length[0] == 3.001
    assert program.states([0.0, 0.0])[0] == [WinchState.ENABLED, WinchState.BRAKED]
    assert program.states([1.0, 1.0])[0] == [WinchState.SATURATED, WinchState.BRAKED]
    program = group.do(Mode.HOLD, enable=[False, False])
    assert program.powered == [False, False]


def test_without_new_commands_the_motion_continues_then_stops_and_holds() -> None:
    group = Group()
    program = group.moving()
    begin, rate = np.array(program.length), np.array([0.2, -0.1])
    path = np.array([begin, *(group.scan().length for _ in range(40))])
    speed = np.diff(path, axis=0) / PERIOD
    waits = round(HEARTBEAT / PERIOD) - 1  # the period of the command itself has passed
    np.testing.assert_allclose(speed[:waits], np.tile(rate, (waits, 1)), atol=1e-12)
    times = PERIOD * (np.arange(round(RAMP / PERIOD)) + 0.5)
    np.testing.assert_allclose(speed[waits : waits + 20], np.outer(1.0 - times / RAMP, rate), atol=1e-12)
    assert (speed[waits + 20 :] == 0.0).all()
    assert program.fault == GroupFault.HEARTBEAT
    assert program.status == GroupStatus.READY | GroupStatus.HOLDING
    group.do(Mode.FOLLOW, [program.length[0] + 0.001, program.length[1]], [0.1, 0.0])
    assert program.fault == GroupFault.HEARTBEAT
    assert program.length == path[-1].tolist()
    group.do(Mode.HOLD)
    assert (program.fault, program.status) == (GroupFault.NONE, GroupStatus.READY)
    moved = program.length[0] + 0.001
    assert group.do(Mode.FOLLOW, [moved, program.length[1]], [0.1, 0.0]).length[0] == moved
    assert program.status == GroupStatus.READY | GroupStatus.FOLLOWING


@pytest.mark.parametrize(("valid_for", "scans"), [(0.03, 3), (0.0, 1), (5.0, 10), (math.nan, 10), (-1.0, 1)])
def test_a_command_is_valid_for_its_time_and_at_most_the_heartbeat(valid_for: float, scans: int) -> None:
    group = Group()
    program = group.moving()
    group.do(Mode.FOLLOW, program.length, [0.2, -0.1], valid_for=valid_for)
    found = [bool(group.scan().fault) for _ in range(12)]
    assert found.index(True) == scans - 1


def test_a_lost_command_does_not_stop_the_motion() -> None:
    group = Group()
    program = group.moving()
    begin = list(program.length)
    for _ in range(4):
        group.scan()
    length = [begin[0] + 0.2 * 5 * PERIOD, begin[1] - 0.1 * 5 * PERIOD]
    program = group.do(Mode.FOLLOW, length, [0.2, -0.1])
    assert (program.fault, program.length) == (GroupFault.NONE, length)


@pytest.mark.parametrize("scan", [0.001, 0.004, 0.005, 0.01])
def test_fast_scans_interpolate_set_points_linearly(scan: float) -> None:
    """For every scan time, set points follow those of a command within one cycle after its arrival, linearly."""
    group = Group()
    group.program = Program(LIMITS, scan)
    program, begin, commands = group.ready(), group.now, 0
    start, times, found = program.length[0], [], []
    while group.now < begin + 0.4:
        if group.now - begin >= commands * PERIOD - 1e-9:
            commands += 1
            program.take(group.order(Mode.FOLLOW, [start + 0.2 * PERIOD * commands, 4.0], [0.2, 0.0]))
        group.scan()
        group.now += scan - PERIOD
        times.append(group.now - begin)
        found.append(program.length[0] - start)
    late = 0.2 * (0.004 if scan == 0.004 else 0.0)  # a command waits for the next scan
    assert np.abs(np.array(found) - 0.2 * np.array(times)).max() <= late + 1e-12


def test_a_command_to_hold_uses_the_ramp() -> None:
    group = Group()
    program = group.moving()
    begin = program.length[0]
    assert group.do(Mode.HOLD).status & GroupStatus.RAMPING
    for _ in range(25):
        group.do(Mode.HOLD)
    assert program.length[0] - begin == pytest.approx(0.2 * RAMP / 2)
    assert (program.fault, program.status) == (GroupFault.NONE, GroupStatus.READY)


@pytest.mark.parametrize("broken", ["nan", "inf", "fast", "rate", "no tension", "pushed", "beyond its limit"])
def test_refused_set_points(broken: str) -> None:
    group = Group()
    program = group.moving()
    length, rate, tension = list(program.length), [0.2, -0.1], [150.0, 160.0]
    index = 1
    if broken in (tensions := {"no tension": math.nan, "pushed": -0.1, "beyond its limit": 2000.1}):
        tension[index] = tensions[broken]
    elif broken == "rate":
        rate[index] = -0.51
    else:
        length[index] = {"nan": math.nan, "inf": math.inf, "fast": length[index] + 2.01 * 0.5 * PERIOD}[broken]
    before = list(program.length)
    group.do(Mode.FOLLOW, length, rate, tension=tension)
    assert program.fault == GroupFault.SET_POINT
    assert program.tension == [150.0, 160.0]
    for _ in range(30):
        group.scan()
    assert np.isfinite(program.length).all()
    assert np.abs(np.array(program.length) - before).max() <= 0.2 * RAMP / 2 + 1e-9


@pytest.mark.parametrize(("start", "step"), [(0.501, -0.001), (8.999, 0.001)])
def test_set_points_at_the_ends_of_their_range(start: float, step: float) -> None:
    group = Group()
    group.encoder = [3.0, start]
    program = group.ready()
    for scale, fault in ((0.999, GroupFault.NONE), (2.0, GroupFault.SET_POINT)):
        group.do(Mode.FOLLOW, [3.0, start + scale * step])
        assert program.fault == fault
    assert program.length[1] == start + 0.999 * step


@pytest.mark.parametrize("reading", [2001.0, math.nan])
def test_a_high_tension_stops_winding_in(reading: float) -> None:
    group = Group()
    program = group.moving()
    group.cell = [900.0, reading]
    before = list(program.length)
    for cycle in range(1, 30):
        group.do(Mode.FOLLOW, [before[0] + 0.002 * cycle, before[1] - 0.001 * cycle], [0.2, -0.1])
        assert program.length[1] >= before[1]
    assert GroupFault(program.fault) == GroupFault.OVER_TENSION
    assert program.length[0] - before[0] == pytest.approx(0.2 * RAMP / 2)
    group.do(Mode.HOLD)
    at = list(program.length)
    for cycle in range(1, 20):  # winding out is allowed, to reduce the tension
        group.do(Mode.FOLLOW, [at[0], at[1] + 0.001 * cycle], [0.0, 0.1])
    assert program.length[1] == pytest.approx(at[1] + 0.019)
    assert not program.fault


@pytest.mark.parametrize("reading", [2001.0, math.nan])
def test_a_high_tension_stops_winding_in_during_the_ramp(reading: float) -> None:
    group = Group()
    program = group.moving()
    group.cell = [900.0, reading]
    before = list(program.length)
    group.do(Mode.HOLD)
    for _ in range(25):
        group.scan()
    assert program.length[0] - before[0] == pytest.approx(0.2 * RAMP / 2)
    assert program.length[1] == before[1]


@pytest.mark.parametrize(("reading", "held"), [(120.0, 120.0), (-3.0, 0.0), (math.nan, 150.0), (1000.1, 150.0)])
def test_a_lagging_drive_stands_and_holds_the_measured_tension(reading: float, held: float) -> None:
    group = Group()
    program = group.moving()
    group.encoder[0] = program.length[0] + 0.0101
    group.cell[0] = reading
    group.do(Mode.FOLLOW, program.length, [0.2, -0.1])
    assert program.fault == GroupFault.FOLLOWING_ERROR
    assert program.length[0] == group.encoder[0]
    assert program.tension == [held, 160.0]
    for _ in range(30):  # its expected tension may be wrong: a command to hold does not set it
        group.do(Mode.HOLD, tension=[700.0, 160.0])
    assert (program.fault, program.powered, program.tension) == (GroupFault.NONE, [True, True], [held, 160.0])


def test_a_drive_that_lags_again_is_braked_until_acknowledged() -> None:
    """For any earlier reason of a stop of its group."""
    group = Group()
    program = group.moving()
    while not program.fault:
        group.scan()
    assert program.fault == GroupFault.HEARTBEAT
    for powered in ([True, True], [False, False]):
        group.encoder[0] = program.length[0] + 0.0101
        group.scan()
        assert (program.fault, program.powered) == (GroupFault.FOLLOWING_ERROR, powered)
    for _ in range(30):
        group.do(Mode.HOLD)
    assert program.status == GroupStatus.READY | GroupStatus.LOCKED | GroupStatus.BRAKED
    program.reset()
    group.do(Mode.HOLD)
    assert group.do(Mode.HOLD).powered == [True, True]


def test_a_command_to_hold_does_not_end_the_ramp_of_a_fault() -> None:
    group = Group()
    program = group.moving()
    before, since = list(program.length), group.now
    group.do(Mode.FOLLOW, [math.nan, math.nan])
    while program.fault:
        assert group.do(Mode.HOLD).status & (GroupStatus.RAMPING | GroupStatus.HOLDING | GroupStatus.READY)
    assert group.now - since == pytest.approx(RAMP + PERIOD, abs=1.1 * PERIOD)
    assert np.subtract(program.length, before) == pytest.approx(np.array([0.2, -0.1]) * RAMP / 2)


def test_locked_drums_are_released_by_the_operator() -> None:
    group = Group()
    program = group.moving()
    group.do(Mode.LOCK)
    for mode in (Mode.HOLD, Mode.FOLLOW):
        group.do(mode)
        assert program.powered == [False, False]
        assert program.status & GroupStatus.LOCKED
        assert program.states([0.0, 0.0])[0] == [WinchState.LOCKED] * 2
    program.reset()
    assert group.scan().status == GroupStatus.READY | GroupStatus.BRAKED
    group.do(Mode.HOLD)
    assert group.do(Mode.HOLD).powered == [True, True]


@pytest.mark.parametrize("far", [0.0, 0.001, 0.004, 0.01, 0.02])
@pytest.mark.parametrize(("winch", "end", "rate"), [(0, 0.5, -0.3), (1, 9.0, 0.3)])
def test_set_points_between_commands_and_in_the_ramp_stay_in_their_range(
    far: float, winch: int, end: float, rate: float
) -> None:
    group = Group()
    group.encoder[winch] = end - math.copysign(far + 0.003, rate)
    program = group.ready()
    length, rates = list(program.length), [0.0, 0.0]
    length[winch], rates[winch] = end - math.copysign(far, rate), rate
    group.do(Mode.FOLLOW, length, rates)
    path = [group.scan().length[winch] for _ in range(40)]
    assert program.fault == GroupFault.HEARTBEAT
    assert LIMITS.least[winch] <= min(path) <= max(path) <= LIMITS.most[winch]
    assert path[-1] == end
    assert np.abs(np.diff(path)).max() <= 0.3 * PERIOD + 1e-9


def test_a_drive_out_of_its_range_only_comes_back() -> None:
    group = Group()
    group.encoder = [0.4, 9.2]
    program = group.ready()
    group.do(Mode.FOLLOW, [0.4, 9.2], [-0.1, 0.1])
    assert (program.fault, program.length) == (GroupFault.SET_POINT, [0.4, 9.2])


def test_a_late_command_moves_no_faster_than_the_winch() -> None:
    group = Group()
    program = group.ready()
    group.do(Mode.FOLLOW, program.length)
    for _ in range(6):
        group.scan()
    begin = list(program.length)
    group.do(Mode.FOLLOW, [begin[0] + 0.025, begin[1] - 0.03])  # allowed in the 70 ms that have passed
    path = np.array([begin, program.length, *(group.scan().length for _ in range(8))])
    assert not program.fault
    np.testing.assert_allclose(np.abs(np.diff(path, axis=0)).max(axis=0) / PERIOD, LIMITS.speed, atol=1e-6)


def test_an_open_emergency_stop_circuit_is_an_emergency_stop() -> None:
    group = Group()
    program = group.moving()
    program.contact = False
    group.do(Mode.FOLLOW)
    assert (program.powered, program.fault) == ([False, False], GroupFault.EMERGENCY_STOP)
    program.reset()
    assert group.scan().status & GroupStatus.EMERGENCY  # a reset has no effect while it is open
    program.contact = True
    assert group.scan().status & GroupStatus.EMERGENCY
    program.reset()
    assert group.scan().status == GroupStatus.READY | GroupStatus.BRAKED


def test_an_emergency_stop_is_reported_and_the_grant_can_be_released() -> None:
    group = Group()
    program = group.moving()
    program.contact = False
    group.do(Mode.FOLLOW)
    assert program.powered == [False, False]
    assert program.status == GroupStatus.EMERGENCY | GroupStatus.LOCKED | GroupStatus.BRAKED
    assert program.fault == GroupFault.EMERGENCY_STOP
    group.do(Mode.LEAVE)
    assert program.owner == 0
    assert program.fault == GroupFault.EMERGENCY_STOP
    program.contact = True
    program.reset()
    assert group.scan().fault == GroupFault.NONE


def test_a_tripped_drive_stops_its_group() -> None:
    group = Group()
    program = group.moving()
    program.trip(1, 9)
    for _ in range(25):
        group.do(Mode.FOLLOW, program.length, [0.2, 0.0])
    assert program.fault == GroupFault.DRIVE
    assert program.powered == [True, False]
    assert program.states([0.0, 0.0]) == ([WinchState.ENABLED, WinchState.FAULT], [0, 9])
    assert not program.status & GroupStatus.READY
    group.do(Mode.HOLD)
    assert (program.fault, program.powered) == (GroupFault.DRIVE, [True, False])
    program.reset()
    group.do(Mode.HOLD)
    assert group.do(Mode.HOLD).powered == [True, True]


def test_a_change_of_the_grant_in_motion_is_a_stop() -> None:
    group = Group()
    program = group.moving()
    program.seize(8, group.now)
    for _ in range(25):
        group.do(Mode.FOLLOW, program.length, [0.2, -0.1])
    assert program.status & GroupStatus.HOLDING
    assert program.fault == GroupFault.HEARTBEAT


def anything(generator: np.random.Generator, group: Group) -> None:
    """One scan of a group with random events, most of them rare."""
    program = group.program

    def rarely(share: float, strange: Any, usual: Any) -> Any:
        return strange if generator.random() < share else usual

    def spoiled(share: float, usual: float) -> float:
        return float(rarely(share, generator.choice([math.nan, math.inf, -math.inf, -1.0, 0.0, 1e300]), usual))

    if (pick := generator.random()) < 0.1:
        program.claim(int(generator.choice([0, 7, 8])), group.now)
    elif pick < 0.105:
        program.trip(int(generator.integers(2)), 1)
    elif pick < 0.11:
        program.contact = False
    elif pick < 0.15:
        program.contact = True
        program.reset()
    group.cell = [rarely(0.01, 1e4, 150.0) for _ in range(2)]
    group.encoder = [at + rarely(0.02, 0.02, 0.0) for at in group.encoder]
    if generator.random() < 0.9:
        rate = generator.uniform(-0.4, 0.4, 2)
        order = group.order(
            rarely(0.2, int(generator.choice([*Mode, 9])), Mode.FOLLOW),
            [spoiled(0.01, at + r * PERIOD) for at, r in zip(program.length, rate, strict=True)],
            [spoiled(0.01, r) for r in rate],
            owner=rarely(0.02, 8, 7),
            valid_for=spoiled(0.05, 0.1),
            tension=[spoiled(0.05, 150.0) for _ in range(2)],
            enable=rarely(0.1, [bool(generator.integers(2)), True], [True, True]),
        )
        program.take(order)
    program.scan(group.now, list(group.encoder), list(group.cell))
    group.now += PERIOD


@pytest.mark.parametrize("seeds", [8, pytest.param(30, marks=extended), pytest.param(1000, marks=pytest.mark.soak)])
def test_drives_stay_within_their_limits_for_any_input(seeds: int) -> None:
    followed = 0
    for seed in range(seeds):
        generator, group = np.random.default_rng(seed), Group()
        program = group.program
        program.length = list(group.encoder)
        program.claim(7, group.now)
        for _ in range(200):
            before, powered, encoder = list(program.length), list(program.powered), list(group.encoder)
            anything(generator, group)
            after = np.array(program.length)
            followed += program.status == GroupStatus.READY | GroupStatus.FOLLOWING
            assert np.isfinite([*after, *program.tension]).all()
            assert program.owner or not any(program.powered)
            assert not (any(program.powered) and (program.emergency or program.locked))
            for i in range(2):
                assert after[i] >= min(LIMITS.least[i], before[i], group.encoder[i])
                assert after[i] <= max(LIMITS.most[i], before[i], group.encoder[i])
                begun = program.powered[i] and not powered[i]
                assert not (program.drive_fault[i] and program.powered[i])
                if not program.powered[i] and not powered[i]:
                    assert after[i] == before[i]
                if powered[i] and program.powered[i] and group.cell[i] > LIMITS.tension[i]:
                    assert after[i] >= min(before[i], group.encoder[i])
                if begun:
                    assert abs(after[i] - group.encoder[i]) <= 0.5 * 2 * PERIOD + 1e-9
            assert len(encoder) == 2
            group.encoder = [
                at if has else stood for at, has, stood in zip(after, program.powered, encoder, strict=True)
            ]
    assert followed > 100

"""All fault rules on artificial samples with the lockstep clock: detection, delay, and no false alarms."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.control.evidence import Cycle, Reaction
from sagline.control.faults import FAULT_TABLE, FAULTS, faults_of
from sagline.control.link import GroupFault, GroupStatus, Mode, Refusal, Sample, WinchState
from sagline.core.arrays import Array
from tests.control.lockstep import OWNER, ROBOT, Change, course, cycles, one, told, with_sample
from tests.refusal import refused
from tests.tiers import extended, wide

START = 40  # cycle; the prototype moves
FALLING = -1.0  # N m at a motor: a cable force of 667 N
# names of faults in events and logs
DEAD_CELL, GROUP_ACTS, NOT_FOLLOWING = "cell zero or saturated", "group acts by itself", "group does not follow"


def since(alter: Callable[[int, Cycle], Cycle], start: int = START, end: int = 10**9) -> Change:
    """Changes from a cycle on, depending on the time since then."""
    return lambda k, cycle: alter(k - start, cycle) if start <= k < end else cycle


def silent(group: int, count: int, start: int = START) -> Change:
    """A group sends no new data for a number of cycles."""
    last: list[Sample] = []

    def alter(k: int, cycle: Cycle) -> Cycle:
        if k < start or k >= start + count:
            if k < start:
                last[:] = [cycle.sample]
            return cycle
        mine = {4: np.arange(4) == group, 8: np.arange(8) // 2 == group}
        old = {
            name: np.where(mine[value.size], getattr(last[0], name), value)
            for name, value in cycle.sample._asdict().items()
            if name not in ("time", "age", "reasons")
        }
        age = one(cycle.sample.age, group, 0.004 + 0.01 * (k - start + 1))
        return cycle._replace(sample=Sample(cycle.sample.time, age, **old))

    return alter


def cell(index: int, reading: Callable[[int, float], float], torque: float | None = None) -> Change:
    """A cell reads a function of the time since START and of the true tension; its motor can hold another one."""

    def alter(k: int, cycle: Cycle) -> Cycle:
        sample = cycle.sample
        value = reading(k, float(sample.tension[index]))
        fields = {"tension": one(sample.tension, index, value + 0.01 * (k % 7))}  # no cell is constant
        if torque is not None:
            fields["torque"] = one(sample.torque, index, torque)
        return with_sample(cycle, **fields)

    return since(alter)


def field(name: str, index: int, value: float, start: int = START, end: int = 10**9) -> Change:
    """One value of the sample is replaced."""
    return since(
        lambda k, cycle: with_sample(cycle, **{name: one(getattr(cycle.sample, name), index, value)}), start, end
    )


def both(first: Change, second: Change) -> Change:
    return lambda k, cycle: second(k, first(k, cycle))


def broken(index: int, others: float = 5.0) -> Change:
    """The others change by a given amount in each cycle, alternately up and down."""
    turns = np.where(np.arange(8) % 2, 1.0, -1.0)

    def alter(k: int, cycle: Cycle) -> Cycle:
        sample = cycle.sample
        return with_sample(
            cycle,
            tension=one(sample.tension + others * min(k, 8) * turns, index, 2.0 + 0.1 * (k % 3)),
            torque=one(sample.torque, index, 0.01),
        )

    return since(alter)


def slackens(index: int) -> Change:
    """Slowly, as with a wrong plan; the others take the load."""

    def alter(k: int, cycle: Cycle) -> Cycle:
        sample = cycle.sample
        given = min(8.0 * k, sample.tension[index] - 2.0)
        tension = one(sample.tension + 0.3 * given, index, sample.tension[index] - given + 0.01 * (k % 7))
        return with_sample(cycle, tension=tension, torque=one(sample.torque, index, -tension[index] * 0.0015))

    return since(alter)


def stuck(index: int) -> Change:
    kept: list[float] = []

    def alter(k: int, cycle: Cycle) -> Cycle:
        if k == 0:
            kept[:] = [float(cycle.sample.tension[index])]
        return with_sample(cycle, tension=one(cycle.sample.tension, index, kept[0]))

    return since(alter)


def jump(index: int, by: float) -> Change:
    return since(lambda k, cycle: with_sample(cycle, length=_added(cycle.sample.length, index, by)))


def lags(index: int, speed: float) -> Change:
    """A drum lags, and its encoder shows it."""
    return since(
        lambda k, cycle: with_sample(
            cycle,
            length=_added(cycle.sample.length, index, -speed * 0.01 * (k + 0.5)),
            rate=_added(cycle.sample.rate, index, -speed),
        )
    )


def _added(array: Array, index: int, by: float) -> Array:
    more = array.copy()
    more[index] += by
    return more


def late(*times: tuple[int, float]) -> Change:
    by = dict(times)
    return lambda k, cycle: cycle._replace(late=by.get(k - START, 0.0))


def drive_trips(k: int, cycle: Cycle) -> Cycle:
    if k < START:
        return cycle
    sample = cycle.sample
    return with_sample(cycle, winch_fault=one(sample.winch_fault, 5, 17), state=one(sample.state, 5, WinchState.FAULT))


def emergency(k: int, cycle: Cycle) -> Cycle:
    """As by a PLC: power off, drums locked, reason reported."""
    if k < START:
        return cycle
    bits = int(GroupStatus.EMERGENCY | GroupStatus.LOCKED | GroupStatus.BRAKED)
    return with_sample(
        cycle,
        status=np.full(4, bits),
        fault=np.full(4, int(GroupFault.EMERGENCY_STOP)),
        state=np.full(8, int(WinchState.LOCKED)),
    )


class Case(NamedTuple):
    """A fault injected at START.

    Attributes:
        change: Change of the samples.
        names: Reported faults in order, each once.
        reaction: The strongest reaction.
        cycles: Largest and smallest delay of the last report in cycles.
        words: Pattern of the item and the numbers in its line.
    """

    change: Change
    names: tuple[str, ...]
    reaction: Reaction
    cycles: tuple[int, int]
    words: str


EVENT, DEGRADED, STOPPING, EMERGENCY = Reaction.EVENT, Reaction.DEGRADED, Reaction.STOPPING, Reaction.EMERGENCY
CASES = {
    "group late": Case(silent(2, 5), ("group stale",), DEGRADED, (2, 2), r"^group 2\b.* 34 ms"),
    "group gone": Case(silent(1, 10**6), ("group stale", "group silent"), STOPPING, (9, 9), r"^group 1\b.* ms"),
    "block discarded": Case(field("discarded", 3, 1), ("block discarded",), EVENT, (0, 0), r"^group 3\b"),
    "grant taken": Case(
        field("owner", 1, 99),
        ("owner lost",),
        STOPPING,
        (0, 0),
        r"^group 1\b.*\b99\b.*\b4711\b",
    ),
    "grant lost": Case(field("owner", 3, 0), ("owner lost",), STOPPING, (0, 0), r"^group 3\b"),
    "PLC stopped": Case(
        field("fault", 0, GroupFault.HEARTBEAT),
        ("group acts by itself",),
        STOPPING,
        (0, 0),
        r"^group 0\b.*\b100 ms",
    ),
    "PLC locked": Case(
        field("status", 2, int(GroupStatus.LOCKED)), ("group acts by itself",), STOPPING, (0, 0), r"^group 2\b.*locked"
    ),
    "drive": Case(drive_trips, ("group acts by itself",), STOPPING, (0, 0), r"^group 2\b.*drive 5\b.*\b17\b"),
    "emergency stop": Case(emergency, ("emergency stop",), EMERGENCY, (0, 0), r"group 0, 1, 2, 3\b"),
    "tight": Case(
        cell(3, lambda k, t: 1850.0 if k < 5 else t, -2.8), ("over-tension",), STOPPING, (4, 4), r"^cable 3\b.* 1850 N"
    ),
    "too tight": Case(
        since(
            lambda k, cycle: with_sample(
                cycle,
                tension=cycle.sample.tension + one(np.zeros(8), 3, 2000.0),
                torque=one(cycle.sample.torque, 3, -3.0),
            ),
            end=START + 1,
        ),
        ("over-tension",),
        STOPPING,
        (0, 0),
        r"^cable 3\b.* 2000 N",
    ),
    "slack": Case(slackens(4), ("slack",), STOPPING, (2, 30), r"^cable 4\b"),
    "broken": Case(broken(4), ("cable broken",), EMERGENCY, (2, 2), r"^cable 4\b.* 2\.2 N after "),
    "cell zero": Case(cell(5, lambda k, t: 0.0), ("cell zero or saturated",), DEGRADED, (2, 2), r"^cell 5 reads 0\.0"),
    "cell negative": Case(
        cell(0, lambda k, t: -300.0), ("cell zero or saturated",), DEGRADED, (0, 0), r"^cell 0 reads -300"
    ),
    "cell at full scale": Case(
        cell(7, lambda k, t: 2000.0),
        ("cell zero or saturated",),
        DEGRADED,
        (0, 0),
        r"^cell 7 reads 2000 N .*motor",
    ),
    "cell without a number": Case(
        cell(6, lambda k, t: np.nan), ("cell lost",), STOPPING, (0, 0), r"cell of cable 6 gives no reading"
    ),
    "cell stuck": Case(stuck(2), ("cell stuck",), DEGRADED, (49, 49), r"^cell 2\b.* N in 50 samples"),
    "cell wrong": Case(cell(1, lambda k, t: t + 25.0), ("cell wrong",), DEGRADED, (35, 49), r"^cell 1\b.* \d+ N"),
    "encoder jump": Case(jump(1, 0.002), ("encoder jump",), STOPPING, (0, 0), r"^encoder 1\b.* 1\.98"),
    "encoder jumps far": Case(jump(6, -0.5), ("encoder jump",), STOPPING, (0, 0), r"^encoder 6\b.* 500 mm"),
    "encoder without a number": Case(jump(2, np.nan), ("encoder jump",), STOPPING, (0, 0), r"^encoder 2\b"),
    "encoder beyond numbers": Case(jump(2, np.inf), ("encoder jump",), STOPPING, (0, 0), r"^encoder 2\b"),
    "drum lags": Case(lags(7, 0.05), ("following error",), STOPPING, (9, 16), r"^winch 7\b.* 5\."),
    "servo": Case(
        field("state", 3, WinchState.SATURATED),
        ("servo at its limit",),
        STOPPING,
        (19, 19),
        r"^drive 3\b",
    ),
    "correction": Case(
        since(lambda k, cycle: cycle._replace(correction=one(np.zeros(8), 2, -5e-3))),
        ("correction at its limit",),
        STOPPING,
        (0, 0),
        r"\b2 by -5\.0 mm",
    ),
    "echo stands": Case(
        field("echo", 2, START - 1),
        ("group does not follow",),
        STOPPING,
        (10, 10),
        r"^group 2\b.* 11\b",
    ),
    "echo of nothing": Case(field("echo", 0, 0), ("group does not follow",), STOPPING, (0, 0), r"^group 0\b"),
    "follows nothing": Case(
        field("status", 1, int(GroupStatus.READY | GroupStatus.BRAKED)),
        ("group does not follow",),
        STOPPING,
        (3, 3),
        r"^group 1\b",
    ),
    "late once": Case(late((0, 0.021)), ("cycle late",), EVENT, (0, 0), r" 21 ms .*allowed: 20 ms\."),
    "late often": Case(
        late((0, 0.006), (40, 0.013), (99, 0.006)),
        ("cycle late",),
        EVENT,
        (99, 99),
        r"^3 .* 100 cycles .* 5 ms .* 13 ms; allowed: 2\.",
    ),
    "stood still": Case(late((0, 0.15)), ("cycle lost",), STOPPING, (0, 0), r" 150 ms late"),
    "disk full": Case(
        since(lambda k, cycle: cycle._replace(recording="no space left on device")),
        ("recording stopped",),
        EVENT,
        (0, 0),
        r"no space left on device",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_fault_is_reported_once_in_time_and_alone(name: str) -> None:
    case = CASES[name]
    found = told(case.change, 145, seed=8)
    assert tuple(each.name for each in found) == case.names
    after = found[-1].cycle - START
    assert case.cycles[0] <= after <= case.cycles[1]
    kinds = {kind.name: kind for kind in FAULTS}
    assert max(kinds[each.name].reaction for each in found) == case.reaction
    assert re.search(case.words, found[-1].line)
    for each in found:
        assert len(each.line) < 250
        assert each.line.isprintable()
        assert each.line.endswith(".")  # with the next step
        assert ". " in each.line


def test_every_rule_is_injected() -> None:
    assert {name for case in CASES.values() for name in case.names} == {kind.name for kind in FAULTS}


QUIET = {
    "a group is late by two cycles": silent(0, 2),
    "a plan that is nearly slack": None,
    "four samples near the limit": since(
        lambda k, cycle: with_sample(
            cycle,
            tension=one(cycle.sample.tension, 3, 1850.0),
            torque=one(cycle.sample.torque, 3, -2.8),
        )._replace(gains=None),
        end=START + 4,
    ),
    "two slack samples": since(
        lambda k, cycle: with_sample(cycle, tension=one(cycle.sample.tension, 3, 2.0), torque=np.zeros(8)),
        end=START + 2,
    ),
    "a little below zero": since(
        lambda k, cycle: with_sample(cycle, tension=one(cycle.sample.tension, 3, -5.0)), end=START + 2
    ),
    "a cell off by less than is known": cell(2, lambda k, t: t + 8.0),
    "a platform that swings at 2 Hz": since(
        lambda k, cycle: with_sample(
            cycle, tension=cycle.sample.tension + one(np.zeros(8), 1, 60.0 if k % 50 < 25 else -60.0)
        )
    ),
    "49 equal samples": since(
        lambda k, cycle: with_sample(cycle, tension=one(cycle.sample.tension, 2, 141.0)), end=START + 49
    ),
    "a jump of less than a millimeter": jump(3, 0.9e-3),
    "a drum that lags by less": since(
        lambda k, cycle: with_sample(cycle, length=_added(cycle.sample.length, 7, -4e-4 * min(k, 11)))
    ),
    "a drive at its limit for less": field("state", 3, WinchState.SATURATED, end=START + 19),
    "a correction that is allowed": since(lambda k, cycle: cycle._replace(correction=np.full(8, 4.9e-3))),
    "late twice": late((0, 0.006), (50, 0.019)),
    "late three times in longer": late((0, 0.006), (50, 0.006), (100, 0.006)),
}


@pytest.mark.parametrize("name", QUIET)
def test_smaller_deviations_are_no_fault(name: str) -> None:
    assert told(QUIET[name], 145, seed=8) == []


@pytest.mark.parametrize(
    ("options", "count"),
    [
        ({"unsteady": True, "more_mass": -8.0, "delay": 5}, 1200),
        pytest.param({}, 1200, marks=extended),
        pytest.param({"unsteady": True, "more_mass": 2.0}, 1200, marks=extended),
        pytest.param({"unsteady": True, "more_mass": 2.0, "delay": 2}, 84_000, marks=pytest.mark.soak),
    ],
)
def test_a_faultless_machine_raises_no_fault(options: dict[str, Any], count: int) -> None:
    """Noise, bias, friction, lost blocks, another load, delayed commands: 20 s, or 14 minutes."""
    assert told(None, count, seed=11, **options) == []


@pytest.mark.parametrize("index", range(8))
@pytest.mark.parametrize("error", wide([-25.0, 25.0]))
def test_a_wrong_load_cell_is_named_for_any_load(index: int, error: float) -> None:
    found = told(cell(index, lambda k, t: t + error), 150, seed=index, more_mass=2.0)
    assert [each.name for each in found] == ["cell wrong"]
    told_error = re.match(rf"cell {index}\b\D*?(-?\d+) N", found[0].line)
    assert told_error is not None
    assert float(told_error[1]) == pytest.approx(error, abs=8.0)
    assert found[0].cycle - START < 50


def test_an_oscillation_is_no_wrong_load_cell() -> None:
    """Sign changes larger than the tolerance from one cycle to the next."""
    names = []
    for offset in (0.0, 60.0):
        rules, before, found = faults_of(ROBOT, cell_deviation=0.05, cell_bias=0.0), None, set()
        for k, good in enumerate(cycles(150)):
            swing = 60.0 if k % 50 < 25 else -60.0
            tension = good.tension + one(np.zeros(8), 1, offset or swing) + 1e-3 * (k % 7)  # no cell is constant
            cycle = with_sample(good, tension=tension, torque=-tension * 0.03 / 20.0)._replace(before=before)
            found |= {rule.name for rule in rules if rule.look(cycle) is not None}
            before = cycle.sample
        names.append(found)
    assert names == [set(), {"cell wrong"}]


def test_a_load_cell_lost_at_rest_does_not_stop_the_machine() -> None:
    def rests(k: int, cycle: Cycle) -> Cycle:
        assert cycle.command is None or k > 0
        still = None if cycle.command is None else cycle.command._replace(rate=np.zeros(8))
        return cycle._replace(command=still)

    lost = both(rests, cell(6, lambda k, t: np.nan))
    found = told(lost, 60)
    assert [(each.name, each.cycle) for each in found] == [(DEAD_CELL, START)]
    assert "nan" not in found[0].line


def test_two_failing_load_cells_are_reported_one_by_one_without_a_slack_cable() -> None:
    second = since(lambda k, cycle: with_sample(cycle, tension=one(cycle.sample.tension, 2, 0.0)), START + 60)
    found = told(both(cell(5, lambda k, t: 0.0), second), 145)
    assert [each.name for each in found] == [DEAD_CELL] * 2
    assert [each.line[:6] for each in found] == ["cell 5", "cell 2"]


def test_without_motor_data_a_zero_reading_is_a_slack_cable() -> None:
    bare = ROBOT.replace(winches=None)
    found = told(cell(5, lambda k, t: 0.0), 150, robot=bare)
    assert [(each.name, each.cycle) for each in found] == [("slack", START + 2)]


def test_a_broken_cable_is_slack_until_the_others_react() -> None:
    found = told(broken(4, others=1.0), 145)
    assert [each.name for each in found] == ["slack", "cable broken"]
    assert found[0].cycle == START + 2
    assert found[1].cycle <= START + 7


def test_with_a_zero_lower_limit_the_noise_of_the_cells_is_used() -> None:
    free = ROBOT.replace(tension_min=0.0)
    found = told(cell(5, lambda k, t: 11.1, torque=0.0), 150, robot=free)
    assert [each.name for each in found] == ["slack"]
    assert told(cell(5, lambda k, t: 11.4, torque=0.0), 60, robot=free) == []


def test_a_planned_slack_cable_is_no_fault() -> None:
    def hangs(k: int, cycle: Cycle) -> Cycle:
        altered = with_sample(
            cycle, tension=one(cycle.sample.tension, 4, 3.0 + 0.01 * (k % 7)), torque=one(cycle.sample.torque, 4, 0.0)
        )
        return altered._replace(tension=one(cycle.tension, 4, 4.0))

    assert told(hangs, 145) == []


def test_without_a_plan_tensions_are_not_compared() -> None:
    def homing(k: int, cycle: Cycle) -> Cycle:
        sample = with_sample(cycle, tension=np.random.default_rng(k).uniform(0.0, 300.0, 8))
        return sample._replace(tension=np.full(8, np.nan), gains=None)

    assert told(homing, 145) == []


def test_a_fault_present_at_the_start_is_reported_at_once() -> None:
    """Rules start when the connection has seen all groups agree, or after a confirmation by the operator."""
    left = field("fault", 1, GroupFault.HEARTBEAT, start=0, end=30)
    assert [(each.name, each.cycle) for each in told(left, 60)] == [(GROUP_ACTS, 0)]
    taken = told(field("owner", 2, 99, start=0), 60)
    assert [(each.name, each.cycle) for each in taken] == [("owner lost", 1)]  # a command exists from then on


def test_a_released_grant_is_no_fault() -> None:
    def leaves(k: int, cycle: Cycle) -> Cycle:
        if k < START or cycle.command is None:
            return cycle
        return with_sample(cycle, owner=np.zeros(4))._replace(command=cycle.command._replace(mode=Mode.LEAVE))

    assert told(leaves, 300) == []


def test_drums_locked_by_the_controller_are_no_fault() -> None:
    def locks(k: int, cycle: Cycle) -> Cycle:
        if k < START or cycle.command is None:
            return cycle
        still = with_sample(
            cycle, status=np.full(4, int(GroupStatus.LOCKED)), rate=np.zeros(8), length=course().length[START - 1]
        )
        return still._replace(command=cycle.command._replace(mode=Mode.LOCK))

    assert told(locks, 300) == []


def test_a_constant_load_cell_at_rest_is_no_fault() -> None:
    def rests(k: int, cycle: Cycle) -> Cycle:
        if cycle.command is None:
            return cycle
        still = with_sample(cycle, tension=course().tension[0], rate=np.zeros(8), length=course().length[0])._replace(
            tension=course().tension[0]
        )
        return still._replace(command=cycle.command._replace(rate=np.zeros(8), length=course().length[0]))

    assert told(rests, 145) == []


def test_a_delayed_set_point_is_no_following_error() -> None:
    """At 0.37 m/s and with five cycles of delay, set points are 19 mm ahead of the drums."""
    ahead = [
        np.abs(cycle.command.length - cycle.sample.length).max()
        for cycle in cycles(400, delay=5)
        if cycle.command is not None
    ]
    assert max(ahead) > 0.015
    assert told(None, 145, delay=5) == []
    assert [each.name for each in told(lags(7, 0.05), 145, delay=5)] == ["following error"]


def test_a_late_group_has_no_rejected_command() -> None:
    assert [each.name for each in told(silent(1, 8), 145, delay=5)] == ["group stale"]


def test_a_group_that_stops_and_locks_its_drums_reports_both(snapshot: Any) -> None:
    locked = int(GroupStatus.READY | GroupStatus.LOCKED | GroupStatus.BRAKED)
    found = told(both(field("status", 2, locked), field("fault", 2, GroupFault.FOLLOWING_ERROR)), 60)
    assert found[0].line == snapshot


def test_a_discarded_block_is_reported_with_reason_and_next_step() -> None:
    def bad(reasons: tuple[Refusal | None, ...]) -> str:
        def change(k: int, cycle: Cycle) -> Cycle:
            counts = one(cycle.sample.discarded, 2, max(k - START, 0))
            return with_sample(cycle, discarded=counts, reasons=reasons)

        return told(change, 60)[0].line

    line = bad((None, None, Refusal("torn", "Load"), None))
    assert line.startswith("group 2:")
    assert [word in line for word in ("1", "torn.", "Load.")] == [True] * 3
    assert "network" not in bad(())


def test_two_bursts_of_bad_blocks_are_two_events() -> None:
    def bad(k: int, cycle: Cycle) -> Cycle:
        count = min(max(k - START, 0), 10) + min(max(k - START - 150, 0), 10)
        return with_sample(cycle, discarded=one(cycle.sample.discarded, 0, count))

    found = told(bad, 350)
    assert [each.cycle for each in found] == [START + 1, START + 151]


def test_a_fault_is_present_while_its_rule_holds_and_a_lasting_one_afterwards() -> None:
    rules = {rule.name: rule for rule in faults_of(ROBOT)}
    change, before, seen = both(silent(2, 5), cell(5, lambda k, t: 0.0)), None, []
    for k, good in enumerate(cycles(200, seed=8)):
        cycle = change(k, good)._replace(before=before)
        for rule in rules.values():
            rule.look(cycle)
        seen.append((rules["group stale"].present, rules[DEAD_CELL].present))
        before = cycle.sample
    stale, dead = np.array(seen).T
    assert np.flatnonzero(stale).tolist() == [START + 2, START + 3, START + 4]
    assert np.flatnonzero(dead).tolist() == list(range(np.flatnonzero(dead)[0], 200))
    assert not next(rule for rule in faults_of(ROBOT) if rule.name == DEAD_CELL).present


def test_invalid_samples_raise_no_exception_and_no_warning() -> None:
    rng = np.random.default_rng(6)
    strange = np.array([np.nan, np.inf, -np.inf, 1e300, -1e300, 0.0])

    def alter(k: int, cycle: Cycle) -> Cycle:
        name = rng.choice(["length", "rate", "torque", "tension", "filtered"])
        values = getattr(cycle.sample, name).copy()
        values[rng.random(8) < 0.5] = rng.choice(strange)
        codes = {
            which: rng.integers(-(2**40), 2**40, getattr(cycle.sample, which).size)
            for which in ("owner", "echo", "status", "fault", "state", "winch_fault", "counter", "discarded")
            if rng.random() < 0.1
        }
        return with_sample(cycle, **{str(name): values}, **codes)

    found = told(alter, 1500)
    assert len({each.name for each in found}) >= 4
    assert all(len(each.line) < 300 and each.line.isprintable() for each in found)


OF_OTHERS = ["controller dead", "foreign block", "second controller", "set point infeasible"]


def test_the_table_has_all_faults() -> None:
    names = [row.name for row in FAULT_TABLE]
    assert len(set(names)) == len(names)
    assert [row.name for row in FAULT_TABLE if row.by == "the controller"] == [kind.name for kind in FAULTS]
    assert [row.name for row in FAULT_TABLE if row.by != "the controller"] == OF_OTHERS
    assert all(row.rule and row.to for row in FAULT_TABLE)
    for one_row, other in pairwise(row for row in FAULT_TABLE if row.by == "the controller"):
        assert one_row.rule != other.rule


def test_sets_of_rules_are_independent() -> None:
    first, second = faults_of(ROBOT), faults_of(ROBOT)
    assert first[0].seen is first[-1].seen
    assert first[0].seen is not second[0].seen
    assert first[0].seen.group_of.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    other = faults_of(ROBOT, groups=((0, 4), (1, 5), (2, 6), (3, 7)))
    assert other[0].seen.group_of.tolist() == [0, 1, 2, 3, 0, 1, 2, 3]
    assert OWNER == 4711


def test_consequences_of_a_stop_are_reported_only_for_doubtful_lengths() -> None:
    """A drive trips and its PLC reports it; later another drum slips, and its servo reaches its limit."""
    late_jump = since(lambda k, cycle: with_sample(cycle, length=_added(cycle.sample.length, 1, 0.003)), START + 20)
    later = both(late_jump, field("state", 3, WinchState.SATURATED))
    found = told(both(drive_trips, later), 145)
    assert [(each.name, each.cycle) for each in found] == [
        (GROUP_ACTS, START),
        ("encoder jump", START + 20),
    ]


def test_simultaneous_stops_of_groups_are_one_event() -> None:
    def stops(k: int, cycle: Cycle) -> Cycle:
        acting = k >= START and k % 12 < 6  # a command to hold clears it temporarily
        return with_sample(cycle, fault=np.full(4, int(GroupFault.HEARTBEAT))) if acting else cycle

    found = told(stops, 145)
    assert [each.name for each in found] == [GROUP_ACTS]
    assert re.match(r"group 0, 1, 2, 3\b.* 100 ms", found[0].line)


def test_a_sudden_stop_of_drums_is_no_jump() -> None:
    """Locked at 0.3 m/s: a length is 3 mm shorter than its rate predicts."""

    def locked(k: int, cycle: Cycle) -> Cycle:
        if k < 300:
            return cycle
        still = course().length[299]
        return with_sample(cycle, length=still, rate=np.zeros(8), state=np.full(8, int(WinchState.LOCKED)))

    moving = np.abs(course().rate[299]).max()
    assert moving > 0.2
    assert "encoder jump" not in [each.name for each in told(locked, 320)]


def test_a_jump_is_found_with_rates_from_the_same_encoder() -> None:
    """A PLC that computes the rate from its counts reports a fast drum."""

    def alter(k: int, cycle: Cycle) -> Cycle:
        if k < START:
            return cycle
        sample = cycle.sample
        rate = _added(sample.rate, 1, 0.2) if k == START else sample.rate
        return with_sample(cycle, length=_added(sample.length, 1, 0.002), rate=rate)

    assert [(each.name, each.cycle) for each in told(alter, 100)] == [("encoder jump", START)]


def test_set_points_ignored_by_a_plc_are_no_following_error() -> None:
    ramping = int(GroupStatus.READY | GroupStatus.RAMPING)
    found = told(both(lags(7, 0.05), field("status", 3, ramping)), 145)
    assert [each.name for each in found] == [NOT_FOLLOWING]


OF_TENSIONS = [
    "tight",
    "too tight",
    "slack",
    "broken",
    "cell zero",
    "cell negative",
    "cell at full scale",
    "cell stuck",
]


@pytest.mark.parametrize("name", OF_TENSIONS)
@pytest.mark.parametrize("reading", wide([np.nan, np.inf]))
def test_a_nan_reading_does_not_hide_faults_of_others(name: str, reading: float) -> None:
    case, motor = CASES[name], course().tension[START][6] * -0.0015

    def dead(k: int, cycle: Cycle) -> Cycle:
        """Failed before the motion."""
        tension, torque = one(cycle.sample.tension, 6, reading), one(cycle.sample.torque, 6, motor)
        return with_sample(cycle, tension=tension, torque=torque)

    assert [each.line[:6] for each in told(dead, 60)] == ["cell 6"]
    found = told(both(dead, lambda k, cycle: case.change(k - 10, cycle)), 155, seed=8)
    assert tuple(each.name for each in found) == (DEAD_CELL, *case.names)
    assert case.cycles[0] <= found[-1].cycle - START - 10 <= case.cycles[1]


def test_a_nan_reading_does_not_hide_a_high_tension_without_a_plan() -> None:
    def homing(k: int, cycle: Cycle) -> Cycle:
        tension = one(one(cycle.sample.tension, 6, np.nan), 3, 2100.0 if k >= START else 150.0 + k)
        altered = with_sample(cycle, tension=tension, torque=one(cycle.sample.torque, 3, -3.0))
        return altered._replace(tension=np.full(8, np.nan), gains=None)

    found = told(homing, 60)
    assert [(each.name, each.cycle) for each in found] == [(DEAD_CELL, 0), ("over-tension", START)]


def test_untrusted_cells_are_replaced_by_planned_tensions() -> None:
    rules, change = faults_of(ROBOT), cell(6, lambda k, t: np.nan)
    for k, good in enumerate(cycles(START + 5)):
        cycle = change(k, good)
        for rule in rules:
            rule.look(cycle)
    seen = rules[0].seen
    assert seen.tension[6] == cycle.tension[6]
    assert np.delete(seen.tension == cycle.sample.tension, 6).all()
    assert seen.compared


def stops_at(standing: int, reads_only: bool) -> Change:
    """Set points or drums that stop at a cycle."""

    def alter(k: int, cycle: Cycle) -> Cycle:
        if k < standing or cycle.command is None:
            return cycle._replace(command=None) if reads_only else cycle
        length = course().length[standing - 1]
        still = with_sample(cycle, length=length, rate=np.zeros(8))
        hold = cycle.command._replace(mode=Mode.HOLD, rate=np.zeros(8), length=length)
        return still._replace(command=None if reads_only else hold)

    return alter


@pytest.mark.parametrize("reads_only", [False, True])
def test_faults_at_the_end_of_a_stop_are_reported(reads_only: bool) -> None:
    """The ramp ends 20 cycles after a drive trips, and the motion counts as stopped 21 cycles later."""
    silent_group = silent(1, 10**6, START + 5)
    tight = since(
        lambda k, cycle: with_sample(cycle, tension=one(cycle.sample.tension, 3, 2100.0 + k)), START + 80, START + 85
    )
    motor = since(lambda k, cycle: with_sample(cycle, torque=one(cycle.sample.torque, 3, -3.0)), START + 80)
    stands = stops_at(START + 20, reads_only)
    found = told(both(both(both(stands, drive_trips), silent_group), both(tight, motor)), 145)
    assert [(each.name, each.cycle) for each in found] == [
        (GROUP_ACTS, START),
        ("group stale", START + 7),
        ("group silent", START + 40),
        ("over-tension", START + 80),
    ]


def test_a_repeatedly_late_group_is_reported_once_per_second_with_a_count() -> None:
    def late_often(k: int, cycle: Cycle) -> Cycle:
        late_now = k >= START and (k - START) % 10 < 4
        return with_sample(cycle, age=one(cycle.sample.age, 2, 0.034 if late_now else 0.004))

    found = told(late_often, START + 250)
    assert [(each.name, each.cycle - START) for each in found] == [("group stale", at) for at in (0, 110, 220)]
    assert [re.findall(r"(\d+) times", each.line) for each in found] == [[], ["10"], ["10"]]


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("groups", ((0, 1), (2, 3)), "((0, 1), (2, 3))"),
        ("groups", 4, "4"),
        ("groups", ((0, 1, 2, 3, 4, 5, 6, None),), None),
        ("period", 0.0, "0 s"),
        ("cell_deviation", 0.0, "0 N"),
        ("cell_bias", -1.0, "-1 N"),
        ("largest_correction", np.nan, "nan m"),
    ],
)
def test_invalid_arguments_of_rules_are_refused(name: str, value: Any, text: str | None) -> None:
    with refused(name, text, kind=sl.InvalidValueError) as caught:
        faults_of(ROBOT, **{name: value})
    assert name != "groups" or "0 to 7" in caught.value.allowed
    with refused("robot", "None", kind=sl.InvalidValueError):
        faults_of(None)  # type: ignore[arg-type]


def test_precision_of_cells_is_that_of_the_robot_by_default() -> None:
    noisy = sl.load_robot("article-prototype")
    assert noisy.winches is not None
    noisy = noisy.replace(winches=noisy.winches.replace(load_cell_deviation=3.0, load_cell_bias=-4.0))
    assert faults_of(noisy)[0].seen.sigma == pytest.approx(5.0)
    assert faults_of(ROBOT)[0].seen.sigma == pytest.approx(np.hypot(1.0, 2.0))
    assert faults_of(noisy, cell_deviation=0.6, cell_bias=0.8)[0].seen.sigma == pytest.approx(1.0)


def test_an_emergency_stop_reported_as_a_fault_is_one_event() -> None:
    found = told(field("fault", 2, GroupFault.EMERGENCY_STOP), 100)
    assert [each.name for each in found] == ["emergency stop"]
    assert re.search(r"\bgroup 2\.", found[0].line)


def test_a_step_of_the_rate_is_no_jump() -> None:
    def steps(k: int, cycle: Cycle) -> Cycle:
        if k < START or cycle.command is None:
            return cycle
        command, away = cycle.command, 0.002 * (k - START + 1)
        altered = with_sample(
            cycle, length=_added(cycle.sample.length, 3, away), rate=_added(cycle.sample.rate, 3, 0.2)
        )
        asked = command._replace(length=_added(command.length, 3, away), rate=_added(command.rate, 3, 0.2))
        return altered._replace(command=asked)

    assert told(steps, 100) == []


def test_a_disabled_drive_has_no_following_error() -> None:
    def disabled(k: int, cycle: Cycle) -> Cycle:
        if cycle.command is None:
            return cycle
        return cycle._replace(command=cycle.command._replace(enable=np.arange(8) != 7))

    assert told(both(lags(7, 0.05), disabled), 145) == []


def test_the_load_estimate_is_kept_while_a_cable_is_slack() -> None:
    rules, before, learned = faults_of(ROBOT), None, []
    change = broken(4, others=2.0)
    for k, good in enumerate(cycles(START + 30, seed=8)):
        cycle = change(k, good)._replace(before=before)
        for rule in rules:
            rule.look(cycle)
        learned.append(rules[0].seen.steady.copy())
        before = cycle.sample
    assert (learned[START - 1] == learned[-1]).all()
    assert (learned[START - 1] != learned[START - 2]).all()


def test_a_motor_torque_within_friction_does_not_prove_a_taut_cable() -> None:
    """26 N planned, no reading, 20 N held, of which 15 N can be friction."""

    def doubtful(k: int, cycle: Cycle) -> Cycle:
        if k < START:
            return cycle
        sample = cycle.sample
        tension = one(sample.tension, 4, 0.01 * (k % 7))
        altered = with_sample(cycle, tension=tension, torque=one(sample.torque, 4, -20.0 * 0.03 / 20.0))
        return altered._replace(tension=one(cycle.tension, 4, 26.0))

    assert [each.name for each in told(doubtful, 60)] == ["slack"]


def test_a_repeated_slack_sample_counts_once() -> None:
    once = since(
        lambda k, cycle: with_sample(cycle, tension=one(cycle.sample.tension, 3, 2.0), torque=np.zeros(8)),
        end=START + 1,
    )
    found = told(both(once, silent(1, 6, START + 1)), 100)
    assert [each.name for each in found] == ["group stale"]

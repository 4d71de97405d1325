"""Artificial samples of the prototype on the lockstep clock: a faultless machine in motion, and modified samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np

import sagline as sl
from sagline.control.evidence import Cycle
from sagline.control.faults import faults_of
from sagline.control.link import PERIOD, Command, GroupStatus, Mode, Sample, WinchState
from sagline.control.null_space import Gains, gains_along
from sagline.core.arrays import Array, Flags
from tests.control.stops import HOME, TEN_POSES
from tests.dynamics.machines import prototype

ROBOT = prototype(load_cell_gain=1.0, load_cell_bias=0.0)
OWNER = 4711
DURATION = 8.0  # s, home -> P2, and back for longer runs
FRICTION = 15.0
KEPT = 150  # cycles computed once for all tests
RADIUS, GEAR = 0.03, 20.0

Change = Callable[[int, Cycle], Cycle]


class Course(NamedTuple):
    """Motion of the prototype, and readings of its load cells for a load that differs from the plan."""

    length: Array
    rate: Array
    tension: Array
    read: Array
    gains: Gains


@cache
def course(more_mass: float = 0.0) -> Course:
    """Home -> P2 and back, 100 samples per second."""
    places = [HOME, TEN_POSES[1], HOME]
    plan = sl.inverse(ROBOT, sl.quintic_path(places, durations=DURATION))
    tension = read = plan.state.cables.frame_end_tension
    if more_mass:
        heavy = ROBOT.replace(mass=ROBOT.mass + more_mass)
        wrench = plan.state.wrench * np.array([heavy.mass / ROBOT.mass] * 3 + [1.0] * 3)
        found = sl.forward(heavy, plan.unstrained_length, plan.state.pose, wrench=wrench)
        assert found.stable.all()
        read = found.state.cables.frame_end_tension
    gains = gains_along(plan)
    assert gains is not None
    return Course(plan.unstrained_length, np.gradient(plan.unstrained_length, PERIOD, axis=0), tension, read, gains)


def cycles(
    count: int, seed: int = 0, more_mass: float = 0.0, unsteady: bool = False, delay: int = 0
) -> Iterator[Cycle]:
    """A faultless machine: cells with 1 N of noise and up to 2 N of bias, friction, and a delay of one cycle.

    Args:
        count: How many cycles.
        seed: Of the noise.
        more_mass: Of the load, which the plan does not know [kg].
        unsteady: Whether blocks are lost, two cycles in a row at most, and cycles begin up to 4 ms late.
        delay: For how many cycles more than one a command is on its way.
    """
    way, rng = course(more_mass), np.random.default_rng(seed)
    bias = rng.uniform(-2.0, 2.0, 8)
    commands: list[Command] = []
    before: Sample | None = None
    age = np.zeros(4)
    for k in range(count):
        at = k % len(way.length)
        sample = _sample(way, k, max(0, k - delay), bias, rng)
        if unsteady and before is not None:
            lost = (rng.random(4) < 0.1) & (age < 2 * PERIOD)
            age = np.where(lost, age + PERIOD, 0.0)
            sample = _without(sample, before, lost, age)
        late = float(rng.uniform(0.0, 0.004)) if unsteady else 0.0
        command = commands[-1] if commands else None
        row = way.gains.at(at * PERIOD)
        yield Cycle(sample, before, command, way.tension[at], row, np.zeros(8), late)
        before = sample
        following = (k + 1) % len(way.length)
        pace = way.rate[following]
        commands.append(_command(k + 1, way.length[following], pace, way.tension[following]))


def _command(counter: int, length: Array, rate: Array, tension: Array) -> Command:
    return Command(counter, OWNER, Mode.FOLLOW, 0.1, length, rate, tension, np.ones(8, dtype=bool))


def _sample(way: Course, k: int, taken: int, bias: Array, rng: np.random.Generator) -> Sample:
    """Sample of a faultless machine in cycle k after a number of accepted commands."""
    at = taken % len(way.length)
    true = way.read[at]
    rubs = FRICTION * rng.uniform(-1.0, 1.0, 8)
    tension = true + bias + rng.normal(0.0, 1.0, 8)
    encoder = way.length[at] + rng.normal(0.0, 1e-5, 8)
    return Sample(
        time=k * PERIOD,
        age=np.full(4, 0.004),
        counter=np.full(4, k + 1),
        plc_time=np.full(4, 100.0 + k * PERIOD),
        owner=np.full(4, OWNER),
        echo=np.full(4, taken),
        status=np.full(4, int(GroupStatus.READY | GroupStatus.FOLLOWING)),
        fault=np.zeros(4, dtype=np.int64),
        length=encoder,
        rate=way.rate[at] + rng.normal(0.0, 1e-3, 8),
        torque=-(true + rubs) * RADIUS / GEAR,
        tension=tension,
        filtered=tension,
        counts=np.zeros(8, dtype=np.int64),
        state=np.full(8, int(WinchState.ENABLED)),
        winch_fault=np.zeros(8, dtype=np.int64),
        discarded=np.zeros(4, dtype=np.int64),
    )


def _without(sample: Sample, before: Sample, lost: Flags, age: Array) -> Sample:
    """The blocks of some groups are repeated from the previous cycle."""
    both = np.repeat(lost, 2)
    old = {
        name: np.where(both if value.size == 8 else lost, getattr(before, name), value)
        for name, value in sample._asdict().items()
        if name not in ("time", "age", "reasons")
    }
    return Sample(sample.time, age + 0.004, **old)


def with_sample(cycle: Cycle, **fields: Any) -> Cycle:
    """The same cycle with other fields in its sample."""
    return cycle._replace(sample=cycle.sample._replace(**fields))


def one(array: Any, index: int, value: float) -> Any:
    """A copy with one value changed."""
    copy = array.copy()
    copy[index] = value
    return copy


class Told(NamedTuple):
    """The beginning of a fault."""

    cycle: int
    name: str
    line: str


@cache
def _first_cycles(**options: Any) -> tuple[Cycle, ...]:
    """Read-only cycles of a faultless machine for the beginning of several tests."""
    found = tuple(cycles(KEPT, **options))
    for cycle in found:
        for value in (*cycle.sample, *(cycle.command or ()), cycle.tension, cycle.correction):
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
    return found


def told(change: Change | None, count: int = 300, robot: sl.Robot = ROBOT, **options: Any) -> list[Told]:
    """Faults that a new set of rules reports for a run."""
    rules = faults_of(robot)
    found, before = [], None
    for k, good in enumerate(cycles(count, **options) if count > KEPT else _first_cycles(**options)[:count]):
        cycle = good if change is None else change(k, good)
        cycle = cycle._replace(before=before)
        for rule in rules:
            line = rule.look(cycle)
            if line is not None:
                found.append(Told(k, rule.name, line))
        before = cycle.sample
    return found

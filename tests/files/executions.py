"""Artificial executions: a robot follows a plan, with all quantities that a log contains."""

from collections.abc import Iterator
from functools import cache

import numpy as np

import sagline as sl
from sagline import Plan
from sagline.control import Command, Event, EventKind, Missing, Mode, Recorded, Sample, State
from sagline.control.execution import Execution, ExecutionStatus, execution_of
from sagline.control.link import PERIOD, groups_of
from sagline.control.recording import CycleTable


@cache
def plan_of(seconds: float = 2.0) -> Plan:
    robot = sl.load_robot("article-prototype")
    path = sl.quintic_path([(0.0, 0.0, 1.5), (0.2, -0.3, 1.6)], durations=seconds)
    return sl.inverse(robot, path)


def cycles_of(plan: Plan, count: int | None = None, seed: int = 0) -> Iterator[Recorded]:
    """Cycles of a machine with noise; every 50th has no solution, and the last one has no command."""
    assert plan.path is not None
    rng, m = np.random.default_rng(seed), plan.state.one_robot.cable_count
    groups = len(groups_of(m))
    length, tension = plan.unstrained_length, plan.chord_tension
    rate = np.gradient(length, plan.path.time, axis=0)
    zero, filtered = np.linspace(-1e-3, 1e-3, m), tension[0].copy()
    for k in range(len(length) if count is None else count):
        row = k % len(length)
        time, bias = 1000.0 + PERIOD * k, 1e-4 * np.sin(np.arange(m) + k // 40)
        reading = tension[row] + rng.normal(size=m)
        filtered = filtered + 0.1 * (reading - filtered)
        counts = np.rint((length[row] + 1e-6 * rng.normal(size=m)) / 72e-9).astype(np.int64)
        whole = np.arange(groups) + 10 * k
        sample = Sample(
            time, 1e-3 * rng.random(groups), whole, time + 1e-4 * rng.random(groups), 0 * whole + 7, whole - 1,
            0 * whole + 5, 0 * whole, 72e-9 * counts - zero, rate[row] + 1e-5 * rng.normal(size=m),
            1e-3 * reading + 0.01 * np.sign(rate[row]), reading, filtered, counts, 0 * counts + 1, 0 * counts,
            0 * whole,
        )  # fmt: skip
        enable = np.ones(m, dtype=np.bool_)
        asked = Command(k + 1, 7, Mode.FOLLOW, 0.1, length[row] + bias - zero, rate[row], tension[row], enable)
        missing = k % 50 == 49
        yield Recorded(
            k, State.MOVING, k % 100 > 90, 1e-4 * rng.random(), PERIOD * row, None if row == len(length) - 1 else asked,
            Missing(time, (1,), ("silent",)) if missing else sample,
            np.full(3, np.nan) if missing else plan.state.pose.position[row] + 1e-6 * rng.normal(size=3),
            np.full(4, np.nan) if missing else np.array([0.0, 0.0, 0.0, 1.0]),
            -1 if missing else 0, zero, tension[row], bias,
        )  # fmt: skip


def events_of(time: float = 1000.0) -> tuple[Event, ...]:
    return (
        Event(time, 0, EventKind.STATE, "MOVING", State.MOVING, "a plan of 2 s begins"),
        Event(
            time + 0.5, 50, EventKind.FAULT, "cell stuck", State.MOVING, "cell 3: 120.5 N for 50 samples: mend it – ±"
        ),
    )


@cache
def execution(seconds: float = 2.0) -> Execution:
    plan = plan_of(seconds)
    cycles = list(cycles_of(plan))
    robot = plan.state.one_robot
    table = CycleTable(robot.cable_count, len(groups_of(robot.cable_count)), len(cycles))
    for cycle in cycles:
        table.add(cycle)
    return execution_of(
        table, robot, plan, ExecutionStatus.DONE, "the end of the plan", PERIOD, cycles[0].zero, events_of()
    )

"""Recordings contain all numbers of all cycles for any initial capacity."""

import numpy as np
import pytest

import sagline as sl
from sagline.control.execution import ExecutionStatus, execution_of
from sagline.control.link import Command, Missing, Mode, Sample
from sagline.control.recording import CycleTable, Recorded
from sagline.control.states import State

M, G = 3, 2


def made(k: int) -> Recorded:
    """A cycle with all numbers different."""
    numbers = iter(range(1000 * k, 1000 * k + 999))

    def some(n: int, whole: bool = False) -> np.ndarray:
        values = [next(numbers) for _ in range(n)]
        return np.array(values, dtype=np.int64 if whole else np.float64)

    w = True
    sample = Sample(
        0.01 * k, some(G), some(G, w), some(G), some(G, w), some(G, w), some(G, w), some(G, w), some(M), some(M),
        some(M), some(M), some(M), some(M, w), some(M, w), some(M, w), some(G, w),
    )  # fmt: skip
    command = Command(k, 7, Mode.FOLLOW, 0.1, some(M), some(M), some(M), np.ones(M, dtype=np.bool_))
    return Recorded(
        k, State.MOVING, False, 0.5 * k, 0.01 * k, None if k == 1 else command,
        Missing(0.01 * k, (1,), ("silent",)) if k == 2 else sample,
        some(3), some(4), 0, np.full(M, 0.25), some(M), some(M),
    )  # fmt: skip


@pytest.mark.parametrize("expected", [1, 3, 9])
def test_a_recording_contains_all_added_cycles(expected: int) -> None:
    table, cycles = CycleTable(M, G, expected), [made(k) for k in range(8)]
    for cycle in cycles:
        table.add(cycle)
    assert len(table) == 8
    robot = sl.load_robot("cogiro")
    done = execution_of(table, robot, None, ExecutionStatus.DONE, "", 0.01, np.full(M, 0.25), ())
    assert len(done) == 8
    assert done.answered.tolist() == [True, True, False, *5 * [True]]
    assert done.mode.tolist() == [2, -1, *6 * [2]]
    assert np.array_equal(done.time, [cycle.answer.time for cycle in cycles])
    assert np.array_equal(done.late, 0.5 * np.arange(8))
    for k, cycle in enumerate(cycles):
        for name in ("position", "quaternion", "planned_tension", "correction"):
            assert np.array_equal(getattr(done, name)[k], getattr(cycle, name))
        if cycle.command is not None:
            assert np.array_equal(done.set_length[k], cycle.command.length + 0.25)
            assert np.array_equal(done.set_rate[k], cycle.command.rate)
            assert np.array_equal(done.set_tension[k], cycle.command.tension)
        if isinstance(cycle.answer, Sample):
            for name in Sample._fields[:-1]:  # a recording has no reasons
                kept, given = (np.asarray(getattr(sample, name)) for sample in (done.samples.at(k), cycle.answer))
                assert np.array_equal(kept, given), name
                assert kept.dtype == given.dtype, name
            assert np.array_equal(done.length[k], cycle.answer.length + 0.25)
    assert np.isnan(done.samples.length[2]).all()
    assert np.isnan(done.set_length[1]).all()


def test_returned_data_do_not_change_later() -> None:
    table, cycles = CycleTable(M, G, 2), [made(k) for k in range(4)]
    for cycle in cycles[:2]:
        table.add(cycle)
    column, before = table.rows["sample"]["rate"], table.rows["sample"]["rate"].copy()
    for cycle in cycles[2:]:
        table.add(cycle)
    assert np.array_equal(column, before)
    assert len(table.rows) == 4

import re
import resource
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from sagline.core import arguments
from sagline.core.arguments import check_memory, free_memory
from tests.refusal import refused
from tests.tiers import wide


def test_free_memory_of_the_machine() -> None:
    total = next(
        1024.0 * float(line.split()[1]) for line in Path("/proc/meminfo").read_text().splitlines() if "MemTotal" in line
    )
    assert 1e6 < free_memory() <= total


def test_the_limit_of_the_process_is_considered(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = float(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    monkeypatch.setattr(resource, "getrlimit", lambda _: (int(taken + 5e6), resource.RLIM_INFINITY))
    assert 0.0 <= free_memory() <= 6e6


def test_an_array_that_does_not_fit_is_refused_with_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arguments, "free_memory", lambda: 3e9)
    check_memory("a path", 2.9e9, "Check the units.")
    with refused("the memory for a path", "6 GB", next_step="Check the units.", kind=sl.InvalidValueError) as caught:
        check_memory("a path", 6e9, "Check the units.")
    assert caught.value.allowed.startswith("<= 3 GB")


@pytest.mark.parametrize(("size", "free"), [(24.01e9, 24e9), (24e9 + 1024, 24e9), (5.1e12, 5.0e12), (1e8, 0.0)])
def test_requested_and_free_memory_are_printed_with_different_digits(
    monkeypatch: pytest.MonkeyPatch, size: float, free: float
) -> None:
    monkeypatch.setattr(arguments, "free_memory", lambda: free)
    with refused("the memory for position", kind=sl.InvalidValueError) as caught:
        check_memory("position", size, "Give fewer poses.")
    wanted, left = (float(number) for number in re.findall(r"(\S+) GB", str(caught.value)))
    assert wanted > left
    assert wanted == pytest.approx(size / 1e9, rel=1e-2)


def test_paths_and_batches_check_the_memory_first(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = sl.load_robot("cogiro")
    poses = sl.Pose.from_euler(np.tile([1.0, 1.0, 2.0], (200_000, 1)), 0.0, 0.0, 0.0)
    lengths = np.full((200_000, 8), 10.0)
    monkeypatch.setattr(arguments, "free_memory", lambda: 110e6)
    tracemalloc.start()
    for call in (
        lambda: sl.quintic_path([(0, 0, 0), (1, 0, 0)], durations=1e4),
        lambda: sl.septic_path([(0, 0, 0), (1, 0, 0)], durations=9e5),
        lambda: sl.quintic_path([(0, 0, 0), (1, 0, 0)], durations=1e12),
        lambda: sl.inverse(robot, poses),
        lambda: sl.forward(robot, lengths, start=poses[0]),
    ):
        with pytest.raises(sl.InvalidValueError) as caught:
            call()
        assert re.search("(samples|poses)$", caught.value.item)
    assert tracemalloc.get_traced_memory()[1] < 60e6
    tracemalloc.stop()


@pytest.mark.parametrize("winches", wide([None, sl.Winch(0.05, dead_cable=4.0)]))
@pytest.mark.parametrize("cable_count", wide([8, 7]))
def test_a_pose_needs_at_most_the_estimated_memory(cable_count: int, winches: sl.Winch | None) -> None:
    robot = sl.load_robot("falcon-7" if cable_count == 7 else "cogiro").replace(winches=winches)
    assert robot.test_box is not None
    place = np.random.default_rng(5).uniform(robot.test_box.low, robot.test_box.high, (20_000, 3))
    poses = sl.Pose.from_euler(place, 0.0, 0.0, 0.0)
    plan = sl.inverse(robot, poses)
    start = poses[plan.feasible]
    sl.forward(
        robot, plan.unstrained_length[plan.feasible][:2], start=start[:2]
    )  # loading the library needs memory as well
    for call in (
        lambda: sl.inverse(robot, poses),
        lambda: sl.forward(robot, plan.unstrained_length[plan.feasible], start=start),
    ):
        tracemalloc.start()
        found = call()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 20_000 * (400 + (64 if winches is None else 136) * cable_count)
        del found

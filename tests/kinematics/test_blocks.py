"""Long computations in blocks: the same results, interrupts between blocks, and progress."""

import signal
import sys
import time
from collections.abc import Callable
from types import FrameType

import numpy as np
import pytest

import sagline as sl
from sagline.kinematics import forward_rows
from sagline.kinematics import inverse_rows as inverting
from tests.effort import slowness
from tests.tiers import extended

ROBOT = sl.load_robot("article-suspended")
PATH = sl.article_path(rate=2.0)
LENGTHS = sl.inverse(ROBOT, PATH).unstrained_length


def with_block_size(samples: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forward_rows, "BLOCK", samples * ROBOT.cable_count)


@pytest.mark.parametrize("samples", [1, 7])
def test_a_trajectory_in_blocks_is_the_same_trajectory(samples: int, monkeypatch: pytest.MonkeyPatch) -> None:
    lengths = LENGTHS.copy()
    lengths[6:9] = np.nan  # the next block starts at the previous solution
    whole = sl.forward(ROBOT, lengths, start=PATH.pose[0])
    with_block_size(samples, monkeypatch)
    found = sl.forward(ROBOT, lengths, start=PATH.pose[0])
    np.testing.assert_array_equal(found.pose.position, whole.pose.position)
    np.testing.assert_array_equal(found.pose.quaternion, whole.pose.quaternion)
    np.testing.assert_array_equal(found.iterations, whole.iterations)
    np.testing.assert_array_equal(found.status, whole.status)
    assert list(np.flatnonzero(found.status == sl.ForwardStatus.NO_LENGTHS)) == [6, 7, 8]


def test_a_block_starts_at_the_last_sample_that_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    found = forward_rows.ForwardRows.empty(ROBOT, 4)
    found.poses[:] = np.arange(4.0)[:, None]
    before = np.full((1, 7), -1.0)
    lost, absent, good = sl.ForwardStatus.NOT_CONVERGED, sl.ForwardStatus.NO_LENGTHS, sl.ForwardStatus.UNSTABLE
    for status, expected in (
        ([good] * 4, 3.0),
        ([good, good, lost, absent], 1.0),
        ([lost, absent, lost, absent], -1.0),
    ):
        found.pose_status[:] = status
        row = found.last_pose(before)
        assert row.shape == (1, 7)
        assert np.all(row == expected)
        assert row is before or not row.flags.writeable  # kernels are compiled for read-only inputs


@pytest.mark.parametrize("model", [sl.Catenary(), sl.Empirical(), sl.Straight()])
def test_independent_samples_agree_to_rounding(model: sl.CableModel, monkeypatch: pytest.MonkeyPatch) -> None:
    wrench = np.random.default_rng(0).normal(size=(len(PATH), 6))

    def solved() -> list[sl.ForwardSolution]:
        return [
            sl.forward(ROBOT, LENGTHS, start=PATH.pose, model=model, wrench=wrench),
            sl.forward(ROBOT, LENGTHS[:20], model=model, wrench=wrench[:20]),
        ]

    whole = solved()
    with_block_size(7, monkeypatch)
    for one, other in zip(whole, solved(), strict=True):
        np.testing.assert_allclose(one.pose.position, other.pose.position, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(one.pose.quaternion, other.pose.quaternion, rtol=0.0, atol=1e-13)
        np.testing.assert_array_equal(one.status, other.status)


def test_progress_counts_up_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    with_block_size(7, monkeypatch)
    monkeypatch.setattr(inverting, "BLOCK", 10)
    monkeypatch.setattr(sys.modules[sl.confirm.__module__], "BLOCK", 20)
    position = np.random.default_rng(1).uniform((-12.0, -9.0, 0.5), (12.0, 9.0, 5.0), (43, 3))
    poses = sl.Pose(position, np.stack([np.eye(3)] * 43))
    plan = sl.inverse(ROBOT, poses)
    assert 5 < np.count_nonzero(plan.status == sl.PoseStatus.INFEASIBLE) < 38

    def reported_progress(work: Callable[[Callable[[int, int], None]], object]) -> list[int]:
        heard: list[tuple[int, int]] = []
        work(lambda done, total: heard.append((done, total)))
        counts = [done for done, _ in heard]
        assert {total for _, total in heard} == {43}
        assert counts == sorted(counts)
        assert counts[-1] == 43
        return counts

    assert len(reported_progress(lambda tell: sl.inverse(ROBOT, poses, progress=tell))) > 5
    assert reported_progress(lambda tell: sl.confirm(plan, progress=tell)) == [7, 14, 20, 27, 34, 40, 43]
    lengths = np.where(plan.feasible[:, None], plan.unstrained_length, np.nan)
    for where in (None, poses[0], poses):
        counts = reported_progress(lambda tell, where=where: sl.forward(ROBOT, lengths, start=where, progress=tell))  # type: ignore[misc]
        assert counts == [7, 14, 21, 28, 35, 42, 43]


@extended
@pytest.mark.skipif(sys.platform == "win32", reason="no timer of processor time")
@pytest.mark.parametrize("work", ["feasible", "infeasible", "slow sharing", "tracking", "from each pose", "search"])
def test_an_interrupt_is_handled_within_a_fifth_of_a_second(work: str) -> None:
    rng = np.random.default_rng(2)
    count = {"feasible": 300_000, "infeasible": 30_000, "slow sharing": 100_000, "search": 20_000}.get(work, 300_000)
    low, high = ((-5.0, -3.5, 1.0), (5.0, 3.5, 4.0)) if work != "infeasible" else ((20.0, 20.0, 1.0), (40.0, 40.0, 4.0))
    poses = sl.Pose(rng.uniform(low, high, (count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)))
    some = poses[:count]
    method = sl.PNorm() if work == "slow sharing" else sl.Closest()
    lengths = np.empty(0)
    if work in ("tracking", "from each pose", "search"):
        lengths = sl.inverse(ROBOT, some, tension=method).unstrained_length
    if work == "tracking":
        lengths, some = np.repeat(lengths[:1], count, axis=0), poses[0]
    calls: dict[str, Callable[[], object]] = {
        "tracking": lambda: sl.forward(ROBOT, lengths, start=some),
        "from each pose": lambda: sl.forward(ROBOT, lengths, start=some),
        "search": lambda: sl.forward(ROBOT, lengths),
    }
    call = calls.get(work, lambda: sl.inverse(ROBOT, some, tension=method))
    longest = longest_wait(call)
    if longest > 0.2:  # unless the machine is slow or garbage is collected
        longest = longest_wait(call) / slowness()
    assert longest < 0.2


def longest_wait(call: Callable[[], object]) -> float:
    """Longest processor time without handling of signals [s]."""
    moments: list[float] = []

    def hear(number: int, frame: FrameType | None) -> None:
        moments.append(time.process_time())

    before = signal.signal(signal.SIGPROF, hear)
    signal.setitimer(signal.ITIMER_PROF, 0.005, 0.005)  # processor time excludes other programs
    try:
        call()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    assert moments[-1] - moments[0] > 0.2  # the work was long
    return float(np.diff(moments).max())

"""Sweeps on all cores: workers compared with a loop, and 31 million requests of a planar robot with four cables."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, show
from sagline.sweep.folder import make_folder
from sagline.sweep.work import measured_size, task

ROBOT = Path(__file__).parents[1] / "examples" / "own_planar.yaml"
PUBLISHED = 5844.0  # time of the same number of requests on eight workers [s]; 57,952 of them were lost
POSES, LOADS = 31_000, 1_000
SHARE = 10  # number of tasks for the comparison of a loop with workers


def asked(poses: int, loads: int) -> sl.sweep.Request:
    """Level poses in the plane, except on the edges of its area, with forces up to 100 N and moments up to 3 N m."""
    rng = np.random.default_rng(31)
    place = rng.uniform((0.6, 0.0, 0.5), (3.4, 0.0, 2.5), (poses, 3))
    wrenches = rng.uniform(-1.0, 1.0, (loads, 6)) * [100.0, 0.0, 100.0, 0.0, 3.0, 0.0]
    return sl.sweep.Request(sl.load_robot(ROBOT), sl.Pose(place, np.eye(3)), wrenches)


def in_a_loop_and_on_workers() -> Iterator[Row]:
    """Time of the same tasks one after the other, and on two workers."""
    request = asked(POSES // SHARE, LOADS)
    size, times = measured_size(request), []
    with tempfile.TemporaryDirectory() as place:
        for workers in (1, 2):
            folder = Path(place) / f"{workers}"
            make_folder(folder, request, size)
            start = time.perf_counter()
            found = sl.sweep.run(request, folder, workers=workers)
            times.append(time.perf_counter() - start)
    each = found.seconds / found.tasks
    yield Row(
        f"sweep of {len(request):,} requests, {found.tasks} tasks of {each:.2f} s, two workers and their start",
        ">= 1.8 x a plain loop, without the start",
        f"{times[0] / times[1]:.2f} x with it ({times[0]:.1f} s, {times[1]:.1f} s)",
    )


def without_the_start() -> Iterator[Row]:
    """Tasks per second of one worker and of two workers, without their start, as in a long sweep."""
    from sagline.sweep.running import local_workers, run_tasks

    request = asked(POSES // 4, LOADS)  # about twenty tasks; the first and the last would dominate fewer tasks
    size, rates = measured_size(request), []
    with tempfile.TemporaryDirectory() as place:
        make_folder(alone := Path(place) / "alone", request, size)
        digest = _digest(alone)
        count = min(16, sl.sweep.load(alone).tasks)
        task(str(alone), digest, 0)
        start = time.perf_counter()
        for number in range(1, count):
            task(str(alone), digest, number)
        rates.append((count - 1) / (time.perf_counter() - start))
        make_folder(together := Path(place) / "together", request, size)
        done: list[float] = []
        with local_workers(2, lambda text: None) as client:
            job = (str(together), _digest(together))
            run_tasks(client, job, range(count), lambda *_: done.append(time.perf_counter()), lambda text: None)
        # between the fourth task and the second to last: both workers are busy
        rates.append((len(done) - 6) / (done[-2] - done[4]))
    text = f"{rates[1] / rates[0]:.2f} x ({rates[0]:.2f} tasks a second, {rates[1]:.2f})"
    yield Row("speed of two busy workers, relative to a plain loop", ">= 1.8 x", text)


def tension_requests() -> Iterator[Row]:
    """31 million tension requests; each failure is proved."""
    request, spent = asked(POSES, LOADS), dict[int, float]()

    def look(done: int, total: int) -> None:
        for child in psutil.Process().children(recursive=True):
            with suppress(psutil.Error):
                spent[child.pid] = sum(child.cpu_times()[:2])

    with tempfile.TemporaryDirectory() as place:
        start = time.perf_counter()
        found = sl.sweep.run(request, Path(place) / "sweep", workers=2, progress=look)
        seconds = time.perf_counter() - start
        gigabytes = sum(file.stat().st_size for file in Path(place).rglob("*") if file.is_file()) / 1e9
    counts = found.counts
    yield Row(
        f"{len(request):,} tension requests of a planar robot of four cables, two workers",
        "<= 90 s, 0 lost",
        f"{seconds:.0f} s, {sum(spent.values()):.0f} s of processor by the workers ({PUBLISHED / seconds:.0f} x the "
        f"published run); {counts.feasible:,} feasible, "
        f"{counts.infeasible:,} proved infeasible, {counts.open + counts.unable} open, {counts.lost} lost; "
        f"{gigabytes:.1f} GB",
    )


def _digest(folder: Path) -> str:
    from sagline.sweep.folder import SweepFolder

    return SweepFolder(folder).digest


PARTS = (in_a_loop_and_on_workers, without_the_start, tension_requests)


def sweeps() -> Iterator[Row]:
    """Measure and print, before `one_core`."""
    if len(os.sched_getaffinity(0)) > 1:
        for part in PARTS:
            yield from part()


if __name__ == "__main__":
    show("Sweeps", list(sweeps()), Console())

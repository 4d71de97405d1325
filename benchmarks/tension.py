"""Sharing the load: verdicts and their proofs, times of every method, and how continuous each is; one core."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial

import numba
import numpy as np
from rich.console import Console
from rich.progress import track

import sagline as sl
from benchmarks.measure import Row, best_seconds, one_core, show
from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.sharing.polygon import SPARE_CORNERS
from sagline.kernels.sharing.sharing import share_load
from tests.tension.reference import presets, random_poses
from tests.tension.test_verdicts import sampled, unproved

POSES = 2000
VERDICTS = 1_000_000
REQUESTS = 10_000_000
METHODS: dict[str, sl.TensionMethod] = {
    "MinimumNorm": sl.MinimumNorm(),
    "Closest": sl.Closest(),
    "QuadraticProgram": sl.QuadraticProgram(target=200.0),
    "LowestSum": sl.LowestSum(),
    "LowestMaximum": sl.LowestMaximum(),
    "PNorm(p=4)": sl.PNorm(p=4.0),
    "PNorm(p=16)": sl.PNorm(p=16.0),
    "Centroid": sl.Centroid(),
    "AnalyticCenter": sl.AnalyticCenter(),
    "ClosedForm": sl.ClosedForm(),
    "ImprovedClosedForm": sl.ImprovedClosedForm(),
    "Puncture": sl.Puncture(),
    "PolygonWalk": sl.PolygonWalk(),
}
LINES = ("article-mixed", "article-suspended", "cogiro", "ipanema-1")
JUMPING = ("LowestSum", "LowestMaximum", "ImprovedClosedForm", "Puncture")
SLOW = ("PNorm(p=4)", "PNorm(p=16)", "AnalyticCenter", "LowestMaximum")


@numba.njit
def share_batch(method, parameter, works, nulls, references, corners, labels, statuses):  # type: ignore[no-untyped-def]
    """The sharing alone, of many poses that are already factored."""
    for p in range(works.shape[0]):
        statuses[p] = share_load(method, parameter, works[p], nulls[p], references[p], corners, labels)


def factored(robot: sl.Robot, poses: sl.Pose) -> tuple[Array, Array]:
    """Working rows and null spaces of poses with weightless cables."""
    m = robot.cable_count
    works = np.zeros((len(poses), tables.WORK_ROWS, m))
    nulls = np.empty((len(poses), m - 6, m))
    right = np.array([0, 0, robot.mass * robot.gravity, 0, 0, 0])
    for p, matrix in enumerate(sl.structure_matrix(robot, poses)):
        works[p, tables.START] = np.linalg.pinv(matrix) @ right
        nulls[p] = np.linalg.svd(matrix)[2][6:]
        works[p, tables.LOW], works[p, tables.HIGH] = robot.tension_min, robot.tension_max
    return works, nulls


def times() -> Iterator[Row]:
    """Time of each method: the sharing alone, and a whole inverse with straight and with exact cables."""
    robot = sl.load_robot("article-mixed")
    poses = random_poses(robot, POSES, np.random.default_rng(0))
    works, nulls = factored(robot, poses)
    references = np.zeros((POSES, 2))
    corners, labels = np.empty((2 * 8 + SPARE_CORNERS, 2)), np.empty(2 * 8 + SPARE_CORNERS, dtype=np.int64)
    statuses = np.empty(POSES, dtype=np.int64)
    for name, method in METHODS.items():
        goal = references + 200.0 if name == "QuadraticProgram" else references
        given = (method.code, method.parameter, works, nulls, goal, corners, labels, statuses)
        alone = best_seconds(partial(share_batch, *given), 60)
        straight = best_seconds(partial(sl.inverse, robot, poses, sl.Straight(), method), 30)
        exact = best_seconds(partial(sl.inverse, robot, poses, sl.Catenary(), method), 30)
        to_us = 1e6 / POSES
        yield Row(
            f"{name}, 8 cables",
            f"<= {8 if name in SLOW[:3] else 1.5} us a pose; sag <= 4 us more",
            f"{alone * to_us:.2f} us; whole inverse, straight cables {straight * to_us:.1f} us, "
            f"exact {exact * to_us:.1f} us, sag {(exact - straight) * to_us:+.1f} us",
        )


def verdicts() -> Iterator[Row]:
    """Random poses of all presets in and around their test boxes, under wrenches: each verdict proved."""
    rng, robots = np.random.default_rng(1), list(presets())
    chunk = 5000
    rounds = -(-VERDICTS // (chunk * len(robots)))
    lost = feasible = count = 0
    for _ in track(range(rounds), description="verdicts", console=Console(stderr=True)):
        for robot in robots:
            sample = sampled(robot, chunk, rng, sl.Elastic())
            count += chunk
            feasible += int(sample.plan.feasible.sum())
            lost += len(unproved(sample))
    yield Row(
        f"verdicts on {count:,} poses of all presets, {feasible / count:.0%} feasible",
        "all proved",
        f"{count - lost:,} proved by their own point or Farkas vector; {lost} not",
    )


def continuity() -> Iterator[Row]:
    """Largest slope of a tension on lines through four robots' boxes; with smaller steps it grows where one jumps."""
    for name, method in METHODS.items():
        figures = [max(_steepest(robot, method, count) for robot in LINES) for count in (2001, 20001)]
        yield Row(
            f"{name}: largest slope of a tension, and at steps ten times smaller",
            "the same" if name not in JUMPING else "",
            f"{figures[0]:.3g}, {figures[1]:.3g} upper limits a meter",
        )


def _steepest(name: str, method: sl.TensionMethod, count: int) -> float:
    """Along a line through the test box, off its middle, without inertia; in upper limits a meter."""
    robot = sl.load_robot(name)
    box = robot.test_box
    assert box is not None
    share = np.linspace(0.0, 1.0, count)[:, None]
    position = box.low + (box.high - box.low) * (share * [0.9, 0.8, 0.3] + (1 - share) * [0.05, 0.3, 0.6])
    pose = sl.Pose(position, np.broadcast_to(np.eye(3), (count, 3, 3)))
    path = sl.path_from_samples(np.arange(count) * 1e4, pose)
    tension = sl.inverse(robot, path, model=sl.Elastic(), tension=method).chord_tension
    step = float(np.linalg.norm(position[1] - position[0]))
    return float(np.nanmax(np.abs(np.diff(tension, axis=0)))) / step / float(robot.tension_max.max())


REQUESTS_CODE = """
import sys, numpy as np, sagline as sl
from tests.tension.reference import planar
robot, rng = planar(), np.random.default_rng(int(sys.argv[1]))
count, left, lost, explained = 100_000, int(sys.argv[2]), 0, 0
methods = (sl.MinimumNorm(), sl.Centroid(), sl.LowestSum(), sl.AnalyticCenter())
rotation = np.broadcast_to(np.eye(3), (count, 3, 3))
for k in range(left // count):
    position = np.zeros((count, 3)); position[:, :2] = rng.uniform(-0.25, 0.25, (count, 2))
    load = np.zeros((count, 6)); load[:, :2] = rng.normal(size=(count, 2)) * 5
    plan = sl.inverse(robot, sl.Pose(position, rotation), sl.Straight(), methods[k % 4], load)
    bad = ~plan.feasible
    lost += int(bad.sum())
    explained += int((np.isfinite(plan.shortfall[bad]) & ~np.isnan(plan.farkas[bad]).any(axis=1)).sum())
print(lost, explained)
"""


def requests() -> Iterator[Row]:
    """Ten million requests of a planar four-cable robot, two processes."""
    start = time.perf_counter()
    here = {**os.environ, "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)}
    share = str(REQUESTS // 2)
    jobs = [
        subprocess.Popen(
            [sys.executable, "-c", REQUESTS_CODE, seed, share], stdout=subprocess.PIPE, text=True, env=here
        )
        for seed in "12"
    ]
    answers = [[int(word) for word in job.communicate()[0].split()] for job in jobs]
    lost, explained = (sum(column) for column in zip(*answers, strict=True))
    yield Row(
        "10^7 requests of a planar four-cable robot, four methods in turn, two processes",
        "<= 60 s, every failure explained",
        f"{time.perf_counter() - start:.0f} s; {lost:,} infeasible, {explained:,} of them proved",
    )


def main() -> None:
    """Measure and print."""
    console = Console()
    rows: list[Row] = []
    rows.extend(requests())  # on all processors, before this process keeps to one
    one_core()
    for part in (times, verdicts, continuity):
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show("Sharing the load", rows, console)


if __name__ == "__main__":
    main()

"""Tension distribution: verdicts with proofs, times and continuity of every method; one core."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial

import numpy as np
from rich.console import Console
from rich.progress import track

os.environ["SAGLINE_BACKEND"] = "numba"  # compiles the loop over poses below

import sagline as sl
from benchmarks.measure import Row, best_seconds, one_core, show
from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS
from sagline.kernels.jit import entry
from sagline.kernels.memory import Memory, block, memory_for
from sagline.kernels.tension.nearest import Distribution, new_reference_point, share_nearest
from sagline.kernels.tension.other_methods import distribute_by_other_method
from sagline.kernels.tension.polygon import new_work_arrays, reset_work_arrays
from sagline.tension.method import kernel_options, takes_default_kernel
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
ALONE = {"PNorm(p=4)": 8, "PNorm(p=16)": 8, "AnalyticCenter": 8, "LowestMaximum": 2.5}  # microseconds per pose
SAG = {"PNorm(p=4)": 5, "PNorm(p=16)": 5, "AnalyticCenter": 5}  # additional microseconds


@entry
def share_batch(  # type: ignore[no-untyped-def]
    sharing_terms, strips, nulls, references, room, previous, otherwise, statuses
):
    """Tension distribution of many factored poses, without the other steps of `inverse_poses`."""
    sharing = Distribution(*sharing_terms)
    r, m = nulls[0].shape
    near, rest = new_reference_point(Memory(*room), previous, r)
    rows, rest = block(rest, 2, m)
    tension, offset = rows[0], rows[1]
    others = None if otherwise is None else new_work_arrays(sharing.method, rest, m, r)
    for i in range(m):
        offset[i] = 0.0
    for p in range(strips.shape[0]):
        near.held.labels[0] = 0
        for k in range(r):
            near.reference[k] = references[p, k]
        if others is None:
            statuses[p] = share_nearest(strips[p], nulls[p], near, tension)
        else:
            reset_work_arrays(others)
            statuses[p] = distribute_by_other_method(sharing, strips[p], offset, nulls[p], near, others, tension)


def factored(robot: sl.Robot, poses: sl.Pose) -> tuple[Array, Array]:
    """Bounds and null spaces of poses with weightless cables."""
    m = robot.cable_count
    limits = np.zeros((len(poses), STRIP_ROWS, m))
    nulls = np.empty((len(poses), m - 6, m))
    right = np.array([0, 0, robot.mass * robot.gravity, 0, 0, 0])
    for p, matrix in enumerate(sl.structure_matrix(robot, poses)):
        limits[p, START] = np.linalg.pinv(matrix) @ right
        nulls[p] = np.linalg.svd(matrix)[2][6:]
        limits[p, LOW], limits[p, HIGH] = robot.tension_min, robot.tension_max
    return limits, nulls


def times() -> Iterator[Row]:
    """Time of each method: the tension distribution alone, and a whole inverse with straight and with exact cables."""
    robot = sl.load_robot("article-mixed")
    poses = random_poses(robot, POSES, np.random.default_rng(0))
    limits, nulls = factored(robot, poses)
    references = np.zeros((POSES, 2))
    statuses = np.empty(POSES, dtype=np.int64)
    for name, method in METHODS.items():
        goal = references + 200.0 if name == "QuadraticProgram" else references
        sharing = kernel_options(robot, sl.Catenary(), method).sharing
        otherwise = None if takes_default_kernel(method) else True
        previous = np.full(robot.cable_count, np.nan)
        given = (sharing, limits, nulls, goal, memory_for(robot.cable_count), previous, otherwise, statuses)
        alone = best_seconds(partial(share_batch, *given), 60)
        straight = best_seconds(partial(sl.inverse, robot, poses, sl.Straight(), method), 30)
        exact = best_seconds(partial(sl.inverse, robot, poses, sl.Catenary(), method), 30)
        to_us = 1e6 / POSES
        yield Row(
            f"{name}, 8 cables",
            f"<= {ALONE.get(name, 1.5):g} us per pose; sag <= {SAG.get(name, 2):g} us more",
            f"{alone * to_us:.2f} us; whole inverse, straight cables {straight * to_us:.1f} us, "
            f"exact {exact * to_us:.1f} us, sag {(exact - straight) * to_us:+.1f} us",
        )


def verdicts() -> Iterator[Row]:
    """Random poses of all presets in and around their test boxes, under wrenches; each verdict is proved."""
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
    """Largest slope of a tension on lines through four robots' boxes; it grows with smaller steps if tensions jump."""
    for name, method in METHODS.items():
        figures = [max(_steepest(robot, method, count) for robot in LINES) for count in (2001, 20001)]
        yield Row(
            f"{name}: largest slope of a tension, and at steps ten times smaller",
            "the same" if method.continuous else "",
            f"{figures[0]:.3g}, {figures[1]:.3g} upper limits per meter",
        )


def _steepest(name: str, method: sl.TensionMethod, count: int) -> float:
    """Largest slope of a tension along a line through the test box, near its middle [upper limits per meter]."""
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
    rows.extend(requests())  # on all processors, before `one_core`
    one_core()
    for part in (times, verdicts, continuity):
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show("Tension distribution", rows, console)


if __name__ == "__main__":
    main()

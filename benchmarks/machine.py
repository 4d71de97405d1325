"""The machine between encoder and cable: pulleys, dead length and drums; one core."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import sagline as sl
from benchmarks.measure import Row, best_seconds, print_table
from sagline.robot.drum import Drums
from tests.kernels.cable.test_pulley import lengths_and_recovered_tensions
from tests.kinematics.test_pulleys import formula_error
from tests.kinematics.winches import wound
from tests.tension.reference import random_poses

COUNTS = 1_000_000
POSES = 5_000
TURNS = 12
ROBOTS = ("article-suspended", "article-mixed", "cogiro", "ipanema-1")


def counts() -> Iterator[Row]:
    """Conversion of counts to lengths and back, over four layers with a moving exit point."""
    robot = wound()
    drums = Drums(robot)
    turns = np.random.default_rng(6).uniform(0.0, drums.most[0], (COUNTS // 8, 8))
    given = np.rint(drums.counts(drums.lengths(turns)))
    length = sl.lengths_from_counts(robot, given)
    path = length * (1.0 + drums.rest_strain)
    off = np.abs(np.rint(drums.counts(path)) - given).max()
    there = best_seconds(lambda: sl.lengths_from_counts(robot, given)) * 1e9 / COUNTS
    back = best_seconds(lambda: drums.counts(path)) * 1e9 / COUNTS
    yield Row(
        "a million counts to lengths to counts, four layers",
        "to one count; <= 100 ns each",
        f"{off:.0f} counts off at most; {there:.0f} ns there, {back:.0f} ns back",
    )


def hard_cables() -> Iterator[Row]:
    """Random cables over pulleys, with dead length: lengths from tensions, and tensions from these lengths."""
    tension, found, expected, _statuses = lengths_and_recovered_tensions(38_000, seed=3)
    worst = (np.abs(found - tension) / expected).max()
    yield Row("38,000 random cables, tension to length and back, relative to one rounding", "4", f"{worst:.1f} at most")


def speed() -> Iterator[Row]:
    """Time of robots with pulleys and dead length, divided by the time of the same robots without them."""
    for name in ROBOTS:
        bare = sl.load_robot(name)
        over = bare.replace(winches=sl.Winch(0.05, dead_cable=4.0))
        poses = random_poses(bare, POSES, np.random.default_rng(0))
        poses = poses[sl.inverse(bare, poses).feasible & sl.inverse(over, poses).feasible]
        ratio, seconds = ratio_of(partial(sl.inverse, motion=poses), over, bare)
        shown = f"{ratio:.2f} ({1e6 * seconds / len(poses):.2f} us)"
        yield Row(f"{name}: exact inverse, relative to the robot without pulleys", "<= 1.3", shown)
        path = course(bare)
        plans = {id(one): sl.inverse(one, path) for one in (bare, over)}

        def track(one: sl.Robot, plans: dict[int, sl.Plan] = plans) -> sl.ForwardSolution:
            plan = plans[id(one)]
            return sl.forward(one, plan.unstrained_length, start=plan.state.pose[0], wrench=plan.state.wrench)

        ratio, seconds = ratio_of(track, over, bare)
        shown = f"{ratio:.2f} ({1e6 * seconds / len(path):.2f} us)"
        yield Row(f"{name}: forward along a path, relative to the robot without pulleys", "<= 2", shown)


def ratio_of(run: Callable[[sl.Robot], object], one: sl.Robot, other: sl.Robot) -> tuple[float, float]:
    """Ratio of two shortest times, measured alternately, and the first time [s]."""
    times: list[list[float]] = [[], []]
    for _ in range(TURNS):
        for kept, robot in zip(times, (one, other), strict=True):
            kept.append(best_seconds(lambda robot=robot: run(robot)))  # type: ignore[misc]
    return min(times[0]) / min(times[1]), min(times[0])


def course(robot: sl.Robot) -> sl.Path:
    """Path through the middle of the test box, at 500 samples per second."""
    assert robot.test_box is not None
    low, high = robot.test_box.low, robot.test_box.high
    return sl.quintic_path([0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high], durations=5.0, rate=500)


def formula() -> Iterator[Row]:
    """Error of catenaries that start at the exit points of straight cables, compared with exact cables over pulleys."""
    for dead in (0.0, 4.0):
        worst = 0.0
        for name in ROBOTS:
            robot = sl.load_robot(name).replace(winches=sl.Winch(0.05, dead_cable=dead))
            worst = max(worst, formula_error(robot, random_poses(robot, 500, np.random.default_rng(1))))
        what = f"{dead:g} m of dead length" if dead else "no dead length"
        yield Row(f"exit point of a straight cable, {what}", "none", f"{1e6 * worst:.1f} um off at most")


PARTS = (counts, hard_cables, speed, formula)

if __name__ == "__main__":
    print_table("The machine between encoder and cable", PARTS)

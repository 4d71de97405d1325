"""Workspaces: hulls, volumes and their error bars; one core."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial

import numpy as np

import sagline as sl
from benchmarks.measure import Row, best_of_calls, best_seconds, print_table
from sagline.statics.tables import cable_table, pose_rows
from sagline.workspaces.boundary import boundary
from sagline.workspaces.margin import MarginRows
from sagline.workspaces.wrench_sets import NO_LOAD
from tests.workspaces.levels import ipanema, level_of
from tests.workspaces.rays import ray_hull

CENTER = (0.0, 0.0, 1.0)
MODELS = (sl.Straight(), sl.Catenary())
FRAME = (-7.5, -5.5, 0.0), (7.5, 5.5, 6.0)
POSES = 4_000
SETTINGS = ((24, 0.5), (64, 2.0))  # number of cells, and longest time [s]


def hulls() -> Iterator[Row]:
    """4,098 rays of ipanema-1 with 1 to 10 N and without gravity; WireX computes 9.734 m3 in 0.13 s."""
    robot, low, high = ipanema()
    for model, reach in zip(MODELS, (0.13, 0.2), strict=True):
        level = level_of(robot, model)
        hull = ray_hull(level, CENTER, low, high)
        seconds = best_seconds(lambda level=level: ray_hull(level, CENTER, low, high))  # type: ignore[misc]
        yield Row(
            f"hull of ipanema-1 by 4,098 rays, {type(model).__name__}",
            f"9.7452 m3, <= {reach} s",
            f"{hull.volume:.4f} m3, {seconds:.3f} s",
        )


def volumes() -> Iterator[Row]:
    """The true volume of this hull."""
    robot, low, high = ipanema()
    level = level_of(robot, sl.Straight())
    for cells, reach in SETTINGS:
        found = boundary(level, low, high, cells=cells)
        seconds = best_seconds(lambda cells=cells: boundary(level, low, high, cells=cells), 3)  # type: ignore[misc]
        worst = np.abs(level(found.surface.vertices)).max()
        yield Row(
            f"its true volume, {cells} cells halved",
            f"9.774 +- 0.002 m3, <= {reach:g} s",
            f"{found.volume:.4f} +- {found.volume_error:.4f} m3, {seconds:.2f} s, {found.evaluations:,} margins; "
            f"{worst:.0e} N at vertices",
        )


def frames() -> Iterator[Row]:
    """The article's suspended robot in its frame, with and without sag."""
    robot = sl.load_robot("article-suspended")
    for model, reach in zip(MODELS, ("782.7", "789.4"), strict=True):
        level = level_of(robot, model)
        found = boundary(level, *FRAME, cells=32)
        seconds = best_seconds(lambda level=level: boundary(level, *FRAME, cells=32), 3)  # type: ignore[misc]
        yield Row(
            f"article-suspended in its frame, {type(model).__name__}",
            f"{reach} +- 1 m3",
            f"{found.volume:.2f} +- {found.volume_error:.2f} m3, {seconds:.2f} s",
        )


def proofs() -> Iterator[Row]:
    """Proofs of boxes of poses: processor time per cell, and difference from the true volume of the hull."""
    robot, low, high = ipanema()
    box = sl.PoseBox(low, high)
    sl.prove(robot, sl.PoseBox(CENTER, CENTER))  # compilation
    for edge, reach in ((0.06, "7.16 to 14.25 m3 in a study"), (0.03, "within 10 % in 60 s, <= 15 us a cell")):
        start = time.process_time()
        proof = sl.prove(robot, box, model=sl.Straight(), budget=60.0, smallest=edge)
        seconds = time.process_time() - start
        least, most = proof.inside_volume, proof.volume - proof.outside_volume
        yield Row(
            f"ipanema-1 proved, cells of {100 * edge:.0f} cm",
            reach,
            f"{least:.2f} to {most:.2f} m3, {seconds:.1f} s, {1e6 * seconds / proof.tried:.1f} us a cell",
        )
    suspended = sl.load_robot("article-suspended")
    for wrenches, words in ((None, "its weight"), (sl.WrenchBox(force=50.0, moment=5.0), "+-50 N, +-5 N m")):
        start = time.process_time()
        proof = sl.prove(suspended, sl.PoseBox(*FRAME), wrenches, smallest=0.15, budget=60.0)
        seconds = time.process_time() - start
        yield Row(
            f"article-suspended proved, {words}, exact sag, cells of 19 cm",
            "<= 15 us a cell",
            f"{proof.inside_volume:.0f} to {proof.volume - proof.outside_volume:.0f} m3, {seconds:.1f} s, "
            f"{1e6 * seconds / proof.tried:.1f} us a cell",
        )


def margins() -> Iterator[Row]:
    """The signed margin with its bracket over poses of the test boxes, and the capacity margin in the same run."""
    for name in ("ipanema-1", "article-suspended", "cogiro"):
        robot = sl.load_robot(name)
        assert robot.test_box is not None
        rng = np.random.default_rng(1)
        position = rng.uniform(robot.test_box.low, robot.test_box.high, (POSES, 3))
        poses = sl.Pose.from_euler(position, *rng.uniform(-0.1, 0.1, (3, POSES)))
        rows = pose_rows(poses)
        each = []
        for model in MODELS:
            for wrenches in (NO_LOAD, sl.WrenchBox(1.0, 0.1)):
                prepared = MarginRows(robot, wrenches, model)
                each.append(best_seconds(partial(prepared.rows, rows)) * 1e6 / POSES)
        straight, _, sagging, box = each
        state = sl.inverse(robot, poses).state
        known = best_seconds(partial(sl.capacity_margin, state)) * 1e6 / int(np.isfinite(state.pull).all(axis=-1).sum())
        yield Row(
            f"signed margin with bracket, 8 cables, {name}",
            "<= 4 us per pose",
            f"{sagging:.2f} us ({sagging / known:.2f} of the capacity margin); of a wrench box {box:.2f}; "
            f"straight {straight:.2f}",
        )


def many_cables() -> Iterator[Row]:
    """Margins of suspended robots with 8 to 16 cables, and the inverse in the same run."""
    for cables, reach in ((8, "none"), (10, "none"), (12, "none"), (16, "<= 40 us per pose")):
        rng = np.random.default_rng(cables)
        robot = sl.Robot(
            "suspended",
            rng.uniform((-6.0, -4.0, 4.0), (6.0, 4.0, 6.0), (cables, 3)),
            rng.uniform(-0.5, 0.5, (cables, 3)),
            sl.Cable(0.1, 1e6),
            100.0,
            np.eye(3) * 10.0,
            tension_min=10.0,
            tension_max=2000.0,
        )
        poses = sl.Pose.from_euler(
            rng.uniform((-3.0, -2.0, 0.0), (3.0, 2.0, 2.0), (40, 3)), *rng.uniform(-0.1, 0.1, (3, 40))
        )
        prepared, rows = MarginRows(robot), pose_rows(poses)
        own = best_seconds(partial(prepared.rows, rows), 200) * 1e6 / 40
        known = best_seconds(partial(sl.inverse, robot, poses, tension=sl.MinimumNorm()), 20) * 1e6 / 40
        yield Row(
            f"signed margin, suspended, {cables} cables", reach, f"{own:.1f} us ({own / known:.2f} of the inverse)"
        )


def calls() -> Iterator[Row]:
    """One pose per call, and many robots in one call."""
    robot = sl.load_robot("article-suspended")
    assert robot.test_box is not None
    prepared = MarginRows(robot, sl.WrenchBox(50.0, 5.0))
    rng = np.random.default_rng(2)
    poses = sl.Pose(rng.uniform(robot.test_box.low, robot.test_box.high, (315, 3)), np.eye(3))
    one = pose_rows(poses[0])
    own = best_of_calls(lambda: prepared.rows(one)) * 1e6
    yield Row("margin of one pose per call, prepared", "<= 20 us beside the margin itself", f"{own:.1f} us in all")
    table = np.repeat(cable_table(robot), 600, axis=0)
    table[:, :, :3] += rng.uniform(-0.5, 0.5, (600, 8, 3))
    tiled = np.tile(pose_rows(poses), (600, 1))

    def run() -> None:
        MarginRows(robot, sl.WrenchBox(50.0, 5.0), cables=table).rows(tiled)

    yield Row("600 robots at 315 poses, in one call", "no object a robot", f"{best_seconds(run, 3):.2f} s")


PARTS = (margins, many_cables, calls, hulls, volumes, frames, proofs)

if __name__ == "__main__":
    print_table("Workspace", PARTS)

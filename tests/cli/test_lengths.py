"""Lengths in output files are the lengths that winches control: all cable off the drum."""

import csv
from io import StringIO
from pathlib import Path

import numpy as np

import sagline as sl
from sagline.cli.lengths import _write_rows
from sagline.cli.track import ConfirmedRun
from sagline.core.results import csv_text

ROBOT = sl.load_robot("article-suspended").replace(winches=sl.Winch(pulley_radius=0.1, dead_cable=4.0))
ENDS = sl.Pose(np.array([[0.0, 0.0, 1.5], [1.0, 0.5, 2.0]]), np.stack([np.eye(3)] * 2))


def test_written_lengths_of_a_robot_with_pulleys_include_all_cable_off_the_drum() -> None:
    plan = sl.inverse(ROBOT, ENDS)
    rows = list(csv.DictReader(StringIO(csv_text(plan.table().rows))))
    written = np.array([[float(row[f"L{k} [m]"]) for k in range(8)] for row in rows])
    np.testing.assert_allclose(sl.forward(ROBOT, written, start=ENDS).pose.position, ENDS.position, atol=1e-9)
    tension = np.array([[float(row[f"T{k} [N]"]) for k in range(8)] for row in rows])
    force = sl.structure_matrix(ROBOT, ENDS)[:, :3] @ tension[..., None]
    np.testing.assert_allclose(force[:, :2, 0], 0.0, atol=1e-9 * tension.max())  # straight cables at equal heights


def test_the_summary_counts_all_cable_off_the_drum() -> None:
    plan = sl.inverse(ROBOT, ENDS)
    told = ConfirmedRun(sl.confirm(plan), 0.0).summary()
    straight = np.linalg.norm(ENDS.position[:, None] + ROBOT.platform_anchors - ROBOT.frame_anchors, axis=-1)
    assert straight.min() + 4.0 < told["unstrained_length_min_m"] < straight.min() + 4.0 + 0.2 * np.pi
    assert told["unstrained_length_max_m"] == plan.unstrained_length.max()


def test_feasible_samples_are_written_with_their_own_times(tmp_path: Path) -> None:
    file = tmp_path / "lengths.csv"
    path = sl.quintic_path([(7.4, 5.4, 0.1), (0.0, 0.0, 1.5)], durations=1.0, rate=4.0)
    plan = sl.inverse(sl.load_robot("article-suspended"), path)
    assert plan.feasible.tolist()[::4] == [False, True]
    assert _write_rows(plan, "L{}", plan.unstrained_length.tolist(), file) == 1
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(rows[:, 0], path.time[plan.feasible])
    np.testing.assert_array_equal(rows[:, 1:], plan.unstrained_length[plan.feasible])

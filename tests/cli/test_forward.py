"""`sagline forward`: poses from a file of lengths."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app

ROBOT = "article-suspended"


@pytest.fixture(scope="module")
def plan() -> sl.Plan:
    path = sl.quintic_path([(0.0, 0.0, 1.5), (2.0, 1.0, 2.5)], durations=4.0, rate=5.0)
    return sl.inverse(sl.load_robot(ROBOT), path.pose)


def write_lengths(file: Path, plan: sl.Plan, scale: float = 1.0, unit: str = "") -> None:
    header = ["time [s]", *(f"L{k}{unit}" for k in range(8))]
    with file.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        for k, row in enumerate(plan.unstrained_length):
            writer.writerow([0.2 * k, *(repr(float(scale * length)) for length in row)])


def test_planned_lengths_give_the_planned_poses(tmp_path: Path, plan: sl.Plan) -> None:
    write_lengths(tmp_path / "lengths.csv", plan)
    done = CliRunner().invoke(app, ["forward", ROBOT, str(tmp_path / "lengths.csv"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    with (tmp_path / "out" / f"{ROBOT}-poses.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    found = np.array([[float(row[f"{axis} [m]"]) for axis in "xyz"] for row in rows])
    np.testing.assert_allclose(found, plan.state.pose.position, atol=1e-9)
    assert [float(row["time [s]"]) for row in rows] == pytest.approx([0.2 * k for k in range(len(rows))])
    assert {row["status"] for row in rows} == {"SOLVED"}


def test_json_has_the_same_poses_and_units_are_read(tmp_path: Path, plan: sl.Plan) -> None:
    write_lengths(tmp_path / "lengths.csv", plan, 1e3, " [mm]")
    arguments = ["forward", ROBOT, str(tmp_path / "lengths.csv"), "--out", str(tmp_path / "out"), "--json"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    poses = json.loads(done.stdout)["poses"]
    last = poses[-1]
    np.testing.assert_allclose([last[axis] for axis in "xyz"], (2.0, 1.0, 2.5), atol=1e-9)
    assert {type(value) for name, value in last.items() if name not in ("status", "iterations")} == {float}
    assert (type(last["iterations"]), last["status"]) == (int, "SOLVED")
    with (tmp_path / "out" / f"{ROBOT}-poses.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    for pose, row in zip(poses, rows, strict=True):  # equal to the last bit
        assert [float(row[f"{axis} [m]"]) for axis in "xyz"] == [pose[axis] for axis in "xyz"]


def test_lengths_that_are_too_short_are_reported_and_end_with_1(tmp_path: Path, plan: sl.Plan) -> None:
    write_lengths(tmp_path / "lengths.csv", plan, 0.7)
    done = CliRunner().invoke(app, ["forward", ROBOT, str(tmp_path / "lengths.csv"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert f"{len(plan.unstrained_length)} of {len(plan.unstrained_length)} samples" in done.output
    with (tmp_path / "out" / f"{ROBOT}-poses.csv").open(newline="") as stream:
        assert {row["status"] for row in csv.DictReader(stream)} == {"OVERSTRETCHED"}

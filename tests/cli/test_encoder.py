"""`sagline encoder` and `sagline forward --counts`: counts of a run, and poses of counts."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.files.table import load_readings
from tests.kinematics.winches import wound
from tests.refusal import refused
from tests.tiers import extended, wide

PATH = sl.quintic_path([(0.0, 0.0, 1.5), (1.5, 0.5, 2.0)], durations=2.0, rate=8.0)


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, words)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of a robot with winches."""
    file = tmp_path_factory.mktemp("run") / "run.nc"
    sl.inverse(wound(length_zero=11.0), PATH).save(file)
    return file


@pytest.fixture(autouse=True)
def folder(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A new folder for each test with the robot and the run."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    Path("my_robot.yaml").write_text(sl.dump_robot(wound(length_zero=11.0)))
    shutil.copy(run, "run.nc")


def rows_of(text: str) -> tuple[list[str], np.ndarray]:
    header, *rows = csv.reader(text.splitlines())
    return header, np.array([[float(cell) for cell in row] for row in rows])


@pytest.mark.parametrize("winding", wide(["remembered", "constant"]))
def test_counts_of_a_run_agree_with_the_library(winding: Any) -> None:
    result = sagline("encoder", "run.nc", "--winding", winding)
    assert (result.exit_code, result.stderr) == (0, "")
    plan = sl.load_plan("run.nc")
    assert plan.path is not None
    header, rows = rows_of(result.stdout)
    assert header == ["time [s]", *(f"C{k}" for k in range(8))]
    np.testing.assert_array_equal(rows[:, 0], plan.path.time)
    np.testing.assert_array_equal(rows[:, 1:], sl.encoder_counts(plan, winding))
    assert "." not in result.stdout.splitlines()[5].partition(",")[2]  # whole numbers are written as such


@extended
def test_forward_of_counts_gives_the_planned_poses() -> None:
    poses = sl.inverse(wound(length_zero=11.0), PATH.pose)  # at rest: forward does not include inertia
    poses.save("rest.nc")
    assert sagline("encoder", "rest.nc", "--out", "counts.csv").exit_code == 0
    assert sagline("encoder", "rest.nc").stdout == Path("counts.csv").read_text()
    result = sagline("forward", "my_robot.yaml", "counts.csv", "--counts", "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)["poses"]
    np.testing.assert_allclose(
        [[pose[axis] for axis in "xyz"] for pose in found], PATH.pose.position, atol=2e-5
    )  # one count is 8 micrometers of cable


@extended
def test_samples_without_a_solution_are_omitted_and_counted() -> None:
    path = sl.quintic_path([(0.0, 0.0, 1.5), (9.0, 0.5, 2.0)], durations=2.0, rate=8.0)
    sl.inverse(wound(length_zero=11.0), path).save("far.nc")
    plan = sl.load_plan("far.nc")
    result = sagline("encoder", "far.nc")
    assert result.exit_code == 1
    lost = int(np.sum(~plan.feasible))
    assert f" {lost} of 17 " in result.stderr
    np.testing.assert_array_equal(rows_of(result.stdout)[1][:, 1:], sl.encoder_counts(plan)[plan.feasible])


@extended
def test_exceeded_limits_of_winches_are_printed() -> None:
    robot = wound(length_zero=11.0, speed_limit=150.0, torque_limit=1.7, inertia=1e-4)
    sl.inverse(robot, PATH).save("fast.nc")
    result = sagline("encoder", "fast.nc", "--out", "counts.csv")
    rates = sl.winch_rates(sl.inverse(robot, PATH))
    assert result.exit_code == 1
    for limit, beyond in (("speed_limit", rates.too_fast), ("torque_limit", rates.too_strong)):
        assert beyond is not None
        samples, cables = beyond.any(axis=1), [str(k) for k in range(8) if beyond[:, k].any()]
        assert 0 < samples.sum() < 17
        first = PATH.time[np.argmax(samples)]
        (told,) = [line for line in result.stderr.splitlines() if limit in line]
        assert f" {samples.sum()} of 17 " in told
        assert f" {first:g} s," in told
        assert f" {', '.join(cables)};" in told
    assert Path("counts.csv").exists()
    enough = robot.winches.replace(speed_limit=1e3, torque_limit=1e3)  # type: ignore[union-attr]
    sl.inverse(robot.replace(winches=enough), PATH).save("slow.nc")
    assert sagline("encoder", "slow.nc").exit_code == 0


@pytest.mark.parametrize(
    ("text", "line", "named", "allowed"),
    [
        ("C0,C1\n1,2\n", 1, "column count_2", ""),
        ("C0,C1,C2\n", 1, "no rows", "at least one"),
        ("C0 [mm],C1,C2\n1,2,3\n", 1, "count_0 is [mm]", "none"),
        ("C0,C1,C2\n1,x,3\n", 2, "count_1 is x", "a number"),
        ("time,C0,C1,C2\n1,1,2,3\n1,1,2,3\n", 3, "time is 1 s", "a time after the time of the previous row"),
    ],
)
def test_errors_in_a_file_of_counts_are_named_with_their_line(text: str, line: int, named: str, allowed: str) -> None:
    Path("counts.csv").write_text(text)
    with refused(f"line {line}", allowed=allowed, kind=sl.FileError, file="counts.csv") as caught:
        load_readings("counts.csv", "count", 3)
    assert named in caught.value.value


def test_counts_may_be_negative() -> None:
    Path("counts.csv").write_text("time [ms],C0,C1\n0,-5,7\n10,0,1e3\n")
    time, counts = load_readings("counts.csv", "count", 2)
    assert time is not None
    assert time.tolist() == [0.0, 0.01]
    assert counts.tolist() == [[-5.0, 7.0], [0.0, 1000.0]]

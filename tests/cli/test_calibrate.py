import json
import re
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner, Result

import sagline as sl
from sagline.calibration import planning
from sagline.calibration.summary import calibration_text
from sagline.cli import terminal
from sagline.cli.main import app
from sagline.core.numbers import SPACE
from tests.abuse.command_lines import commands
from tests.calibration.made_up import made_up
from tests.calibration.synthetic import log_of, true_robot, usual_sensors, with_drums
from tests.tiers import extended, wide

FEW = ["--unknowns", "length_zero,mass"]
Run = Callable[..., Result]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("calibrate")
    robot = with_drums()
    truth = true_robot(robot, {"length_zero": 0.03, "mass": 0.03}, 1, usual_sensors())
    (place / "robot.yaml").write_text(sl.dump_robot(robot))
    log_of(truth, 20, 1).log.save(place / "winches.csv")
    text = (place / "winches.csv").read_text()
    (place / "silent.csv").write_text("".join(line for line in text.splitlines(True) if not line.startswith("#")))
    return place


@pytest.fixture
def run(files: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.chdir(files)

    def ran(*words: str) -> Result:
        return CliRunner().invoke(app, ["calibrate", *words])

    return ran


def test_results_are_printed_and_written(run: Run, files: Path) -> None:
    result = run("robot.yaml", "winches.csv", *FEW, "--out", "found/robot.yaml", "--out", "found/all.nc")
    assert result.exit_code == 0, result.output
    found = sl.load_calibration(files / "found" / "all.nc")
    assert found.parameters.names == ("length_zero",) * 8 + ("mass",)
    lines = result.stdout.splitlines()
    assert [line.split() for line in lines[: len(str(found).splitlines())]] == [
        line.split() for line in str(found).splitlines()
    ]
    place = f"In {files / 'found'}: "
    assert lines[-2:] == [place + "robot.yaml", place + "all.nc"]
    robot = sl.load_robot(files / "found" / "robot.yaml")
    assert sl.dump_robot(robot) == sl.dump_robot(found.robot)
    known = robot.calibration
    assert known is not None
    assert known.log == "winches.csv"
    value, error = found.value_of("mass")
    assert [robot.mass, float(known.standard_error["mass"])] == [value, error]


def test_the_numbers_in_json_are_those_of_the_library(run: Run, files: Path) -> None:
    result = run("robot.yaml", "winches.csv", *FEW, "--folds", "0", "--no-robust", "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    log = sl.load_log(files / "winches.csv")
    found = sl.calibrate(sl.load_robot(files / "robot.yaml"), log, ("length_zero", "mass"), folds=0, robust=False)
    assert told["status"] == "FOUND"
    assert [one["name"] for one in told["numbers"]] == list(found.parameters.labels)
    for key, values in (("value", found.values), ("standard_error", found.standard_error)):
        np.testing.assert_allclose([one[key] for one in told["numbers"]], values, rtol=1e-9)
    assert told["cross_validation"] is None
    assert told["chi_squared"] == pytest.approx(found.chi_squared, rel=1e-9)


@extended
@pytest.mark.parametrize("file", ["winches.csv", "silent.csv"])
def test_deviations_of_options_replace_those_of_the_log(file: str, run: Run, files: Path) -> None:
    words = ["--length-deviation", "1 mm", "--tension-deviation", "0.01 kN", "--out", "found/all.nc"]
    result = run("robot.yaml", file, *FEW, "--folds", "0", *words)
    assert result.exit_code in {0, 1}, result.output  # with doubled deviations the result is doubtful
    sensors = sl.load_calibration(files / "found" / "all.nc").sensors
    assert sensors.tension_deviation is not None
    assert [float(sensors.length_deviation), float(sensors.tension_deviation)] == [1e-3, 10.0]


@pytest.mark.parametrize("status", [sl.CalibrationStatus.DOUBTFUL, sl.CalibrationStatus.NOT_CONVERGED])
def test_a_doubtful_result_ends_with_1(
    status: sl.CalibrationStatus, run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    found = made_up(status=status)
    monkeypatch.setattr(sl, "calibrate", lambda *_, **__: found)
    result = run("robot.yaml", "winches.csv", "--out", str(tmp_path / "r.yaml"), "--out", str(tmp_path / "all.nc"))
    assert result.exit_code == 1
    assert status.text in result.stderr.replace("\n", " ")
    assert (tmp_path / "all.nc").exists()
    converged = status is not sl.CalibrationStatus.NOT_CONVERGED
    assert (tmp_path / "r.yaml").exists() == converged  # no robot of doubtful numbers is written
    assert ("robot file" in result.stderr) == (not converged)


@extended
def test_the_output_fits_a_narrow_terminal(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal, "_out", Console(force_terminal=True, width=60, markup=False, emoji=False))
    robot, log = sl.load_robot("robot.yaml"), sl.load_log("winches.csv")
    found = sl.calibrate(robot, log, ("length_zero", "mass"), folds=0)
    plan = sl.calibration_poses(robot, 6, ("length_zero", "mass"), sl.Sensors(tension_deviation=5.0))
    for words, text in (
        (["winches.csv", "--folds", "0"], calibration_text(found, 60).replace(SPACE, " ")),
        (["--plan", "6", "--tension-deviation", "5 N"], planning.poses_text(plan, 60)),
    ):
        lines = [line.rstrip() for line in run("robot.yaml", *words, *FEW).stdout.splitlines()]
        assert lines[: len(text.splitlines())] == text.splitlines()
        assert max(map(len, lines)) <= 60


@pytest.mark.parametrize("whole", wide([[], ["--out", "found/all.nc"]]))
def test_results_that_a_robot_file_cannot_contain_are_printed(whole: list[str], run: Run, files: Path) -> None:
    robot, log = sl.load_robot(files / "robot.yaml"), sl.load_log(files / "winches.csv")
    lengths = log.replace(counts=None, unstrained_length=sl.lengths_from_counts(robot, log.readings))
    lengths.save(files / "lengths.csv")
    result = run("robot.yaml", "lengths.csv", *FEW, "--folds", "0", "--out", "found/robot.yaml", *whole)
    assert "length_zero" in result.stderr
    assert ("all.nc" if whole else "--out found.nc") in result.stderr
    assert "length_zero" not in run("robot.yaml", "winches.csv", *FEW, "--out", "found/robot.yaml").stderr


def test_chosen_poses_are_printed_and_written(run: Run, files: Path) -> None:
    result = run("robot.yaml", "--plan", "6", *FEW, "--tension-deviation", "5 N", "--out", "poses.yaml")
    assert result.exit_code == 0, result.output
    assert re.match(r"6 poses\b.*\b9 numbers\b", result.stdout)
    assert len(sl.load_path(files / "poses.yaml")) > 6
    assert "expected_error" in (files / "poses.yaml").read_text()
    told = json.loads(run("robot.yaml", "--plan", "6", *FEW, "--tension-deviation", "5 N", "--json").stdout)
    plan = sl.calibration_poses(
        sl.load_robot(files / "robot.yaml"), 6, ("length_zero", "mass"), sl.Sensors(tension_deviation=5.0)
    )
    np.testing.assert_allclose(told["position_m"], plan.poses.position, rtol=1e-9)
    np.testing.assert_allclose([one["expected_error"] for one in told["numbers"]], plan.expected_error, rtol=1e-9)


def test_the_help_names_the_default_unknowns() -> None:
    parameters: Any = {parameter.name: parameter for parameter in commands()["calibrate"].params}
    assert signature(sl.calibrate).parameters["unknowns"].default is None
    names = set(sl.calibration_poses(sl.load_robot("cogiro"), 3, candidates=30).parameters.names)
    words = set(re.findall(r"[a-z]+(?:_[a-z]+)+|mass", parameters["unknowns"].help))
    assert words - {"swivel_zero"} == names  # this one needs swivel angles


def test_other_names_of_columns_and_further_unknowns(run: Run, files: Path) -> None:
    text = (files / "winches.csv").read_text()
    (files / "other.csv").write_text(text.replace("count_", "enc ").replace("load_cell_", "F"))
    (files / "map.yaml").write_text('columns: {count: "enc {}", load_cell: "F{}"}\n')
    plain = json.loads(run("robot.yaml", "winches.csv", *FEW, "--folds", "0", "--json").stdout)
    told = json.loads(run("robot.yaml", "other.csv", *FEW, "--folds", "0", "--json", "--columns", "map.yaml").stdout)
    here, there = ([one["value"] for one in found["numbers"]] for found in (told, plain))
    np.testing.assert_allclose(here, there, rtol=1e-6)  # without commanded poses, the search has other initial values
    more = json.loads(run("robot.yaml", "winches.csv", "--also", "linear_density", "--folds", "0", "--json").stdout)
    usual = json.loads(run("robot.yaml", "winches.csv", "--folds", "0", "--json").stdout)
    names = [one["name"] for one in usual["numbers"]]
    assert [one["name"] for one in more["numbers"]] == [*names, "linear_density"]


def test_deviations_and_common_values_of_unknowns(run: Run, files: Path) -> None:
    robot, log = sl.load_robot(files / "robot.yaml"), sl.load_log(files / "winches.csv")
    asked = "drum_radius* = 2 %,axial_stiffness[],length_zero*=5 cm,mass=2.5 kg,load_cell_gain[]=5 %"
    told = json.loads(run("robot.yaml", "winches.csv", "--unknowns", asked, "--folds", "0", "--json").stdout)
    wanted = [
        sl.Unknown("drum_radius", True, 0.02),
        sl.Unknown("axial_stiffness", False),
        sl.Unknown("length_zero", True, 0.05),
        sl.Unknown("mass", None, 2.5 / robot.mass),
        sl.Unknown("load_cell_gain", False, 0.05),
    ]
    found = sl.calibrate(robot, log, wanted, folds=0)
    assert [one["name"] for one in told["numbers"]] == list(found.parameters.labels)
    assert len(told["numbers"]) == 1 + 8 + 1 + 1 + 8
    np.testing.assert_allclose([one["standard_error"] for one in told["numbers"]], found.standard_error, rtol=1e-9)


@pytest.mark.parametrize(
    ("unknown", "parts"),
    [
        ("center_of_mass=5 %", ("center_of_mass: deviation", "'5 %'", "a number in m")),
        ("mass=5 mm", ("mass: deviation", "'5 mm'")),
        ("mass=-5 %", ("mass: deviation", "> 0 kg")),
        ("mass=", ("mass: deviation", "''")),
        ("drum=5 %", ("unknown", "'drum'", "drum_radius")),
        ("mass**", ("unknown", "'mass*'", "mass")),
    ],
)
def test_impossible_deviations_of_unknowns_are_refused(run: Run, unknown: str, parts: tuple[str, ...]) -> None:
    result = run("robot.yaml", "winches.csv", "--unknowns", unknown)
    assert isinstance(result.exception, sl.InvalidValueError) or result.exit_code == 2
    for part in parts:
        assert part in " ".join((result.output + str(result.exception)).split()), result.output


def test_rests_of_a_log_with_motion_are_averaged(run: Run, files: Path) -> None:
    log = sl.load_log(files / "winches.csv")
    again = np.repeat(np.arange(len(log)), 20)
    log.rows(again).replace(time=0.1 * np.arange(len(again))).save(files / "long.csv")
    plain = json.loads(run("robot.yaml", "winches.csv", *FEW, "--folds", "0", "--json").stdout)
    told = json.loads(run("robot.yaml", "long.csv", "--rest", "1 s", *FEW, "--folds", "0", "--json").stdout)
    here, there = ([one["value"] for one in found["numbers"]] for found in (told, plain))
    np.testing.assert_allclose(here, there, rtol=1e-9)

"""The command: outputs, files and exit codes."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.ending import exit_code_of
from sagline.cli.main import app
from tests.cli import interrupts
from tests.tiers import extended, wide

OUTSIDE = "durations: 5\nrate: 20\nwaypoints: [{position: [0, 0, 1.5]}, {position: [7.2, 3, 1.5]}]\n"
INSIDE = "durations: 5\nrate: 20\nwaypoints: [{position: [0, 0, 1.5]}, {position: [4, 3, 1.5]}]\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> FilePath:
    """A new current folder for each test, on a terminal with 80 columns."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "outside.yaml").write_text(OUTSIDE)
    (tmp_path / "inside.yaml").write_text(INSIDE)
    return tmp_path


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, words)


def numbers(*words: str) -> Any:
    return json.loads(sagline(*words, "--json").stdout)


def spawned(*words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "sagline", *words]

    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=interrupts.heard
    )


def test_track_prints_and_writes_results_of_the_library(folder: FilePath) -> None:
    result = sagline("track", "article-suspended", "inside.yaml", "--model", "empirical", "--no-figures", "--json")
    assert result.exit_code == 0
    (run,) = json.loads(result.stdout)["runs"]
    robot, path = sl.load_robot("article-suspended"), sl.load_path("inside.yaml")
    plan = sl.inverse(robot, path, model=sl.Empirical())
    proof = sl.confirm(plan)
    error = 1e3 * np.linalg.norm(proof.position_error, axis=1)
    expected = {
        "position_error_max_mm": error.max(),
        "position_error_mean_mm": error.mean(),
        "chord_tension_min_n": plan.chord_tension.min(),
        "chord_tension_max_n": plan.chord_tension.max(),
        "unstrained_length_min_m": plan.unstrained_length.min(),
        "unstrained_length_max_m": plan.unstrained_length.max(),
        "adjusting_length_min_mm": 1e3 * plan.state.cables.adjusting_length.min(),
        "adjusting_length_max_mm": 1e3 * plan.state.cables.adjusting_length.max(),
        "feasible_share_percent": 100.0,
    }
    assert {name: run[name] for name in expected} == pytest.approx(expected, rel=1e-12)
    assert (run["robot"], run["model"], run["poses"], run["gaps"]) == ("article-suspended", "Empirical", 101, [])
    assert os.listdir("output") == ["article-suspended-empirical.nc"]
    loaded = sl.load_plan("output/article-suspended-empirical.nc")
    np.testing.assert_array_equal(loaded.unstrained_length, plan.unstrained_length)


def test_track_writes_the_errors_that_tolerances_cause() -> None:
    robot = sl.load_robot("article-suspended").replace(tolerances={"frame_anchors": 1e-3})
    FilePath("known.yaml").write_text(sl.dump_robot(robot))
    (run,) = numbers("track", "known.yaml", "inside.yaml", "--uncertainty", "--csv", "--no-figures")["runs"]
    found = sl.inverse(robot, sl.load_path("inside.yaml")).uncertainty()
    assert run["expected_error_max_mm"] == pytest.approx(1e3 * found.position.max(), rel=1e-12)
    assert run["expected_tension_max_n"] == pytest.approx(found.tension.max(), rel=1e-12)
    name = "article-suspended-catenary-uncertainty.csv"
    assert FilePath("output", name).read_text() == found.to_csv()
    assert sagline("track", "article-suspended", "inside.yaml", "--uncertainty", "--no-figures").exit_code == 2


def test_options_reach_the_solver() -> None:
    words = ("track", "article-mixed", "inside.yaml", "--no-figures")
    (run,) = numbers(*words, "--tension", "minimum-norm", "--variable", "horizontal", "--model", "parabolic")["runs"]
    assert (run["model"], run["tension"], run["tension_variable"]) == ("Parabolic", "MinimumNorm", "horizontal")
    plan = sl.inverse(
        sl.load_robot("article-mixed"), sl.load_path("inside.yaml"), sl.Parabolic(), sl.MinimumNorm("horizontal")
    )
    assert run["chord_tension_max_n"] == pytest.approx(plan.chord_tension.max(), rel=1e-12)


def test_the_table_fits_and_has_units() -> None:
    result = sagline("track", "article-suspended", "inside.yaml", "--no-figures")
    assert set(re.findall(r"\[(\S+)\]", result.stdout)) == {"mm", "N", "m", "%"}
    assert re.search(r"feasible poses \[%\] +100 *$", result.stdout, re.MULTILINE)
    assert max(len(line) for line in result.stdout.splitlines() if not line.startswith("In ")) <= 80
    assert "\x1b" not in result.stdout  # no colors in a pipe


@extended
def test_figures_are_drawn_unless_declined() -> None:
    assert sagline("track", "article-suspended", "inside.yaml", "--out", "a").exit_code == 0
    names = [f"{what}.{kind}" for what in ("cables", "error", "path", "velocity") for kind in ("png", "svg")]
    assert sorted(os.listdir("a")) == sorted(
        ["article-suspended-catenary.nc", *(f"article-suspended-catenary-{name}" for name in names)]
    )


def test_a_path_that_leaves_the_feasible_region() -> None:
    result = sagline("track", "article-suspended", "outside.yaml", "--no-figures", "--json")
    assert result.exit_code == 1
    (gap,) = json.loads(result.stdout)["runs"][0]["gaps"]
    plan = sl.load_plan("output/article-suspended-catenary.nc")
    assert plan.path is not None
    outside = np.flatnonzero(~plan.feasible)
    assert (gap["from_s"], gap["to_s"]) == (plan.path.time[outside[0]], plan.path.time[outside[-1]])
    assert gap["shortfall_n"] == plan.shortfall.max() > 50.0
    for told in (f" {gap['from_s']:g} s ", f" {gap['to_s']:g} s:", f" {gap['shortfall_n']:.3g} N;"):
        assert told in result.stderr
    assert np.isfinite(plan.unstrained_length[: outside[0]]).all()


def test_a_plan_with_unstable_equilibria() -> None:
    # near its post the equilibrium of the mixed robot becomes unstable before the tensions reach their limits
    (FilePath("corner.yaml")).write_text(
        "durations: 5\nwaypoints: [{position: [0, 0, 1.5]}, {position: [6.34, 4.43, 5.02]}]"
    )
    result = sagline("track", "article-mixed", "corner.yaml", "--no-figures", "--json")
    assert result.exit_code == 1
    (run,) = json.loads(result.stdout)["runs"]
    (gap,) = run["gaps"]
    assert (gap["reason"], gap["to_s"]) == (sl.PoseStatus.UNSTABLE.text, 5.0)
    assert run["poses_not_stable"] > 0
    assert "unstable" in result.stderr


def test_robots_lists_all_presets() -> None:
    result = sagline("robots")
    assert result.exit_code == 0
    assert [
        name for name in sl.robot_names() if re.search(rf"^ {name} +\d +3R3T ", result.stdout, re.MULTILINE)
    ] == list(sl.robot_names())
    assert re.search(r"^ cogiro +8 +3R3T +91.058 +15 × 11 × 5.42 +1.01 × 0.986 × 1 *$", result.stdout, re.MULTILINE)
    assert re.search(
        r"^ robot +cables +motion +mass \[kg\] +frame \[m\] +platform \[m\] *$", result.stdout, re.MULTILINE
    )
    falcon = next(robot for robot in numbers("robots") if robot["name"] == "falcon-7")
    assert (falcon["cables"], falcon["mass_kg"], falcon["motion_pattern"]) == (7, 0.3, "3R3T")
    np.testing.assert_allclose(falcon["frame_size_m"], [1.45, 1.45, 1.25])  # its anchors are 1.25 m above the floor
    np.testing.assert_allclose(falcon["platform_size_m"], [0.0, 0.1, 1.0])


@pytest.mark.parametrize("name", wide(sl.robot_names(), first=3))
def test_show_prints_every_value(name: str) -> None:
    robot, shown = sl.load_robot(name), numbers("show", name)
    for field in ("frame_anchors", "platform_anchors", "inertia", "center_of_mass", "tension_min", "tension_max"):
        np.testing.assert_array_equal(shown[field]["value"], getattr(robot, field))
    np.testing.assert_array_equal(shown["axial_stiffness"]["value"], robot.cables.axial_stiffness)
    assert (shown["mass"], shown["mass"]["unit"]) == ({**shown["mass"], "value": robot.mass}, "kg")
    told = {field for field in shown if isinstance(shown[field], dict) and "assumed" in shown[field]}
    assert told == set(robot.assumed) - {"cables"} | (set(robot.cables.known()) if "cables" in robot.assumed else set())
    text = " ".join(sagline("show", name).stdout.split())
    assert " ".join(robot.source.split()) in text
    for field, why in robot.assumed.items():
        assert f"{field}: {' '.join(why.split())}" in text


def test_show_marks_assumed_values() -> None:
    text = sagline("show", "article-mixed").stdout
    assert re.search(r"^ inertia \* +diagonal \(1\.4167, 1\.4167, 0\.75\) +kg m² *$", text, re.MULTILINE)
    assert re.search(r"^ mass +50 +kg *$", text, re.MULTILINE)
    assert re.search(r"^ +0 +\(7\.5, 5\.5, 6\) +\(0\.15, 0\.15, -0\.25\) *$", text, re.MULTILINE)


def test_unlimited_tensions_are_null_in_json(folder: FilePath) -> None:
    robot = sl.load_robot("falcon-7").replace(tension_max=np.inf)
    (folder / "free.yaml").write_text(sl.dump_robot(robot))
    assert numbers("show", "free.yaml")["tension_max"]["value"] == [None] * 7


@extended
def test_run_repeats_the_test_of_the_article(folder: FilePath) -> None:
    result = sagline("run", "--json")
    assert result.exit_code == 0
    runs = {(run["robot"], run["model"]): run for run in json.loads(result.stdout)["runs"]}
    largest = {key: run["position_error_max_mm"] for key, run in runs.items()}
    assert largest["article-suspended", "Catenary"] < 1e-6
    assert largest["article-mixed", "Catenary"] < 1e-6
    # the article: "about +-6 mm" with its own, unpublished anchors; this value belongs to the anchors of the preset
    assert largest["article-suspended", "Empirical"] == pytest.approx(1.71, abs=0.01)
    assert largest["article-mixed", "Empirical"] == pytest.approx(1.13, abs=0.01)
    plans = {name: sl.load_plan(f"output/article-{name}-empirical.nc") for name in ("suspended", "mixed")}
    ratio = plans["mixed"].horizontal_tension.max() / plans["suspended"].horizontal_tension.max()
    assert ratio == pytest.approx(2.1, abs=0.05)  # the article: "approximated as twice"
    figures = ("18-path", "19-velocity", "20-suspended", "21-mixed", "22-error")
    names = {f"figure-{figure}.{kind}" for figure in figures for kind in ("png", "svg")}
    assert names <= set(os.listdir("output"))


def test_version_and_help() -> None:
    assert sagline("--version").stdout == f"sagline {sl.__version__}\n"
    assert "sagline track" in sagline("--help").stdout
    assert "--model" in sagline("track", "-h").stdout
    assert "130 Ctrl-C" in " ".join(sagline("--help").stdout.split())


@extended
def test_exit_codes_of_the_real_command() -> None:
    track = ("track", "article-suspended", "outside.yaml", "--no-figures", "--out", "o")
    for words, code in ((("--version",), 0), (track, 1), (("show", "nothing"), 2)):
        process = spawned(*words)
        _, errors = process.communicate(timeout=120)
        assert process.returncode == code, errors
        assert "Traceback" not in errors


@extended
def test_ctrl_c_during_a_long_run_leaves_no_partial_files(folder: FilePath) -> None:
    (folder / "long.yaml").write_text(INSIDE.replace("rate: 20", "rate: 40000"))
    process = spawned("track", "article-suspended", "long.yaml", "--out", "out")
    time.sleep(3.0)  # a second of loading, then 200,000 poses and their figures
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130, errors
    assert errors.rpartition("\n")[0].rpartition("\n")[2].startswith("Interrupted. ")
    left = os.listdir("out") if FilePath("out").exists() else []
    assert not [name for name in left if name.endswith(".part")]


def test_a_lost_interrupt_still_ends_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    """Python prints and discards an interrupt during the finalization of an object."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:

        def loses() -> None:
            with suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)

        code = exit_code_of(loses)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert code == 130
    err = capsys.readouterr().err
    assert (err.partition(" ")[0], err.count("\n")) == ("Interrupted.", 1)


def test_completion_offers_presets_and_files() -> None:
    from sagline.cli.options import robot_completions

    assert robot_completions("article-m") == ["article-mixed"]
    assert robot_completions("in") == ["inside.yaml"]

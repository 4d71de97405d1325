"""`sagline tension`: numbers of all methods, the figure, and messages without a solution."""

import json
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from tests.tension.reference import public_methods


@pytest.fixture(autouse=True)
def folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> FilePath:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, ["tension", *words])


def test_numbers_agree_with_the_library(folder: FilePath) -> None:
    result = sagline("article-mixed", "--pose", "1,-0.5,2.5,3,0,0", "--json")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    robot = sl.load_robot("article-mixed")
    pose = sl.Pose.from_euler([1.0, -0.5, 2.5], np.radians(3.0), 0.0, 0.0)
    for name in ("Centroid", "LowestMaximum", "Puncture", "MinimumNorm"):
        plan = sl.inverse(robot, pose, tension=getattr(sl, name)())
        np.testing.assert_allclose(found["tensions"][name]["chord_tension"], plan.chord_tension, rtol=1e-12)
    assert found["capacity_margin"] == pytest.approx(float(sl.capacity_margin(plan.state)), rel=1e-6)
    assert sorted(file.name for file in (folder / "output").iterdir()) == [
        "article-mixed-tension.png",
        "article-mixed-tension.svg",
    ]


def test_table_and_robots_without_polygon(folder: FilePath) -> None:
    result = sagline("falcon-7")
    assert result.exit_code == 0, result.stderr
    assert "AnalyticCenter" in result.stdout
    assert not (folder / "output").exists()


def test_an_infeasible_pose_has_a_reason(folder: FilePath) -> None:
    result = sagline("article-suspended", "--pose", "7.45,0,1.5")
    plan = sl.inverse(sl.load_robot("article-suspended"), sl.Pose([7.45, 0, 1.5], np.eye(3)))
    assert result.exit_code == 1
    cables = ", ".join(str(i) for i in np.flatnonzero(plan.blocking))
    assert f" {float(plan.shortfall):.4g} N; " in result.stderr
    assert result.stderr.endswith(f" cables {cables}\n")
    assert not (folder / "output").exists()


def test_modes_at_an_infeasible_pose_name_the_shortfall(folder: FilePath) -> None:
    result = CliRunner().invoke(app, ["vibrate", "article-suspended", "--pose", "7.45,0,1.5"])
    plan = sl.inverse(sl.load_robot("article-suspended"), sl.Pose([7.45, 0, 1.5], np.eye(3)))
    assert result.exit_code == 1
    assert f" {float(plan.shortfall):.4g} N; " in result.stderr
    assert result.stderr.endswith(f" cables {', '.join(map(str, np.flatnonzero(plan.blocking)))}\n")


def test_large_forces_have_a_prefix_and_ordinary_spaces(folder: FilePath) -> None:
    result = sagline("article-suspended", "--pose", "0,0,2", "--wrench", "0,0,-30000")
    robot = sl.load_robot("article-suspended")
    plan = sl.inverse(robot, sl.Pose([0, 0, 2], np.eye(3)), wrench=[0, 0, -30000, 0, 0, 0])
    assert f" {float(plan.shortfall) / 1e3:.4g} kN; " in result.stderr
    result = sagline("article-suspended", "--pose", "0,0,2", "--no-figures")
    assert "margin: " in result.stdout
    assert "\u00a0" not in result.output


def test_the_polygon_is_that_of_the_load(folder: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[sl.TensionPolygon] = []
    monkeypatch.setattr("sagline.plot.polygon", lambda shape, points: drawn.append(shape))
    monkeypatch.setattr("sagline.cli.output.Output.draw", lambda _, make: make())
    assert sagline("article-mixed", "--wrench", "0,0,-100").exit_code == 0
    robot = sl.load_robot("article-mixed")
    assert robot.test_box is not None
    middle = sl.Pose((robot.test_box.low + robot.test_box.high) / 2, np.eye(3))
    expected = sl.tension_polygon(robot, middle, wrench=[0.0, 0.0, -100.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(drawn[0].vertices, expected.vertices, rtol=1e-9)
    assert not np.allclose(expected.vertices, sl.tension_polygon(robot, middle).vertices)


def test_the_help_names_the_methods_that_are_left_out() -> None:
    from sagline.cli.tension import LEFT_OUT, tension

    words = " ".join((tension.__doc__ or "").split())
    assert "Three methods" in words
    assert len(set(public_methods()) & set(LEFT_OUT)) == len(LEFT_OUT) == 3
    assert all(name in words for name in LEFT_OUT)

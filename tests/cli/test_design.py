"""`sagline design`: table, files, and continuation of a stopped search."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.ending import BAD_INPUT
from sagline.cli.main import app
from tests.tiers import extended

DESIGN = """\
free:
  - frame_anchors: {along: [0, 0, 1], low: -1, high: 1 m, symmetry: together}
  - tension_max: {low: 1 kN, high: 3 kN}
goals: [mean_margin, {minimize: largest_tension, weight: 0.1}]
wrenches: {force: 50 N, moment: 5 N*m}
grid: [3, 3, 2]
evaluations: 60
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "design.yaml").write_text(DESIGN)
    return tmp_path


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, ["design", "article-suspended", "design.yaml", "--no-figures", *words])


def library(**changes: Any) -> sl.Front:
    return sl.design(sl.load_robot("article-suspended"), **{**sl.load_design("design.yaml"), **changes})


def test_the_robots_agree_with_the_library(folder: Path) -> None:
    result = sagline("--json")
    assert result.exit_code == 0, result.stderr
    told, front = json.loads(result.stdout), library()
    assert told["better"] is front.better is True
    assert told["evaluations"] == len(front.evaluated)
    np.testing.assert_array_equal(list(told["goals"].values()), front.start_values)
    (robot,) = told["robots"]
    np.testing.assert_array_equal(list(robot["goals"].values()), front.values[0])
    np.testing.assert_array_equal(list(robot["changed"].values()), front.changed[0])
    assert told["units"] == {
        "mean_margin": "N", "largest_tension": "N", "frame_anchors z": "m", "tension_max": "N",
    }  # fmt: skip
    found = sl.load_robot(folder / "front" / "article-suspended-better.yaml")
    assert found.frame_anchors.tobytes() == front.best.frame_anchors.tobytes()
    assert found.tension_max[0] == front.best.tension_max[0]
    names = sorted(file.name for file in (folder / "front").iterdir())
    assert names == ["article-suspended-better.yaml", "design.json", "evaluations.csv", "front.csv"]


def test_the_output_compares_both_robots() -> None:
    result = sagline()
    assert result.exit_code == 0, result.stderr
    front = library()
    rows = [line.split() for line in result.stdout.splitlines()]
    assert any(row[:2] == ["article-suspended", f"{front.start_values[0]:.4g}"] for row in rows)
    assert any(row[:2] == ["article-suspended-better", f"{front.values[0, 0]:.4g}"] for row in rows)
    assert front.text in result.stdout.replace("\n", " ")


def test_a_stopped_search_continues(folder: Path) -> None:
    assert sagline("--evaluations", "30").exit_code == 0
    before = (folder / "front" / "evaluations.csv").read_text()
    result = sagline("--json")
    assert result.exit_code == 0, result.stderr
    assert (folder / "front" / "evaluations.csv").read_text().startswith(before)
    assert json.loads(result.stdout)["evaluations"] == len(library().evaluated)


def test_an_interrupt_prints_the_command_to_continue(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sagline.optimization import rating

    rate, calls = rating.Rating.__call__, [0]

    def interrupted(self: Any, values: Any) -> Any:
        calls[0] += 1
        if calls[0] == 3:
            raise KeyboardInterrupt
        return rate(self, values)

    monkeypatch.setattr(rating.Rating, "__call__", interrupted)
    result = sagline()
    assert result.exit_code == 130
    kept = len((folder / "front" / "evaluations.csv").read_text().splitlines()) - 1
    assert f"{kept} evaluated robots " in result.stderr
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    again = sagline("--json")
    assert again.exit_code == 0, again.stderr
    np.testing.assert_array_equal(list(json.loads(again.stdout)["robots"][0]["goals"].values()), library().values[0])


def test_the_folder_of_another_search_is_refused(folder: Path) -> None:
    assert sagline("--evaluations", "30").exit_code == 0
    (folder / "design.yaml").write_text(DESIGN + "seed: 3\n")
    result = sagline()
    assert result.exit_code == BAD_INPUT
    assert result.stderr.startswith("Error: front: ")
    assert result.stderr.count("\n") == 1


@extended
def test_a_figure_shows_the_candidates(folder: Path) -> None:
    result = CliRunner().invoke(app, ["design", "article-suspended", "design.yaml", "--evaluations", "30"])
    assert result.exit_code == 0, result.stderr
    assert (folder / "front" / "front.png").read_bytes().startswith(b"\x89PNG")
    assert "front.csv/.png/.svg" in result.stdout.replace("\n", "")

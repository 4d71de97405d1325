"""`sagline sweep`: its summary, and how it continues."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import sagline as sl
from sagline.cli.main import app
from tests.sweep.requests import marked

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("own_sweep.yaml", "own_planar.yaml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ended(*words: str) -> Result:
    return CliRunner().invoke(app, ["sweep", *words])


def command_of(result: Result) -> list[str]:
    """Words of the printed command that continues the sweep."""
    return shlex.split(result.stderr.partition(": sagline ")[2].partition("\n")[0])


def test_a_sweep_prints_the_results_of_its_requests_and_runs_once(folder: Path) -> None:
    first = ended("own_sweep.yaml", "--workers", "1")
    assert (first.exit_code, first.stderr) == (0, "")
    assert re.search(r"\b1 robot.*\b609 .*\b9 ", first.stdout)
    found = sl.sweep.load("output/own_sweep")
    assert found.complete
    assert f"{found.counts.feasible:,}" in first.stdout
    assert (found.counts.open, found.counts.lost, sum(found.counts)) == (0, 0, 609 * 9)
    assert str(folder / "output" / "own_sweep") in first.stdout
    before = marked(Path("output/own_sweep"))
    again = ended("own_sweep.yaml", "--workers", "1", "--json")
    assert (again.exit_code, again.stderr) == (0, "")
    told = json.loads(again.stdout)
    assert (told["feasible"], told["infeasible"]) == (found.counts.feasible, found.counts.infeasible)
    assert (told["robots"], told["poses"], told["wrenches"], told["lost"]) == (1, 609, 9, 0)
    assert marked(Path("output/own_sweep")) == before


def test_without_a_scheduler_nothing_is_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sagline.sweep.running.PATIENCE", 0.5)
    before = sorted(folder.iterdir())
    found = ended("own_sweep.yaml", "--scheduler", "tcp://127.0.0.1:9")
    assert found.exit_code == 2
    assert "tcp://127.0.0.1:9" in found.stderr
    assert sorted(folder.iterdir()) == before


def test_the_folder_of_another_sweep_is_refused(folder: Path) -> None:
    assert ended("own_sweep.yaml", "--out", "out", "--workers", "1").exit_code == 0
    text = Path("own_sweep.yaml").read_text()
    Path("own_sweep.yaml").write_text(text.replace("100 N", "101 N"))
    result = ended("own_sweep.yaml", "--out", "out", "--workers", "1")
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: out: ")
    assert " 5,481 " in result.stderr
    assert "sagline sweep" not in result.stderr
    assert result.stdout == ""


def test_ctrl_c_prints_the_command_to_continue(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sagline.sweep.running.run", stopped)
    result = ended("own_sweep.yaml", "--out", "my sweep", "--workers", "3")
    assert result.exit_code == 130
    assert command_of(result) == ["sweep", "own_sweep.yaml", "--out", "my sweep", "--workers", "3"]
    assert "Interrupted." in result.stderr


def test_an_error_prints_the_command_to_continue(monkeypatch: pytest.MonkeyPatch) -> None:
    def failed(_: Any, folder: Path, *__: Any, **___: Any) -> None:
        folder.mkdir()
        (folder / "done").touch()
        raise sl.SaglineError("Gone.")

    monkeypatch.setattr("sagline.sweep.running.run", failed)
    result = ended("own_sweep.yaml", "--out", "out", "--scheduler", "tcp://10.0.0.1:8786")
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: Gone.\n")
    assert result.stderr.count("\n") == 2
    address = "tcp://10.0.0.1:8786"
    assert command_of(result) == ["sweep", "own_sweep.yaml", "--out", "out", "--scheduler", address]


def test_requests_without_a_verdict_are_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    found = sl.sweep.run(sl.load_sweep("own_sweep.yaml"), "out", workers=1)
    open_ones = sl.sweep.Sweep(found.folder, found.request, 1, 1, sl.sweep.Counts(5000, 479, 0, 2, 0), 1.0)
    monkeypatch.setattr("sagline.sweep.running.run", lambda *_, **__: open_ones)
    result = ended("own_sweep.yaml")
    assert result.exit_code == 1
    assert result.stderr.startswith("2 of 5,481 ")
    assert result.stderr.count("\n") == 1

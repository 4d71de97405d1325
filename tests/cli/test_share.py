"""`sagline share`: pages of robots and runs, and refusals."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import sagline as sl
from sagline.cli.main import app
from sagline.share import packing
from tests.files.executions import execution
from tests.tiers import extended


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shared(*words: str) -> Result:
    return CliRunner().invoke(app, ["share", *words])


def plan(*places: tuple[float, float, float]) -> sl.Plan:
    pose = sl.Pose(np.array(places), np.stack([np.eye(3)] * len(places)))
    return sl.inverse(sl.load_robot("cogiro"), pose if len(places) > 1 else pose[0])


def test_a_robot_becomes_one_page_and_its_size_is_printed(folder: Path) -> None:
    result = shared("cogiro")
    assert result.exit_code == 0, result.output
    page = (folder / "cogiro.html").read_bytes()
    assert f": {len(page) / 1e3:,.0f} kB" in result.stdout
    assert len(page) < 250_000
    assert b"src=" not in page
    assert b"default-src 'none'" in page


@extended
def test_runs_simulations_and_logs_play(folder: Path) -> None:
    plan((0.0, 0.0, 2.0), (1.0, 0.0, 2.0)).save("run.nc")
    state = plan((0.0, 0.0, 2.0)).state
    sl.simulate(state, duration=0.1, events=sl.Break(cable=3, time=0.05)).save("sim.nc")
    execution().save("log.mcap")
    for name, kind in (("run.nc", "run of 1 s"), ("sim.nc", "simulation of 0.1 s"), ("log.mcap", "log of ")):
        result = shared(name)
        assert result.exit_code == 0, result.output
        page = (folder / name).with_suffix(".html").read_text(encoding="utf-8")
        assert f", {kind}" in page
        assert 'data-part="states"' in page
    assert "cable 3 at 0.050 s" in (folder / "sim.html").read_text(encoding="utf-8")


def test_a_default_name_does_not_replace_another_page(folder: Path) -> None:
    (folder / "cogiro.html").write_text("<p>my notes", encoding="utf-8")
    result = shared("cogiro")
    assert result.exit_code == 2
    assert (folder / "cogiro.html").read_text(encoding="utf-8") == "<p>my notes"
    assert shared("cogiro", "--out", "cogiro.html").exit_code == 0
    assert shared("cogiro").exit_code == 0  # over a page of sagline


def test_without_the_module_one_line_gives_the_next_step(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packing, "MODULE", folder / "kernels.wasm")
    result = shared("no-such-robot")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "kernels.wasm" in result.stderr
    assert "python -m tools.build" in result.stderr

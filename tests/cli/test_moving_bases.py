"""`--base` of `sagline track` and `sagline simulate`: the numbers of the library, files, and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app

WAY = "durations: 1\nrate: 50\nwaypoints:\n  - {position: [0, 0, 1.5]}\n  - {position: [0.5, 0, 1.6]}\n"


def sagline(folder: Path, *words: str) -> Any:
    (folder / "way.yaml").write_text(WAY)
    time = np.linspace(0.0, 2.0, 81)
    rows = np.stack((time, 0.2 * time, 0.1 * np.sin(time), 0.0 * time, 0.0 * time, 0.0 * time, 0.02 * time), axis=-1)
    head = "time,x,y,z,alpha,beta,gamma"
    np.savetxt(folder / "ship.csv", rows, delimiter=",", header=head, comments="", fmt="%.17g")
    files = [str(folder / word) if word.endswith(".yaml") else word for word in words]
    return CliRunner().invoke(app, [*files, "--no-figures", "--out", str(folder / "out")])


def expected(folder: Path, *cables: int) -> tuple[sl.Robot, sl.AnchorMotion]:
    robot = sl.load_robot("cogiro")
    return robot, sl.anchors_on_bases(robot, [(sl.load_path(folder / "ship.csv"), cables)])


def test_track_plans_with_the_bases(tmp_path: Path) -> None:
    bases = ["--base", f"{tmp_path / 'ship.csv'}=0,1", "--base", f"{tmp_path / 'ship.csv'}=5"]
    assert sagline(tmp_path, "track", "cogiro", "way.yaml", *bases).exit_code == 0
    found = sl.load_plan(tmp_path / "out" / "cogiro-catenary.nc")
    robot, anchors = expected(tmp_path, 0, 1, 5)
    plan = sl.inverse(robot, sl.load_path(tmp_path / "way.yaml"), anchors=anchors)
    assert found.anchors is not None
    np.testing.assert_array_equal(found.anchors.position, anchors.position)
    np.testing.assert_array_equal(found.unstrained_length, plan.unstrained_length)


@pytest.mark.parametrize("path", [["way.yaml"], ["--pose", "0,0,1.5"]], ids=["path", "rest"])
def test_simulate_moves_the_bases(tmp_path: Path, path: list[str]) -> None:
    base = f"{tmp_path / 'ship.csv'}=0,1,2,3,4,5,6,7"
    assert sagline(tmp_path, "simulate", "cogiro", *path, "--after", "0.2", "--base", base).exit_code == 0
    found = sl.load_simulation(tmp_path / "out" / "cogiro-simulation.nc")
    robot, anchors = expected(tmp_path, *range(8))
    if path[0] == "way.yaml":
        plan = sl.inverse(robot, sl.load_path(tmp_path / "way.yaml"), anchors=anchors)
        run = sl.simulate(plan, duration=1.2)
    else:
        run = sl.simulate(robot, (0.0, 0.0, 1.5), anchors=anchors, duration=0.2)
    np.testing.assert_array_equal(found.pose.position, run.pose.position)
    assert np.abs(found.energy.error).max() < 1e-6 * np.ptp(found.energy.supplied)


REFUSED = {
    "no cables": (["--base", "ship.csv"], "FILE=CABLES"),
    "a range": (["--base", "ship.csv=0-3"], "FILE=CABLES"),
    "a word": (["--base", "ship.csv=all"], "FILE=CABLES"),
    "no file": (["--base", "=0,1"], "FILE=CABLES"),
    "another file": (["--base", "none.csv=0"], "none.csv"),
    "no cable": (["--base", "{folder}/ship.csv=8"], "0 to 7"),
    "too long": (["--base", "{folder}/ship.csv=0", "--after", "5"], "the samples of anchors"),
    "lumped": (["--base", "{folder}/ship.csv=0", "--cable-mass", "lumped"], "with moving anchors"),
    "shaper": (["--base", "{folder}/ship.csv=0", "--shaper", "zv"], "Leave out --shaper, or --base"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_bases_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    words, part = REFUSED[name]
    given = [word.format(folder=tmp_path) for word in words]
    more = [] if "--after" in given else ["--after", "0.2"]
    result = sagline(tmp_path, "simulate", "cogiro", "way.yaml", *given, *more)
    assert (result.exit_code, result.stdout) == (2, "")
    error = [line for line in result.stderr.splitlines() if line.startswith("Error")]
    assert len(error) == 1
    assert part in error[0]
    assert not list((tmp_path / "out").glob("*.nc")) if (tmp_path / "out").exists() else True


@pytest.mark.parametrize("command", ["track", "simulate"])
@pytest.mark.parametrize(
    "page", [["view", "cogiro", "{file}", "--no-browser"], ["share", "{file}"]], ids=["view", "share"]
)
def test_pages_refuse_moving_anchors(tmp_path: Path, command: str, page: list[str]) -> None:
    more = ["--after", "0.2"] if command == "simulate" else []
    base = f"{tmp_path / 'ship.csv'}=0,1"
    assert sagline(tmp_path, command, "cogiro", "way.yaml", "--base", base, *more).exit_code == 0
    (file,) = (tmp_path / "out").glob("*.nc")
    result = CliRunner().invoke(app, [word.format(file=file) for word in page])
    assert (result.exit_code, result.stdout) == (2, "")
    assert REFUSED["lumped"][1] in result.stderr

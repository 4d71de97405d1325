"""Every example runs."""

import re
import runpy
import shutil
from pathlib import Path as FilePath

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app

EXAMPLES = FilePath(__file__).parents[2] / "examples"


@pytest.fixture(autouse=True)
def folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for file in EXAMPLES.iterdir():
        if file.is_file():
            shutil.copy(file, tmp_path)


def test_quickstart(capsys: pytest.CaptureFixture[str]) -> None:
    names = runpy.run_path("quickstart.py")
    assert names["error"] < 1e-9
    assert re.findall(r"[\d.]+", capsys.readouterr().out.splitlines()[0]) == ["1644", "5.05", "15.05"]
    np.testing.assert_array_equal(sl.load_plan("run.nc").unstrained_length, names["plan"].unstrained_length)
    statements = [line for line in FilePath("quickstart.py").read_text().splitlines() if line.strip()]
    assert len(statements) < 15


def test_own_robot_along_own_path() -> None:
    robot, path = sl.load_robot("own_robot.yaml"), sl.load_path("own_path.yaml")
    assert robot.cables.axial_stiffness == pytest.approx(np.full(8, 30e9 * np.pi * 0.002**2), rel=1e-12)
    assert robot.center_of_mass[2] == pytest.approx(-0.05, rel=1e-12)
    np.testing.assert_allclose(path.pose.position[500], (3.0, 1.5, 1.5), atol=1e-12)
    result = CliRunner().invoke(app, ["track", "own_robot.yaml", "own_path.yaml", "--no-figures"])
    assert (result.exit_code, result.stderr) == (0, "")
    assert sl.load_plan("output/hall-camera-catenary.nc").feasible.all()

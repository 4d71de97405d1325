"""`sagline view found.nc`: a calibrated robot with the results, and no other robot."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from tests.calibration.made_up import made_up
from tests.tiers import wide


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("found")
    made_up(count=6, slipped=((4, 3, 0.02),)).save(place / "found.nc")
    return place


@pytest.mark.parametrize("words", wide([["found.nc"], ["cogiro", "found.nc"]]))
def test_a_calibration_is_shown_with_its_robot(words: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Any] = []

    def serve(machine: sl.Robot, address: Any, *, found: sl.Calibration, **page: Any) -> int:
        shown.append((machine, page.get("played"), found))
        return 0

    monkeypatch.chdir(folder)
    monkeypatch.setattr("sagline.cli.view.serve", serve)
    result = CliRunner().invoke(app, ["view", *words, "--no-browser"])
    assert result.exit_code == 0, result.output
    [(machine, played, found)] = shown
    assert played is None
    np.testing.assert_array_equal(found.covariance, made_up(count=6).covariance)
    np.testing.assert_array_equal(machine.frame_anchors, found.robot.frame_anchors)

"""`sagline track` refuses a path that is probably in another unit, and an impossible path."""

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from sagline.cli.main import app
from tests.tiers import wide

YAML = "durations: 1\nrate: 4\nwaypoints:\n  - {{position: [0, 0, {0}]}}\n  - {{position: [{1}, 0, {0}]}}\n"
CSV = "time,x,y,z\n0,0,0,{0}\n0.5,0,0,{0}\n1,{1},0,{0}\n"


def track(folder: Path, name: str, text: str) -> Any:
    (folder / name).write_text(text)
    return CliRunner().invoke(
        app, ["track", "cogiro", str(folder / name), "--no-figures", "--out", str(folder / "out")]
    )


@pytest.mark.parametrize(("name", "form"), wide([("path.yaml", YAML), ("path.csv", CSV)]))
def test_millimeters_are_recognized(tmp_path: Path, name: str, form: str) -> None:
    result = track(tmp_path, name, form.format(1500, 2500))
    assert (result.exit_code, result.stdout, (tmp_path / "out").exists()) == (2, "", False)
    assert result.stderr.count("\n") == 1
    assert track(tmp_path, name, form.format("1.5", "0.2")).exit_code == 0


@pytest.mark.parametrize("timing", ["durations: 0.001", "durations: [1, 0.01]", "durations: 1\nrate: 1e-30"])
def test_a_segment_without_a_sample_is_reported(tmp_path: Path, timing: str) -> None:
    text = f"{timing}\nwaypoints: [{{position: [0, 0, 1.5]}}, {{position: [1, 0, 1.5]}}, {{position: [2, 0, 1.5]}}]\n"
    result = track(tmp_path, "path.yaml", text)
    assert (result.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert result.stderr.startswith(f"Error: {tmp_path / 'path.yaml'}: ")

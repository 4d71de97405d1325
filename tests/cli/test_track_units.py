"""`sagline track` refuses a path in another unit than it says, and one that nobody can have meant."""

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from sagline.cli.main import app

YAML = "durations: 1\nrate: 4\nwaypoints:\n  - {{position: [0, 0, {0}]}}\n  - {{position: [{1}, 0, {0}]}}\n"
CSV = "time,x,y,z\n0,0,0,{0}\n0.5,0,0,{0}\n1,{1},0,{0}\n"


def track(folder: Path, name: str, text: str) -> Any:
    (folder / name).write_text(text)
    return CliRunner().invoke(
        app, ["track", "cogiro", str(folder / name), "--no-figures", "--out", str(folder / "out")]
    )


@pytest.mark.parametrize(("name", "form"), [("path.yaml", YAML), ("path.csv", CSV)])
def test_millimeters_are_told(tmp_path: Path, name: str, form: str) -> None:
    result = track(tmp_path, name, form.format(1500, 2500))
    assert (result.exit_code, result.stdout, (tmp_path / "out").exists()) == (2, "", False)
    assert "m away from cogiro, whose frame measures" in result.stderr
    assert "If these are millimeters, write the unit" in result.stderr
    assert result.stderr.count("\n") == 1
    assert track(tmp_path, name, form.format("1.5", "0.2")).exit_code == 0


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("path.yaml", YAML.format(1.5, "1.1e6"), "waypoints[1].position is 1.1e+06 m away; allowed: up to 1e+06 m"),
        ("path.yaml", YAML.format(1.5, "-1e30"), "waypoints[1].position is 1e+30 m away; allowed: up to 1e+06 m"),
        ("path.csv", CSV.format(1.5, "1.1e6"), "line 4: x is 1100000 m; allowed: up to 1e+06 m"),
        ("path.csv", CSV.format("-2e7", "1"), "line 2: z is -20000000 m; allowed: up to 1e+06 m"),
    ],
)
def test_no_pose_is_beyond_all_machines(tmp_path: Path, name: str, text: str, told: str) -> None:
    result = track(tmp_path, name, text)
    assert (result.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert told in result.stderr


@pytest.mark.parametrize("timing", ["durations: 0.001", "durations: [1, 0.01]", "durations: 1\nrate: 1e-30"])
def test_a_segment_without_a_sample_is_told(tmp_path: Path, timing: str) -> None:
    text = f"{timing}\nwaypoints: [{{position: [0, 0, 1.5]}}, {{position: [1, 0, 1.5]}}, {{position: [2, 0, 1.5]}}]\n"
    result = track(tmp_path, "path.yaml", text)
    assert (result.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert "than the time from one sample to the next" in result.stderr

"""`sagline workspace`: numbers of the library, files, an empty workspace, loads and boxes as texts."""

import json
import re
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.cli.values import box_of, wrenches_of
from sagline.core.errors import MOST
from tests.tiers import extended


@pytest.fixture(autouse=True)
def folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> FilePath:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, ["workspace", *words])


@extended
def test_the_volume_of_the_article(folder: FilePath) -> None:
    import trimesh

    result = sagline("article-suspended", "--no-figures", "--json")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["volume_m3"] == pytest.approx(789.4, abs=1.0)
    assert 0.0 < found["volume_error_m3"] < 1.0
    assert found["open_faces"] == ["z low"]
    assert sum(limit["share"] for limit in found["limits"]) == pytest.approx(1.0)
    space = sl.load_workspace(folder / "output" / "article-suspended-workspace.nc")
    assert (space.volume, space.volume_error) == (found["volume_m3"], found["volume_error_m3"])
    hull: Any = trimesh.load(folder / "output" / "article-suspended-hull.glb", force="mesh")
    assert np.ptp(hull.vertices, axis=0).max() == pytest.approx(np.ptp(space.surface.vertices, axis=0).max(), rel=1e-6)


@extended
def test_options_are_arguments() -> None:
    words = ["--wrench", "±50 N, ±5 N m, ±0.5 m/s^2", "--tilt", "5deg", "--max-sag", "30 cm", "--clearance", "1 mm"]
    words.append("--no-figures")  # 27 rotations and all criteria take most of a minute
    result = sagline(
        "cogiro", *words, "--box", "-4..4, -3..3, 1..4 m", "--cells", "4", "--payload", "10 kg", "--model", "elastic",
        "--reserve", "10", "--min-stiffness", "1000", "--min-frequency", "0.5 Hz", "--in-frame", "--json",
    )  # fmt: skip
    assert result.exit_code == 0, result.stderr
    robot = sl.load_robot("cogiro")
    heavy = robot.replace(mass=robot.mass + 10.0, inertia=robot.inertia * (1.0 + 10.0 / robot.mass))
    space = sl.workspace(
        heavy,
        sl.PoseBox([-4, -3, 1], [4, 3, 4]),
        sl.WrenchBox(50.0, 5.0) + sl.Accelerations(linear=0.5),
        orientations=sl.Tilts(np.radians(5.0)),
        criteria=[
            sl.LeastMargin(10.0),
            sl.MaximumSag(0.3),
            sl.LeastStiffness(1000.0),
            sl.LeastFrequency(0.5),
            sl.Clearance(0.001),
            sl.InFrame(),
        ],
        model=sl.Elastic(),
        cells=4,
    )
    found = json.loads(result.stdout)
    assert found["volume_m3"] == pytest.approx(space.volume, rel=1e-9)
    assert found["criteria"] == [str(one) for one in space.criteria]
    assert re.search(r"\b27 sampled\b.* 5°$", found["orientations"])


def test_outputs(folder: FilePath) -> None:
    result = sagline("article-suspended", "--cells", "6", "--no-figures")
    assert result.exit_code == 0, result.stderr
    lines = [" ".join(line.split()) for line in result.stdout.splitlines()]
    space = sl.load_workspace(folder / "output" / "article-suspended-workspace.nc")
    assert f"volume {space.volume:.0f} ± {space.volume_error:.0f} m³" in lines
    assert any(line.startswith("open ") and "z low" in line for line in lines)
    first = space.limits[0]
    assert f"{100.0 * first.share:.1f} margin {first.cable}" in lines


@extended
def test_proved_and_unproved_volumes() -> None:
    words = ["--cells", "4", "--no-figures", "--json", "--prove"]
    inside = sagline("article-suspended", *words, "-1..1, -1..1, 2..2.5 m")
    assert inside.exit_code == 0, inside.stderr
    proof = json.loads(inside.stdout)["proof"]
    assert (proof["verdict"], proof["share_inside"]) == ("PROVED_INSIDE", 1.0)
    assert (proof["box_low_m"], proof["box_high_m"]) == ([-1.0, -1.0, 2.0], [1.0, 1.0, 2.5])
    outside = sagline("article-suspended", *words, "8..9, 8..9, 7..8 m")
    assert outside.exit_code == 1
    assert json.loads(outside.stdout)["proof"]["share_inside"] == 0.0


@extended
def test_obstacles(folder: FilePath) -> None:
    (folder / "own.yaml").write_text(
        sl.dump_robot(sl.load_robot("article-suspended"))
        + "scene:\n  - {name: wall, box: [0.2, 12, 1.0], center: [1, 0, 0.5]}\n"
    )
    words = ["--box", "-3..4, -1..1, 0.3..0.9 m", "--cells", "8", "--no-figures", "--json", "--clearance", "5 cm"]
    own, other, none = (
        sagline(*robot, *words)
        for robot in (["own.yaml"], ["article-suspended", "--scene", "own.yaml"], ["article-suspended"])
    )
    volumes = [len(json.loads(result.stdout)["components_m3"]) for result in (own, other, none)]
    assert volumes == [2, 2, 1]
    counts = [re.findall(r"\(.*\)", json.loads(result.stdout)["criteria"][-1]) for result in (own, other, none)]
    assert counts == [["(1 obstacle)"], ["(1 obstacle)"], ["(0 obstacles)"]]


@extended
def test_a_robot_file_of_any_name_has_its_scene_and_a_mesh_is_counted(folder: FilePath) -> None:
    import trimesh

    text = sl.dump_robot(sl.load_robot("article-suspended"))
    scene = "scene:\n  - {name: wall, box: [0.2, 12, 1.0], center: [1, 0, 0.5]}\n"
    (folder / "machine").write_text(text + scene)
    (folder / "plain.yaml").write_text(text)
    (folder / "block.stl").write_bytes(trimesh.creation.box((0.2, 0.2, 0.2)).export(file_type="stl"))
    words = ["--box", "-1..1, -1..1, 2..3 m", "--cells", "4", "--no-figures", "--json", "--clearance", "5 cm"]
    assert "(1 obstacle)" in sagline("machine", *words).stdout
    assert "(1 obstacle, 12 triangles)" in sagline("article-suspended", *words, "--scene", "block.stl").stdout
    for scene in ("plain.yaml", "cogiro"):
        result = sagline("article-suspended", *words, "--scene", scene)
        assert result.exit_code == 2
        assert f"{scene}: has no scene. " in result.stderr


def test_an_empty_workspace_prints_the_nearest_pose(folder: FilePath) -> None:
    result = sagline("article-suspended", "--wrench", "±5 kN", "--cells", "4", "--json")
    assert result.exit_code == 1
    assert "Empty workspace: " in result.stderr
    assert re.search(r"\b\d+ % .*\bkN\b", result.stderr)
    found = json.loads(result.stdout)
    assert found["volume_m3"] == 0.0
    assert found["nearest"]["cables"]
    assert [file.name for file in (folder / "output").iterdir()] == ["article-suspended-workspace.nc"]


@pytest.mark.parametrize(
    ("text", "loads"),
    [
        ("±100 N, ±20 N m", sl.WrenchBox(100.0, 20.0)),
        ("±100 N, ±20Nm", sl.WrenchBox(100.0, 20.0)),
        ("+-1 N,+/-2 N, ± 3N", sl.WrenchBox([1.0, 2.0, 3.0])),
        ("±0.1 kN, ±2 m/s^2, ±1 rad/s^2", sl.WrenchBox(100.0) + sl.Accelerations(linear=2.0, angular=1.0)),
        ("0,0,-50", sl.WrenchPolytope([[0.0, 0.0, -50.0, 0.0, 0.0, 0.0]])),
    ],
)
def test_loads(text: str, loads: sl.WrenchSet) -> None:
    found = wrenches_of(text, "--wrench")
    for name in ("center", "segments", "corners", "accelerations"):
        np.testing.assert_allclose(getattr(found, name), getattr(loads, name), rtol=1e-15, atol=0.0)


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("-2..2, -1..1, 1..3 m", [-2, -1, 1], [2, 1, 3]),
        ("-.5...5,0..1e1,2", [-0.5, 0, 2], [0.5, 10, 2]),
        ("−20 cm..20 cm, 0..1 m, 3", [-0.2, 0, 3], [0.2, 1, 3]),
        ("0 to 500, 0 to 500, 0 to 100 mm", [0, 0, 0], [0.5, 0.5, 0.1]),
    ],
)
def test_boxes(text: str, low: list[float], high: list[float]) -> None:
    box = box_of(text, "--box")
    np.testing.assert_allclose([box.low, box.high], [low, high], rtol=1e-15, atol=0.0)


@pytest.mark.parametrize(
    "words",
    [
        ["--wrench", "±100"],
        ["--wrench", "±1 N, ±2 N"],
        ["--wrench", "±1 m/s^2, ±1 m/s^2, ±1 m/s^2"],
        ["--wrench", "±-1 N"],
        ["--wrench", "±nan N"],
        ["--wrench", "1 N, ±2 N"],
        ["--wrench", "±5 kg"],
        ["--box", "1..2, 3"],
        ["--box", "2..1, 0..1, 0..1"],
        ["--box", "0..1e9, 0..1, 0..1"],
        ["--box", "0..1, 0..1, 0..1 kg"],
        ["--box", "0..0, 0..0, 0..1"],
        ["--tilt", "10 N"],
        ["--tilt", "4"],
        ["--max-sag", "0"],
        ["--cells", "3"],
        ["--cells", "1000"],
    ],
)
def test_refusals(words: list[str], folder: FilePath) -> None:
    result = sagline("cogiro", *words, "--no-figures")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert len(result.stderr) < MOST + 10
    assert not (folder / "output").exists()

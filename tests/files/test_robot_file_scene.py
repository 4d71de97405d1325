from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused

HEAD = "base: cogiro\nname: mine\n"
SCENE = """scene:
  - {name: table, box: [1.2, 0.8, 70 cm], center: [2, 0, 0.35], turned: 30 deg}
  - {name: pole, capsule: [[1, 0, 0], [1, 0, 3]], radius: 5 cm}
  - {name: lamp, sphere: [0, 0, 2.8], radius: 20 cm}
  - {name: hall, mesh: meshes/hall.stl, unit: mm, position: [0, 0, -1], turned: 90 deg}
"""


def robot_file(folder: Path, scene: str) -> Path:
    if "hall.stl" in scene:
        import trimesh

        (folder / "meshes").mkdir(exist_ok=True)
        trimesh.creation.box((1000.0, 2000.0, 3000.0)).export(folder / "meshes" / "hall.stl")
    file = folder / "mine.yaml"
    file.write_text(HEAD + scene, encoding="utf-8")
    return file


def test_a_scene_is_read_with_its_units_and_mesh_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")  # paths are relative to the file
    table, pole, lamp, hall = sl.load_scene(robot_file(tmp_path, SCENE))
    assert isinstance(table, sl.Box)
    assert table.size == pytest.approx([1.2, 0.8, 0.7])
    assert table.orientation[:2, 0] == pytest.approx([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    assert isinstance(pole, sl.Capsule)
    assert (pole.radius, pole.end.tolist(), pole.name) == (0.05, [1.0, 0.0, 3.0], "pole")
    assert isinstance(lamp, sl.Sphere)
    assert lamp.radius == 0.2
    assert isinstance(hall, sl.Mesh)
    assert hall.bounds == pytest.approx(np.array([[-1.0, -0.5, -2.5], [1.0, 0.5, 0.5]]))


def test_a_robot_does_not_contain_its_scene(tmp_path: Path) -> None:
    file = robot_file(tmp_path, SCENE)
    robot = sl.load_robot(file)
    assert "scene" not in sl.dump_robot(robot)
    assert sl.load_scene(robot_file(tmp_path, "")) == ()
    state = sl.inverse(robot, sl.Pose([1.0, 0.5, 1.5], np.eye(3))).state
    found = sl.clearance(state, sl.load_scene(robot_file(tmp_path, SCENE)))
    assert {"table", "pole", "lamp", "hall"} < {name for pair in found.pairs for name in pair}


@pytest.mark.parametrize(
    ("scene", "parts"),
    [
        ("3", ("scene", "3", "a valid list")),
        ("[3]", ("scene[0]", "3", "keys name, box, center, capsule, sphere, radius, mesh, unit, position, turned")),
        ("[{name: a}]", ("scene[0]", "none of them", "one of box, capsule, sphere, mesh")),
        ("[{name: a, box: [1, 2, 3], sphere: [1, 2, 3]}]", ("scene[0]", "box and sphere")),
        ("[{box: [1, 2, 3]}]", ("scene[0].name", "missing")),
        ("[{name: '', box: [1, 2, 3]}]", ("scene[0].name", "empty")),
        ("[{name: a, bx: [1, 2, 3]}]", ("scene[0].bx", "an unknown key", None, "Did you mean box?")),
        ("[{name: a, box: [1, 2]}]", ("scene[0].box", "of shape (2,)")),
        ("[{name: a, box: [1, 2, 3 kg]}]", ("scene[0].box[2]", "'3 kg'")),
        ("[{name: a, sphere: [1, 2, 3]}]", ("scene[0].radius", "missing")),
        ("[{name: a, sphere: [1, 2, 3], radius: -1}]", ("scene[0].radius", "-1 m")),
        ("[{name: a, sphere: [1, 2, 3], radius: 1, unit: mm}]", ("scene[0].unit", "given for a sphere")),
        ("[{name: a, box: [1, 2, 3], turned: 1 m}]", ("scene[0].turned", "'1 m'")),
        ("[{name: a, mesh: a.stl, unit: kg}]", ("scene[0].unit", "'kg'")),
        ("[{name: a, mesh: 3}]", ("scene[0].mesh", "3")),
    ],
)
def test_an_invalid_scene_is_refused_by_both_readers(tmp_path: Path, scene: str, parts: tuple[str, ...]) -> None:
    file = robot_file(tmp_path, f"scene: {scene}\n")
    for load in (sl.load_robot, sl.load_scene):
        with refused(*parts, kind=sl.FileError, file=file) as error:
            load(file)
        assert len(str(error.value)) < 300


def test_a_missing_mesh_is_an_error_of_the_scene_only(tmp_path: Path) -> None:
    file = robot_file(tmp_path, "scene: [{name: a, mesh: missing.stl}]\n")
    assert sl.load_robot(file).cable_count == 8
    with refused(kind=sl.FileError, file=tmp_path / "missing.stl"):
        sl.load_scene(file)

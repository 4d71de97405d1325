from __future__ import annotations

import re
import warnings
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.files import mesh_file
from sagline.files.mesh_file import _first_crossing
from tests.files.wording import wording
from tests.interference.scenes import box_mesh
from tests.refusal import refused
from tests.tiers import extended

if TYPE_CHECKING:
    import trimesh


def written(folder: Path, mesh: trimesh.Trimesh, name: str) -> Path:
    file = folder / name
    mesh.export(file)
    return file


def overlapping() -> trimesh.Trimesh:
    import trimesh

    boxes = [trimesh.creation.box((1.0, 1.0, 1.0)) for _ in range(2)]
    boxes[1].apply_translation([0.5, 0.25, 0.125])
    whole = trimesh.util.concatenate(boxes)
    assert isinstance(whole, trimesh.Trimesh)
    return whole


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "glb"])
def test_meshes_of_every_kind_are_read_in_meters_with_z_up(tmp_path: Path, kind: str) -> None:
    import trimesh

    mesh = trimesh.creation.annulus(0.5, 1.0, 3.0)
    file = written(tmp_path, mesh, f"ring.{kind}")
    found = sl.load_mesh(file, unit="cm")
    assert found.name == "ring"
    assert found.volume == pytest.approx(mesh.volume * 1e-6, rel=1e-6)
    tall = 1 if kind == "glb" else 2  # y is up in a GLB, which this call does not say
    assert np.ptp(found.bounds, axis=0)[tall] == pytest.approx(0.03, abs=1e-8)
    assert found.encloses([0.0, 0.0, 0.0]) == np.False_


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "glb"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e38, -1e10, 1.001e7])
def test_corners_that_are_not_finite_are_refused_without_a_warning(tmp_path: Path, kind: str, value: float) -> None:
    import trimesh

    box = trimesh.creation.box((1.0, 1.0, 1.0))
    for corners in (np.where(np.arange(8)[:, None] == 3, value, box.vertices), value * box.vertices):
        with warnings.catch_warnings():  # a warning of the writer
            warnings.simplefilter("ignore")
            file = written(tmp_path, trimesh.Trimesh(corners, box.faces, process=False), f"box.{kind}")
        with pytest.raises(sl.FileError, match=r"numbers|1e\+06"):
            sl.load_mesh(file)


def test_the_limit_of_coordinates_depends_on_the_unit(tmp_path: Path) -> None:
    import trimesh

    file = written(tmp_path, trimesh.creation.box((3e6, 1.0, 1.0)), "box.stl")
    assert np.ptp(sl.load_mesh(file, unit="mm").bounds, axis=0)[0] == 3000.0
    with pytest.raises(sl.FileError, match=r"1\.5e\+06"):
        sl.load_mesh(file)


@pytest.mark.parametrize(
    ("face", "line"),
    [("f 0 1 2", 9), ("f 1/1 2/2 0/3", 9), (" f\t3 00 1", 9), ("f 1 2 -0", 9), ("f 1 2 3\r\nf 0 2 3", 10)],
)
def test_faces_of_an_obj_have_indices_from_one(tmp_path: Path, face: str, line: int) -> None:
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 -1\n"
    file = tmp_path / "wedge.obj"
    file.write_text(corners + faces, newline="")
    assert sl.load_mesh(file).volume == pytest.approx(1.0 / 6.0)
    file.write_text(corners + faces + face, newline="")
    with pytest.raises(sl.FileError, match=f"corner 0 .* {line};"):
        sl.load_mesh(file)


def test_a_glb_is_read_with_its_y_axis_up(tmp_path: Path) -> None:
    """(x, y, z) of glTF is (x, -z, y) here: the box distinguishes top from bottom and front from back."""
    import trimesh

    box = trimesh.creation.box(bounds=[(1.0, 2.0, 3.0), (1.5, 2.6, 3.7)])
    found = sl.load_mesh(written(tmp_path, box, "scene.glb"))
    np.testing.assert_allclose(found.bounds, [(1.0, -3.7, 2.0), (1.5, -3.0, 2.6)], atol=1e-6)
    assert found.volume == pytest.approx(0.5 * 0.6 * 0.7, rel=1e-6)


def test_meshes_that_are_open_or_cross_themselves_are_refused_with_their_extent(tmp_path: Path) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(2)
    ball.update_faces(np.arange(len(ball.faces)) != 3)
    for mesh, name, facts in (
        (ball, "open.stl", r"3 edges of 319 triangles.* 2 x 2 x 2 m"),
        (overlapping(), "crossing.stl", r"crosses.*\(.*\) m, 1.5 x 1.25 x 1.125 m"),
    ):
        with refused(kind=sl.FileError, file=tmp_path / name) as caught:
            sl.load_mesh(written(tmp_path, mesh, name))
        assert re.search(facts, caught.value.reason)


def test_points_of_self_intersection_are_on_both_surfaces() -> None:
    mesh = overlapping()
    point = _first_crossing(sl.Mesh(mesh.vertices, mesh.faces))
    assert point is not None
    for low in ((-0.5, -0.5, -0.5), (0.0, -0.25, -0.375)):  # of each box
        assert (point >= np.array(low) - 1e-9).all()
        assert (point <= np.array(low) + 1.0 + 1e-9).all()
    assert _first_crossing(box_mesh([1, 2, 3], [0, 0, 0])) is None


def test_larger_meshes_are_not_searched_for_crossings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_file, "CHECKED", 23)
    assert len(sl.load_mesh(written(tmp_path, overlapping(), "crossing.stl")).faces) == 24


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("garbage.stl", b"garbage" * 40),
        ("garbage.glb", b"garbage" * 40),
        ("empty.stl", b""),
        ("short.obj", b"v 1 2\nf 1 2 3\n"),
        ("short.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n"),
        ("part.step", b""),
    ],
    ids=["garbage STL", "garbage GLB", "empty STL", "short OBJ", "short PLY", "STEP"],
)
def test_other_files_are_refused(tmp_path: Path, name: str, content: bytes, snapshot: SnapshotAssertion) -> None:
    (tmp_path / name).write_bytes(content)
    with refused(kind=sl.FileError, file=tmp_path / name) as caught:
        sl.load_mesh(tmp_path / name)
    assert re.sub(r"\(.*\)", "(the library's words)", wording(caught.value, tmp_path)) == snapshot
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("unit", ["kg", "", "5 mm", "parsnip"])
def test_invalid_units_of_length_are_refused(tmp_path: Path, unit: str) -> None:
    import trimesh

    file = written(tmp_path, trimesh.creation.box(), "box.stl")
    with refused("unit", kind=sl.InvalidValueError):
        sl.load_mesh(file, unit)


@extended
@pytest.mark.parametrize("cases", [40, pytest.param(2000, marks=pytest.mark.soak)])
def test_damaged_mesh_files_are_refused_or_read(tmp_path: Path, cases: int) -> None:
    import trimesh

    rng = np.random.default_rng(2)
    whole = {kind: trimesh.creation.icosphere(1).export(file_type=kind) for kind in ("stl", "ply", "obj", "glb")}
    for case in range(cases):
        kind = str(rng.choice(list(whole)))
        data = whole[kind]
        damaged = bytearray(data.encode() if isinstance(data, str) else data)
        for _ in range(int(rng.integers(1, 6))):
            damaged[int(rng.integers(len(damaged)))] = int(rng.integers(256))
        if rng.random() < 0.3:
            damaged = damaged[: int(rng.integers(len(damaged)))]
        file = tmp_path / f"damaged{case}.{kind}"
        file.write_bytes(bytes(damaged))
        with suppress(sl.FileError):
            assert np.isfinite(sl.load_mesh(file).vertices).all()

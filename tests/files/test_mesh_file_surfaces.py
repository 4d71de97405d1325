import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sagline as sl
from sagline import Surface
from sagline.files import mesh_file
from tests.interference.scenes import box_mesh
from tests.refusal import refused

BOX = box_mesh([0.6, 0.8, 1.0], [0.1, 0.2, 0.3])
SURFACE = Surface(BOX.vertices, BOX.faces)


@pytest.mark.parametrize("ending", ["stl", "glb", "ply"])
def test_a_loaded_surface_has_the_same_volume_and_is_closed(ending: str, tmp_path: Path) -> None:
    import trimesh

    file = tmp_path / f"hull.{ending.upper()}"
    SURFACE.export(file)
    read = trimesh.load_mesh(file)
    assert isinstance(read, trimesh.Trimesh)
    assert read.is_watertight
    assert read.volume == pytest.approx(SURFACE.volume, rel=1e-6)
    low, high = SURFACE.vertices.min(axis=0), SURFACE.vertices.max(axis=0)
    if ending == "glb":  # glTF has y up: (x, y, z) is (x, z, -y) there
        low, high = np.array([low[0], low[2], -high[1]]), np.array([high[0], high[2], -low[1]])
    assert_allclose(read.bounds, [low, high], atol=1e-6)
    assert_allclose(read.bounds[:, 1 if ending == "glb" else 2], [-0.2, 0.8], atol=1e-6)
    assert [part.name for part in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("distance", [1e-9, 1e-30])
def test_stl_has_no_degenerate_triangles_after_rounding(distance: float, tmp_path: Path) -> None:
    import trimesh

    vertices = np.array([[1, 0, 0], [1, distance, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 3], [1, 3, 2]])
    shape = Surface(vertices, faces)
    assert shape.closed
    shape.export(tmp_path / "wedge.stl")
    read = trimesh.load_mesh(tmp_path / "wedge.stl")
    assert isinstance(read, trimesh.Trimesh)
    assert len(read.faces) == 4
    assert read.is_watertight


@pytest.mark.parametrize("ending", ["vtk", "vtu"])
def test_vtk_is_written_by_an_installed_package(ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Mesh:
        def __init__(self, points: np.ndarray, cells: list[tuple[str, np.ndarray]]) -> None:
            self.text = f"{points.shape} {cells[0][0]} {cells[0][1].shape}"

        def write(self, file: str, file_format: str) -> None:
            Path(file).write_text(f"{file_format} {self.text}")

    class PolyData(Mesh):
        def __init__(self, points: np.ndarray, faces: np.ndarray) -> None:
            super().__init__(points, [("triangle", faces.reshape(-1, 4)[:, 1:])])

        def cast_to_unstructured_grid(self) -> "PolyData":
            return self

        def save(self, file: str) -> None:
            self.write(file, Path(file).suffix[1:])

    expected = f"{ending} {SURFACE.vertices.shape} triangle {SURFACE.faces.shape}"
    for name, kind in (("meshio", Mesh), ("pyvista", PolyData)):
        package = ModuleType(name)
        setattr(package, kind.__name__, kind)
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, name, package)
            patch.setattr(mesh_file, "find_spec", lambda asked, name=name: name if asked == name else None)
            SURFACE.export(tmp_path / f"hull.{ending}")
        assert (tmp_path / f"hull.{ending}").read_text() == expected
        (tmp_path / f"hull.{ending}").unlink()
        assert not list(tmp_path.iterdir())


def test_errors_are_reported_and_the_existing_file_is_unchanged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with refused(next_step="Use .stl, .glb, .ply, .vtk, .vtu.", kind=sl.FileError, file=tmp_path / "hull.obj"):
        SURFACE.export(tmp_path / "hull.obj")
    monkeypatch.setattr(mesh_file, "find_spec", lambda _: None)
    old = tmp_path / "hull.vtk"
    old.write_text("old")
    with refused(kind=sl.FileError, file=old) as caught:
        SURFACE.export(old)
    assert "PyVista" in caught.value.reason
    assert old.read_text() == "old"
    with refused(kind=sl.FileError, file=tmp_path / "none" / "hull.stl") as caught:
        SURFACE.export(tmp_path / "none" / "hull.stl")
    assert f"{tmp_path / 'none'}" in caught.value.next_step
    with refused("surface", "empty", kind=sl.InvalidValueError):
        Surface(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)).export(tmp_path / "hull.stl")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with refused(kind=sl.FileError, file="package trimesh") as caught:
        SURFACE.export(tmp_path / "hull.stl")
    assert "sagline[workspace]" in caught.value.next_step
    assert [part.name for part in tmp_path.iterdir()] == ["hull.vtk"]

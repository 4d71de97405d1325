import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from trimesh.visual.color import ColorVisuals

import sagline as sl
from sagline.files import surface_file
from sagline.files.surface_file import save_surface
from sagline.workspaces.boundary import boundary
from sagline.workspaces.surface import Surface
from tests.workspaces.shapes import brick

SURFACE = boundary(brick([0.1, 0.2, 0.3], [0.3, 0.4, 0.5]), [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], cells=8).surface


@pytest.mark.parametrize("ending", ["stl", "glb", "ply"])
def test_what_is_read_back_has_the_same_volume_and_is_closed(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"hull.{ending.upper()}"
    SURFACE.export(file)
    read = trimesh.load_mesh(file)
    assert isinstance(read, trimesh.Trimesh)
    assert read.is_watertight
    assert read.volume == pytest.approx(SURFACE.volume, rel=1e-6)
    up = {"glb": 1}.get(ending, 2)  # glTF has y up
    assert_allclose(read.bounds[:, up], [-0.2, 0.8], atol=1e-6)
    assert [part.name for part in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("distance", [1e-9, 1e-30])
def test_stl_has_no_triangle_that_its_numbers_flatten(distance: float, tmp_path: Path) -> None:
    vertices = np.array([[1, 0, 0], [1, distance, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 3], [1, 3, 2]])
    shape = Surface(vertices, faces)
    assert shape.closed
    shape.export(tmp_path / "wedge.stl")
    read = trimesh.load_mesh(tmp_path / "wedge.stl")
    assert isinstance(read, trimesh.Trimesh)
    assert len(read.faces) == 4
    assert read.is_watertight


@pytest.mark.parametrize("ending", ["glb", "ply"])
def test_colors_of_vertices_are_there(ending: str, tmp_path: Path) -> None:
    colors = np.random.default_rng(2).integers(0, 256, (len(SURFACE.vertices), 3))
    save_surface(SURFACE, tmp_path / f"hull.{ending}", colors)
    read = trimesh.load_mesh(tmp_path / f"hull.{ending}", process=False)
    assert isinstance(read, trimesh.Trimesh)
    assert isinstance(read.visual, ColorVisuals)
    assert_allclose(np.asarray(read.visual.vertex_colors)[:, :3], colors)


@pytest.mark.parametrize("ending", ["vtk", "vtu"])
def test_vtk_is_left_to_the_package_that_is_installed(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
            patch.setattr(surface_file, "find_spec", lambda asked, name=name: name if asked == name else None)
            SURFACE.export(tmp_path / f"hull.{ending}")
        assert (tmp_path / f"hull.{ending}").read_text() == expected
        (tmp_path / f"hull.{ending}").unlink()
        assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_is_said_and_what_was_there_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(sl.FileError, match=r"hull\.obj: has an ending.*\.stl, \.glb, \.ply, \.vtk, \.vtu"):
        SURFACE.export(tmp_path / "hull.obj")
    monkeypatch.setattr(surface_file, "find_spec", lambda _: None)
    old = tmp_path / "hull.vtk"
    old.write_text("old")
    with pytest.raises(sl.FileError, match="needs meshio or PyVista"):
        SURFACE.export(old)
    assert old.read_text() == "old"
    with pytest.raises(sl.FileError, match="Create the folder"):
        SURFACE.export(tmp_path / "none" / "hull.stl")
    with pytest.raises(sl.InvalidValueError, match="surface is empty"):
        Surface(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)).export(tmp_path / "hull.stl")
    for wrong in ([[0, 0, 300]], np.zeros((len(SURFACE.vertices), 3)), np.full((len(SURFACE.vertices), 3), 256)):
        with pytest.raises(sl.InvalidValueError, match="colors is of"):
            save_surface(SURFACE, tmp_path / "hull.ply", wrong)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(sl.FileError, match=r"trimesh: is not installed.*sagline\[workspace\]"):
        SURFACE.export(tmp_path / "hull.stl")
    assert [part.name for part in tmp_path.iterdir()] == ["hull.vtk"]

"""Surfaces as files that other programs read: STL, GLB and PLY, and VTK where a package for it is installed."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import file_path
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.whole import check_file, written_whole
from sagline.workspaces.surface import Indices, Surface

ENDINGS: Final = (".stl", ".glb", ".ply", ".vtk", ".vtu")
_VTK: Final = (".vtk", ".vtu")


def save(surface: Surface, file: Path | str, colors: ArrayLike | None = None) -> None:
    """Write a surface to a file, whole or not at all, in meters.

    Args:
        surface: The surface.
        file: The file; its ending says what it becomes: .stl, .glb (y up, as that format wants it), .ply, .vtk or
            .vtu (meshio or PyVista writes these). One that exists is replaced.
        colors: Red, green, blue of each vertex, 0 to 255, shape (V, 3); GLB and PLY have them.

    Raises:
        FileError: If the ending is another, a package is missing, or the file cannot be written; what was there
            before is untouched.
        InvalidValueError: If there is nothing to write, or the colors are not of that shape.
    """
    target = file_path(file)
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        raise FileError(target, "has an ending that no surface is written with", f"Take {', '.join(ENDINGS)}.")
    if not len(surface.faces):
        raise InvalidValueError("surface", "empty", "a surface with triangles", "Look for the set elsewhere.")
    tints = None if colors is None else _checked(colors, len(surface.vertices))
    check_file(target)
    content = None if ending in _VTK else _by_trimesh(surface, ending[1:], tints)
    package = _vtk_package(target) if content is None else ""
    with written_whole(target) as partial:
        if content is not None:
            partial.write_bytes(content)
        elif package == "meshio":
            _by_meshio(surface, partial, ending[1:])
        else:
            _by_pyvista(surface, partial, ending)


def _checked(colors: ArrayLike, count: int) -> NDArray[np.uint8]:
    given = np.asarray(colors)
    if given.shape != (count, 3) or given.dtype.kind not in "ui" or given.min() < 0 or given.max() > 255:
        found = f"of {given.dtype}, shape {given.shape}"
        raise InvalidValueError("colors", found, f"integers 0 to 255, shape ({count}, 3)", "Give red, green, blue.")
    return given.astype(np.uint8)


def _by_trimesh(surface: Surface, kind: str, colors: NDArray[np.uint8] | None) -> bytes:
    try:
        import trimesh
    except ModuleNotFoundError:
        raise FileError.not_installed("trimesh", "Surfaces need it", "workspace") from None
    vertices, faces = surface.vertices, surface.faces
    if kind == "stl":  # has triangles alone: corners that are one in its 24 bits are one to who reads it
        vertices, faces = _in_single_precision(vertices, faces)
    if kind == "glb":
        vertices = np.stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]], axis=1)
    shades: Any = None if colors is None else np.column_stack([colors, np.full(len(colors), 255, dtype=np.uint8)])
    mesh = trimesh.Trimesh(vertices, faces, vertex_colors=shades, process=False)
    return bytes(mesh.export(file_type=kind))  # type: ignore[arg-type]


def _in_single_precision(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Vertices rounded, the same ones as one, and no triangle that this flattens."""
    rounded, place = np.unique(np.round(vertices, 7).astype(np.float32), axis=0, return_inverse=True)
    faces = place.reshape(-1)[faces]
    return rounded.astype(np.float64), faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]


def _vtk_package(file: Path) -> str:
    for name in ("meshio", "pyvista"):
        if find_spec(name) is not None:
            return name
    step = "Install one (pip install meshio), or write .stl, .glb or .ply."
    raise FileError(file, "needs meshio or PyVista, neither of which is installed", step)


def _by_meshio(surface: Surface, file: Path, kind: str) -> None:
    import meshio

    meshio.Mesh(surface.vertices, [("triangle", surface.faces)]).write(str(file), file_format=kind)


def _by_pyvista(surface: Surface, file: Path, ending: str) -> None:
    import pyvista

    named = file.with_name(f"{file.name}{ending}")  # it goes by the ending
    faces = np.column_stack([np.full(len(surface.faces), 3), surface.faces])
    mesh = pyvista.PolyData(surface.vertices, faces.ravel())
    (mesh if ending == ".vtk" else mesh.cast_to_unstructured_grid()).save(str(named))
    os.replace(named, file)

"""Triangle meshes in the file formats of other programs: reading of closed solids, writing of surfaces."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline.core.arguments import brief, file_path, label
from sagline.core.arrays import Array, Indices
from sagline.core.errors import FileError, InvalidValueError, SaglineError, needed_packages
from sagline.files.quantity import in_si
from sagline.files.reading import read_bytes, value_errors
from sagline.files.writing import atomic_file, check_file
from sagline.interference.obstacles import MOST, Mesh, check_coordinates, extent_text
from sagline.workspaces.surface import Surface

LIMIT: Final = 200.0  # largest size of a file [MB]
CHECKED: Final = 20_000  # largest number of triangles for which self-intersections are searched
_MEANT: Final = "Check that it is the file you mean."
_CORNER_ZERO: Final = re.compile(rb"^[ \t]*f[ \t](?:.*[ \t])?[+-]?0+(?=[/\s]|\Z)", re.MULTILINE)
KINDS: Final = (".stl", ".ply", ".obj", ".glb")
_CONTACTS: Final = 40  # largest number of contacts that are searched per triangle; most contacts are with neighbors
_UPRIGHT: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # from z up to y up, as in glTF
ENDINGS: Final = (".stl", ".glb", ".ply", ".vtk", ".vtu")
_VTK: Final = (".vtk", ".vtu")


def load_mesh(file: str | os.PathLike[str], unit: str = "m", name: str | None = None) -> Mesh:
    """Read a solid from a file. The solid is an obstacle around a robot, or a platform.

    Args:
        file: STL, PLY, OBJ or GLB file with at most 200 MB and a million triangles. z points up. In a GLB file y points
            up by its standard, so that such a mesh is rotated.
        unit: Unit of the coordinates, for example "mm"; files of these formats do not contain the unit.
        name: Name; None: the name of the file.

    Returns:
        Mesh, in meters.

    Raises:
        FileError: If the file cannot be read. If the surface is not closed, or crosses itself (checked for up to 20,000
            triangles); the message gives the extent of the mesh.
        SaglineError: If trimesh or python-fcl is missing; the message contains the command that installs it.

    Examples:
        >>> import sagline as sl
        >>> hall = sl.load_mesh("hall.stl", unit="mm")  # doctest: +SKIP
    """
    path = file_path(file, "file")
    factor = meters(unit, "unit")
    called = path.stem[:100] if name is None else name
    if path.suffix.lower() not in KINDS:
        raise FileError(path, f"is not a mesh file; allowed: {', '.join(KINDS)}", "Save it in one of these formats.")
    data = read_bytes(path, LIMIT)
    vertices, faces = _triangles(path, data, factor)
    if len(faces) > MOST:
        step = "Simplify the mesh in the program that made it."
        raise FileError(path, f"has {len(faces):,} triangles; allowed: {MOST:,}", step)
    with value_errors(path):
        mesh = Mesh(vertices, faces, called)
    if len(faces) <= CHECKED and (crossing := _first_crossing(mesh)) is not None:
        where = ", ".join(f"{value:.4g}" for value in crossing)
        reason = f"crosses itself at ({where}) m, {extent_text(mesh.vertices)}; allowed: a simple surface"
        raise FileError(path, reason, "Unite the parts in the program that made them, or load the parts one by one.")
    return mesh


def meters(unit: str, item: str) -> float:
    """Length of `unit` [m]; raise InvalidValueError if `unit` is not a unit of length."""
    try:
        factor = in_si(f"1 {label(unit, item)}", "m", item)
    except InvalidValueError:
        factor = 0.0
    if not isinstance(factor, float) or not factor > 0.0:
        raise InvalidValueError(item, brief(unit), "a unit of length: m, mm, cm, inch", "Give the unit of the file.")
    return factor


def _triangles(path: Path, data: bytes, unit: float) -> tuple[Array, Indices]:
    """Distinct vertices [m] and non-degenerate triangles of a file. `unit`: length unit of the file [m]."""
    with needed_packages("Meshes need it", "workspace"):
        import trimesh
    kind = path.suffix.lower()[1:]
    if kind == "obj" and (zero := _CORNER_ZERO.search(data)):
        line = data.count(b"\n", 0, zero.end()) + 1
        raise FileError(path, f"has a face with corner 0 in line {line}; allowed: from 1, or from -1 back", _MEANT)
    try:
        with np.errstate(all="ignore"):  # the check below refuses coordinates that are not numbers
            read: Any = trimesh.load(BytesIO(data), file_type=kind, force="mesh", process=False, skip_materials=True)
            coordinates = np.asarray(read.vertices, dtype=np.float64) * unit
            if not np.isfinite(coordinates).all():
                raise FileError(path, "contains coordinates that are not numbers", _MEANT)
            with value_errors(path):
                check_coordinates(coordinates)  # coordinates that are too far away for any machine are refused
            read.merge_vertices(merge_tex=True, merge_norm=True)
        vertices, faces = unit * np.array(read.vertices, dtype=np.float64), np.array(read.faces, dtype=np.int64)
    except SaglineError:
        raise
    except Exception as error:  # all errors are caught, because the readers raise many kinds of errors for a wrong file
        reason = " ".join(str(error).split())[:80] or type(error).__name__
        raise FileError(path, f"cannot be read as {kind.upper()} ({reason})", _MEANT) from None
    if not len(faces):
        raise FileError(path, "contains no triangles", _MEANT)
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return (vertices @ _UPRIGHT.T if kind == "glb" else vertices), faces[distinct]


def _first_crossing(mesh: Mesh) -> Array | None:
    """Point [m] where a surface crosses itself, or None. Triangles with a common edge or corner do not cross."""
    from sagline.interference.pairs import package

    fcl = package()
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices), len(mesh.faces))
    model.addSubModel(np.array(mesh.vertices), np.array(mesh.faces))
    model.endModel()
    one, other = (fcl.CollisionObject(model, fcl.Transform()) for _ in range(2))
    request = fcl.CollisionRequest(num_max_contacts=_CONTACTS * len(mesh.faces), enable_contact=True)
    result = fcl.CollisionResult()
    fcl.collide(one, other, request, result)
    pairs = np.array([(contact.b1, contact.b2) for contact in result.contacts], dtype=np.int64).reshape(-1, 2)
    first, second = mesh.faces[pairs[:, 0]], mesh.faces[pairs[:, 1]]
    apart = ~(first[:, :, None] == second[:, None, :]).any(axis=(1, 2))  # pairs without a common corner
    return None if not apart.any() else np.array(result.contacts[int(np.argmax(apart))].pos)


def save(surface: Surface, file: Path | str) -> None:
    """Write a surface to a file atomically, in meters."""
    # file: the suffix selects the format: .stl, .glb (y up, as this format requires), .ply, .vtk or .vtu (the last two
    # need meshio or PyVista). An existing file is replaced
    target = file_path(file)
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        raise FileError(target, "has a suffix that is not a format for surfaces", f"Use {', '.join(ENDINGS)}.")
    if not len(surface.faces):
        raise InvalidValueError("surface", "empty", "a surface with triangles", "Search the set in another box.")
    check_file(target)
    if ending not in _VTK:
        content = _by_trimesh(surface, ending[1:])
        with atomic_file(target) as partial:
            partial.write_bytes(content)
        return
    write = next((write for package, write in _VTK_WRITERS.items() if find_spec(package) is not None), None)
    if write is None:
        step = "Install one (pip install meshio), or write .stl, .glb or .ply."
        raise FileError(target, "needs meshio or PyVista, and both are missing", step)
    with atomic_file(target) as partial:
        write(surface, partial, ending)


def _by_trimesh(surface: Surface, kind: str) -> bytes:
    with needed_packages("Surfaces need it", "workspace"):
        import trimesh
    vertices, faces = surface.vertices, surface.faces
    if kind == "stl":  # STL has no list of vertices; its readers merge corners that are equal in single precision
        vertices, faces = _in_single_precision(vertices, faces)
    if kind == "glb":
        vertices = np.stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]], axis=1)
    return bytes(trimesh.Trimesh(vertices, faces, process=False).export(file_type=kind))  # type: ignore[arg-type]


def _in_single_precision(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Rounded vertices without duplicates, and triangles that are not degenerate after the rounding."""
    rounded, place = np.unique(np.round(vertices, 7).astype(np.float32), axis=0, return_inverse=True)
    faces = place.reshape(-1)[faces]
    return rounded.astype(np.float64), faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]


def _by_meshio(surface: Surface, file: Path, ending: str) -> None:
    import meshio

    meshio.Mesh(surface.vertices, [("triangle", surface.faces)]).write(str(file), file_format=ending[1:])


def _by_pyvista(surface: Surface, file: Path, ending: str) -> None:
    import pyvista

    named = file.with_name(f"{file.name}{ending}")  # PyVista selects the format by the suffix
    faces = np.column_stack([np.full(len(surface.faces), 3), surface.faces])
    mesh = pyvista.PolyData(surface.vertices, faces.ravel())
    (mesh if ending == ".vtk" else mesh.cast_to_unstructured_grid()).save(str(named))
    os.replace(named, file)


_VTK_WRITERS: Final = {"meshio": _by_meshio, "pyvista": _by_pyvista}

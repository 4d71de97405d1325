"""All readers of sagline, each with valid samples of its input."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from hashlib import sha256
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Final

import sagline as sl
from sagline.cli.installation import cache
from sagline.files.execution_file import save_execution
from sagline.kernels.sources import SUFFIX
from sagline.sweep.request import load_sweep
from sagline.twin.injected import fault
from tests.abuse.reading import READERS
from tests.calibration.made_up import made_up
from tests.files.executions import execution
from tests.files.plans import a_plan
from tests.files.simulations import a_simulation

EXAMPLES: Final = Path(__file__).parents[2] / "examples"
SCENE: Final = """base: cogiro
name: mine
scene:
  - {name: table, box: [1.2, 0.8, 70 cm], center: [2, 0, 0.35], turned: 30 deg}
  - {name: pole, capsule: [[1, 0, 0], [1, 0, 3]], radius: 5 cm}
  - {name: lamp, sphere: [0, 0, 2.8], radius: 20 cm}
  - {name: hall, mesh: hall.stl, unit: mm, position: [0, 0, -1], turned: 90 deg}
"""
FAULTS: Final = "cell 3 sticks at 40 s for 2 s"


@dataclass(frozen=True)
class Target:
    """A reader with samples of its input; the changes beyond those of bytes are named by `kind`."""

    name: str  # name of the file
    samples: tuple[bytes, ...]
    read: Callable[[Path], Any]
    kind: str = "text"  # text, binary, hdf5
    beside: dict[str, bytes] = field(default_factory=dict)
    checked: bool = False  # results are computed with

    def written(self, folder: Path, data: bytes) -> Path:
        """Write the input and its accompanying files."""
        for name, content in self.beside.items():
            (folder / name).write_bytes(content)
        file = folder / self.name
        file.write_bytes(data)
        return file


def _saved(save: Callable[[Path], Any], name: str, folder: Path) -> bytes:
    """Bytes that a function writes to a file."""
    save(folder / name)
    return (folder / name).read_bytes()


def _without_digest(data: bytes) -> bytes:
    """An HDF5 file with the size that its header states."""
    return data[: -len("\nsagline sha256 \n") - 64]


def _meshes() -> dict[str, bytes]:
    """Small solids in all formats."""
    import trimesh

    found = {}
    solid = trimesh.creation.icosphere(subdivisions=1, radius=0.7)
    for kind in ("stl", "stl_ascii", "ply", "obj", "glb"):
        stream = BytesIO()
        solid.export(stream, file_type=kind) if kind != "stl_ascii" else stream.write(_ascii(solid).encode())
        found[kind] = stream.getvalue()
    return found


def _ascii(solid: Any) -> str:
    """A solid as STL in text."""
    lines = ["solid ball"]
    for corners in solid.triangles:
        rows = [f"vertex {x:.6g} {y:.6g} {z:.6g}" for x, y, z in corners]
        lines += ["facet normal 0 0 0", "outer loop", *rows, "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid ball", ""])


def _show_cache(file: Path) -> int:
    """Check a folder of kernels with this file."""
    os.environ["NUMBA_CACHE_DIR"] = str(file.parent)
    place = file.parent / "kernels" / "x"
    place.mkdir(parents=True, exist_ok=True)
    (place / file.name).write_bytes(file.read_bytes())
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        return cache(clear=False, as_json=False)


def targets(folder: Path) -> list[Target]:
    """All readers; `folder` is for temporary files."""
    from tests.files.test_workspace_file import space_of

    meshes = _meshes()
    run = _saved(lambda file: save_execution(execution(), file), "run.mcap", folder)
    data = {
        "run.nc": _saved(a_plan().save, "run.nc", folder),
        "sim.nc": _saved(a_simulation().save, "sim.nc", folder),
        "found.nc": _saved(made_up().save, "found.nc", folder),
        "space.nc": _saved(space_of("empty").save, "space.nc", folder),
    }
    loads: dict[str, Callable[[Path], Any]] = {
        "run.nc": sl.load_plan, "sim.nc": sl.load_simulation, "found.nc": sl.load_calibration,
        "space.nc": sl.load_workspace,
    }  # fmt: skip
    found = [Target(each.name, (each.sample.encode(),), each.read, checked=True) for each in READERS]
    found += [
        Target("mine.yaml", (SCENE.encode(),), sl.load_scene, beside={"hall.stl": meshes["stl"]}),
        Target("design.yaml", ((EXAMPLES / "design.yaml").read_bytes(),), sl.load_design),
        Target("sweep.yaml", ((EXAMPLES / "own_sweep.yaml").read_bytes(),), load_sweep, beside=_robots()),
        Target("fault.txt", (FAULTS.encode(), b"group 1 is silent at 20 s", b"cell 2 drifts 5 N/s at 3 s"), _fault),
        Target("run.mcap", (run, run[:-20_000]), sl.load_execution, "binary"),
        Target(f"x{SUFFIX}", (_machine_code(),), _show_cache, "binary"),
    ]
    found += [Target(f"solid.{kind}", (meshes[kind],), sl.load_mesh, "binary") for kind in ("ply", "glb")]
    found += [Target("solid.stl", (meshes["stl"], meshes["stl_ascii"]), sl.load_mesh, "binary")]
    found += [Target("solid.obj", (meshes["obj"],), sl.load_mesh)]
    found += [Target(name, (data[name], _without_digest(data[name])), loads[name], "hdf5") for name in data]
    return found


def _fault(file: Path) -> Any:
    """A fault of the twin, from its text."""
    return fault(file.read_bytes().decode("utf-8", "surrogateescape"))


def _robots() -> dict[str, bytes]:
    """The robot that the sweep of the examples names."""
    return {"own_planar.yaml": (EXAMPLES / "own_planar.yaml").read_bytes()}


def _machine_code() -> bytes:
    """A file of the folder of kernels: a digest and the content."""
    content = bytes(range(256)) * 4
    return sha256(content).digest() + content

"""Small sweeps that several tests run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import sagline as sl
from sagline.sweep import folder as sweep_folder
from sagline.sweep import result as sweep_result
from sagline.sweep.request import variables_of

PLANAR = Path(__file__).parents[2] / "examples" / "own_planar.yaml"


def planar(poses: int = 40, wrenches: int = 25, quantities: tuple[str, ...] = ("tension",)) -> sl.sweep.Request:
    """A planar robot of four cables over its plane, with forces and moments: half of the requests are infeasible."""
    rng = np.random.default_rng(5)
    place = rng.uniform((0.4, 0.0, 0.4), (3.6, 0.0, 2.6), (poses, 3))
    loads = rng.uniform(-80.0, 80.0, (wrenches, 6)) * [1, 0, 1, 0, 0.03, 0]
    return sl.sweep.Request(sl.load_robot(PLANAR), sl.Pose(place, np.eye(3)), loads, quantities)


def in_tasks(folder: Path, request: sl.sweep.Request, size: tuple[int, int]) -> Path:
    """Folder of a sweep with a chosen size of tasks."""
    sweep_folder.make_folder(folder, request, size)
    return folder


def chunks(folder: Path, request: sl.sweep.Request) -> dict[str, tuple[int, int]]:
    """File and time of each chunk on the disk; a rewritten chunk differs."""
    found = {}
    for variable in variables_of(request.quantities):
        for file in sorted((folder / sweep_folder.GROUP / variable.name / "c").rglob("*")):
            if file.is_file():
                found[str(file.relative_to(folder))] = (file.stat().st_mtime_ns, file.stat().st_ino)
    return found


def marked(folder: Path) -> list[int]:
    """Tasks in the file `done`, in its order."""
    lines = (folder / sweep_result.NAME).read_text().splitlines()
    return [int(line.split()[0]) for line in lines if line and not line.startswith("#")]


def bits(found: sl.sweep.Sweep) -> dict[str, bytes]:
    """All numbers of a sweep."""
    return {name: found.values(name).tobytes() for name in found.names}

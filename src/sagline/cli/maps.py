"""`sagline vibrate --map`: lowest frequency and strongest answer all over the robot's test box."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.entries import INVERSE, MODES, VIBRATION
from sagline.cli.results import figure_files, listed, write_figures
from sagline.cli.tables import Grid, show_table, written
from sagline.cli.terminal import note, show, show_json, working
from sagline.core.errors import InvalidValueError
from sagline.dynamics.vibration.frequency_map import frequency_map
from sagline.files.writing import check_files, create_folder, file_stem
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from sagline.dynamics.vibration.dynamic_stiffness import Damping
    from sagline.dynamics.vibration.frequency_map import FrequencyMap
    from sagline.robot.robot import Robot

COUNTS = re.compile(r"([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})")
MOST = 1_000_000  # poses
FIGURES = ("frequency", "peak")
STEP = "Give the points along x, y and z: --map 20x15x8."


class Counts(NamedTuple):
    """Points along x, y and z."""

    x: int
    y: int
    z: int


def counts_of(text: str) -> Counts:
    """Counts of a grid, from "20x15x8".

    Raises:
        InvalidValueError: If it is none, or too large.
    """
    found = COUNTS.fullmatch(text.strip())
    counts = Counts(*map(int, found.groups())) if found else Counts(0, 0, 0)
    if not 0 < counts.x * counts.y * counts.z <= MOST:
        raise InvalidValueError("--map", repr(text), f"NXxNYxNZ, 1 to {MOST:,} poses", STEP)
    return counts


def vibrate_all_over(
    robot: Robot, counts: Counts, limit: float, damping: Damping, folder: Path, *, figures: bool, as_json: bool
) -> int:
    """Work out the map, tell, write and draw it; returns the exit code.

    Raises:
        SaglineError: If the robot names no box of poses, or the folder cannot be written.
    """
    poses = _grid(robot, counts)
    name = file_stem(robot.name, "vibration-map")
    drawn = [f"{name}-{figure}" for figure in FIGURES] if figures else []
    check_files(folder, [f"{name}.nc", *figure_files(drawn)])
    what = f"{robot.name}: modes at {len(poses):,} poses"
    with working(what, INVERSE, VIBRATION, MODES) as line:
        found = frequency_map(robot, poses, up_to=limit, damping=damping, progress=line.progress)
        create_folder(folder)
        files = [folder / f"{name}.nc"]
        found.save(files[0])
        if figures:
            from sagline import plot

            line.stage("drawing")
            pictures = (plot.frequency_map(found, figure) for figure in FIGURES)
            files += write_figures(dict(zip(drawn, pictures, strict=True)), folder)
    known = np.isfinite(found.frequency)
    if as_json:
        show_json({**_record(found), "files": files})
    else:
        if known.any():
            show_table(_table(found))
        show(f"{int(known.sum()):,} of {known.size:,} poses have modes below {limit:g} Hz.")
        show(f"In {folder.resolve()}: {listed(files)}", whole=True)
    if known.any():
        return 0
    note("No modes: ", "no pose of the box is held with a mode below --up-to; raise it", style="bold red")
    return OUTSIDE


def _grid(robot: Robot, counts: Counts) -> Pose:
    """Level poses evenly over the test box, its middle where there is one point."""
    box = robot.test_box
    if box is None:
        raise InvalidValueError("--map", "of a robot that names no box of poses", "one with a test_box", "Add it.")
    axes = [
        np.linspace(low, high, count) if count > 1 else np.array([0.5 * (low + high)])
        for low, high, count in zip(box.low, box.high, counts, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Pose.from_euler(places, 0.0, 0.0, 0.0)


def _table(found: FrequencyMap) -> Grid:
    """Least and greatest of each, and where."""
    rows = []
    for label, values, form in (
        ("lowest, with cable mass [Hz]", found.frequency, ".3f"),
        ("lowest, massless [Hz]", found.massless_frequency, ".3f"),
        ("strongest answer [mm/N]", 1e3 * found.peak, ".3g"),
    ):
        first, last = int(np.nanargmin(values)), int(np.nanargmax(values))
        rows.append([label, *(text for k in (first, last) for text in (written(values[k], form), _place(found, k)))])
    return Grid(["", "least", "at x, y, z [m]", "greatest", "at x, y, z [m]"], rows, found.robot.name)


def _place(found: FrequencyMap, k: int) -> str:
    return ", ".join(written(value, ".2f") for value in found.pose.position[k])


def _record(found: FrequencyMap) -> dict[str, object]:
    return {
        "robot": found.robot.name,
        "up_to_hz": found.up_to,
        "position_m": found.pose.position.tolist(),
        "frequency_with_cable_mass_hz": found.frequency.tolist(),
        "frequency_massless_hz": found.massless_frequency.tolist(),
        "strongest_answer_m_per_n": found.peak.tolist(),
        "strongest_answer_at_hz": found.peak_frequency.tolist(),
    }

"""A 20 MB program in G-code with a payload and a hose that change: time of the print by time of its lengths."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagline as sl
from benchmarks.measure import Row, print_table, process_peak_memory
from tests.files.programs import printed_house

SIZE: Final = 20e6  # [bytes]
SETTINGS: Final[dict[str, Any]] = {"tolerance": 1e-3, "offsets": {"G54": (0.0, 0.0, 1.0)}}
ROBOT: Final = "cogiro"
MATERIAL: Final = (100.0, 20.0, 600.0)  # largest and smallest mass in the hopper [kg], and time to empty it [s]
HOSE: Final = 15.0  # weight of the hose per height above the print [N/m]


def main() -> None:
    """Print the table."""
    print_table("A program of 20 MB", [_print])


def _print() -> Iterator[Row]:
    """A program of 20 MB."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "house.gcode"
        file.write_text("".join(printed_house(SIZE)), encoding="utf-8")
        lines = sum(1 for _ in file.open(encoding="utf-8"))
        start = time.perf_counter()
        samples, end = 0, 0.0
        for part in sl.gcode_parts(file, **SETTINGS):
            samples, end = samples + len(part.path), float(part.path.time[-1])
        read = time.perf_counter() - start
        start = time.perf_counter()
        feasible = lengths_of(file)
        seconds = time.perf_counter() - start
        memory = process_peak_memory(
            f"from pathlib import Path\nfrom benchmarks.gcode import lengths_of\nlengths_of(Path({str(file)!r}))"
        )
    yield Row(
        f"{lines:,} lines, a print of {end / 3600:.1f} h, {samples:,} samples: time to read",
        "",
        f"{read:.0f} s, {end / read:,.0f} x print speed",
    )
    yield Row(
        "with lengths and feasibility of each sample",
        ">= 10 x print speed",
        f"{seconds:.0f} s, {end / seconds:,.0f} x print speed; {feasible / samples:.0%} feasible",
    )
    yield Row("peak memory", "<= 0.5 GB", f"{memory:.2f} GB")


def lengths_of(file: Path) -> int:
    """Number of feasible samples of a program, with exact cables, a hopper that empties, and a hose from above."""
    robot, feasible, previous = sl.load_robot(ROBOT), 0, None
    for part in sl.gcode_parts(file, **SETTINGS):
        plan = sl.inverse(robot, part.path, wrench=load_along(part.path), previous=previous)
        feasible, previous = feasible + int(plan.feasible.sum()), plan
    return feasible


def load_along(path: sl.Path) -> np.ndarray:
    """Weight and inertia of the material, and weight of the hose, shape (N, 6)."""
    full, empty, period = MATERIAL
    mass = full - (full - empty) * (path.time % period) / period
    wrench = np.zeros((len(path), 6))
    wrench[:, :3] = -mass[:, None] * (path.twist_rate[:, :3] + [0.0, 0.0, 9.81])
    wrench[:, 2] -= HOSE * path.pose.position[:, 2]
    return wrench


if __name__ == "__main__":
    main()

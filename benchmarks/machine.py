"""The machine between encoder and cable: drums; one core."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, best_seconds, one_core, show
from sagline.robot.drum import drums_of
from tests.kinematics.winches import wound

COUNTS = 1_000_000


def counts() -> Iterator[Row]:
    """Counts to lengths and back, over four layers with a wandering exit."""
    robot = wound()
    drums = drums_of(robot)
    turns = np.random.default_rng(6).uniform(0.0, drums.most[0], (COUNTS // 8, 8))
    given = np.rint(drums.counts(drums.lengths(turns)))
    length = sl.lengths_from_counts(robot, given)
    path = length * (1.0 + drums.rest_strain)
    off = np.abs(np.rint(drums.counts(path)) - given).max()
    there = best_seconds(lambda: sl.lengths_from_counts(robot, given)) * 1e9 / COUNTS
    back = best_seconds(lambda: drums.counts(path)) * 1e9 / COUNTS
    yield Row(
        "counts to lengths to counts, 10^6, four layers",
        "to one count; <= 100 ns each",
        f"{off:.0f} counts off at most; {there:.0f} ns there, {back:.0f} ns back",
    )


def main() -> None:
    """Measure and print."""
    console = Console()
    rows: list[Row] = []
    one_core()
    for part in (counts,):
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show("The machine between encoder and cable", rows, console)


if __name__ == "__main__":
    main()

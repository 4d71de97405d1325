"""The table that sums up runs: one column a run, one row a number."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from sagline.cli.study import Run, Summary, summary
from sagline.cli.tables import Grid, written

ROWS = {  # of a summary: what a person reads, and how its number is written
    "position_error_max_mm": ("position error, largest [mm]", ".3g"),
    "position_error_mean_mm": ("position error, mean [mm]", ".3g"),
    "chord_tension_min_n": ("chord tension, smallest [N]", ".1f"),
    "chord_tension_max_n": ("chord tension, largest [N]", ".1f"),
    "unstrained_length_min_m": ("unstrained length, smallest [m]", ".3f"),
    "unstrained_length_max_m": ("unstrained length, largest [m]", ".3f"),
    "adjusting_length_min_mm": ("adjusting length, smallest [mm]", ".1f"),
    "adjusting_length_max_mm": ("adjusting length, largest [mm]", ".1f"),
    "feasible_share_percent": ("feasible poses [%]", ".4g"),
    "inverse_us_per_pose": ("inverse kinematics [µs a pose]", ".2f"),
}
NARROW, WIDE = 10, 30  # characters of a column's head: four narrow ones fit a line of 80


def summary_grid(runs: Sequence[Run]) -> Grid:
    """One column a run, so that it fits any terminal; one row a number."""
    heads = [""]
    for run in runs:
        name = fill(run.plan.state.one_robot.name, NARROW if len(runs) > 2 else WIDE)
        heads.append(f"{name}\n{type(run.plan.state.cables.model).__name__}")
    numbers: list[Summary] = [summary(run) for run in runs]
    rows = [
        [label, *(written(getattr(column, field), form) for column in numbers)] for field, (label, form) in ROWS.items()
    ]
    return Grid(heads, rows)

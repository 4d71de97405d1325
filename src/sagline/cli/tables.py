"""The tables that the commands print."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from textwrap import fill

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from sagline.cli.study import Run, Summary, summary

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


def plain_table(title: str = "") -> Table:
    """An empty table with one line under its head."""
    return Table(title=title or None, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)


def summary_table(runs: Sequence[Run]) -> Table:
    """One column a run, so that it fits any terminal; one row a number."""
    table = plain_table()
    table.add_column("", no_wrap=True)
    for run in runs:
        name = fill(run.plan.state.one_robot.name, NARROW if len(runs) > 2 else WIDE)
        table.add_column(Text(f"{name}\n{type(run.plan.state.cables.model).__name__}"), justify="right", no_wrap=True)
    numbers: list[Summary] = [summary(run) for run in runs]
    for field, (label, form) in ROWS.items():
        table.add_row(Text(label), *(written(getattr(column, field), form) for column in numbers))
    return table


def written(number: float, form: str) -> str:
    """A number with a true minus sign, or a dash where there is none."""
    return "–" if isnan(number) else format(number, f"z{form}").replace("-", "−")  # z: no minus zero

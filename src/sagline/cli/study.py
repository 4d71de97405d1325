"""Plan of a robot along a path, its confirmation with exact cables, and its summary in a few numbers."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, show_table
from sagline.cli.terminal import show_note, show_text
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.files.writing import file_stem
from sagline.kinematics.confirm import Confirmation, confirm
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Gap, Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

if TYPE_CHECKING:
    from sagline.cli.progress import ProgressLine

ROWS = {  # rows of a summary: the label and the number format
    "position_error_max_mm": ("position error, largest [mm]", ".3g"),
    "position_error_mean_mm": ("position error, mean [mm]", ".3g"),
    "chord_tension_min_n": ("chord tension, smallest [N]", ".1f"),
    "chord_tension_max_n": ("chord tension, largest [N]", ".1f"),
    "unstrained_length_min_m": ("unstrained length, smallest [m]", ".3f"),
    "unstrained_length_max_m": ("unstrained length, largest [m]", ".3f"),
    "adjusting_length_min_mm": ("adjusting length, smallest [mm]", ".1f"),
    "adjusting_length_max_mm": ("adjusting length, largest [mm]", ".1f"),
    "feasible_share_percent": ("feasible poses [%]", ".4g"),
    "inverse_us_per_pose": ("inverse kinematics [µs per pose]", ".2f"),
}
WIDE, NARROW = 30, 16  # largest widths of the robot and of the tension method in a column's head, in characters
LONGEST = "unstrained_length_max_m"  # smaller position errors are printed as zero, because lengths have rounding errors
MOST_GAPS = 5  # largest number of infeasible parts of a path that are printed
WIDEN = " Move the path, or widen the tension limits."
SAME_PLACE = (
    1e-6  # [m], far above the rounding errors of an equilibrium, and far below its distance from a second equilibrium
)


class ConfirmedRun(NamedTuple):
    """A plan along a path, its confirmation, and the computing time of the inverse kinematics [s]."""

    confirmation: Confirmation
    seconds: float

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.confirmation.plan

    @property
    def name(self) -> str:
        """Name of the files: robot and model."""
        return run_name(self.plan.state.one_robot, self.plan.state.cables.model)

    @property
    def lost(self) -> int:
        """Number of planned poses without a stable equilibrium of the platform."""
        stays = self.confirmation.held
        if isinstance(self.plan.state.cables.model, Catenary):  # exact: a different position is another equilibrium
            stays = stays & (np.linalg.norm(self.confirmation.position_error, axis=-1) < SAME_PLACE)
        return int(np.sum(self.plan.feasible & ~stays))


def run_name(robot: Robot, model: CableModel) -> str:
    """Name of the files of a run, without suffix."""
    return file_stem(robot.name, type(model).__name__.lower())


def run_along(
    robot: Robot, path: Path, model: CableModel, tension: TensionMethod, line: ProgressLine, wrench: Array | None = None
) -> ConfirmedRun:
    """Plan a path, and confirm the plan with exact cables."""
    inverse(robot, path.pose[:1], model, tension, wrench)  # load the compiled kernels before the time is measured
    start = perf_counter()
    progress = line.stage(f"{robot.name}: planning {len(path):,} poses")
    plan = inverse(robot, path, model, tension, wrench, progress=progress)
    seconds = perf_counter() - start
    return ConfirmedRun(confirm(plan, progress=line.stage(f"{robot.name}: confirming {len(path):,} poses")), seconds)


def summary(run: ConfirmedRun) -> dict[str, float]:
    """The numbers of a run's feasible poses, by the keys of ROWS; NaN if no pose is feasible."""
    plan = run.plan
    error = 1e3 * np.linalg.norm(run.confirmation.position_error, axis=-1)
    known = error[~np.isnan(error)]
    numbers = (
        *((float(known.max()), float(known.mean())) if known.size else (np.nan, np.nan)),
        *_range(plan.chord_tension),
        *_range(plan.unstrained_length),
        *_range(1e3 * plan.state.cables.adjusting_length),
        100.0 * float(np.mean(plan.feasible)),
        1e6 * run.seconds / plan.status.size,
    )
    return dict(zip(ROWS, numbers, strict=True))


def _gap_text(gap: Gap, plan: Plan) -> str:
    """Text about an infeasible part of a path: its time, its shortfall and the limiting cables."""
    assert plan.path is not None
    first, last = (f"{plan.path.time[k]:g} s" for k in (gap.first, gap.last))
    when = f"from {first} to {last}" if gap.last > gap.first else f"at {first}"
    if np.isnan(gap.shortfall):
        return f"{when}: {gap.status.text}"
    count = plan.state.one_robot.cable_count
    cables = "all cables" if len(gap.cables) == count else f"cables {', '.join(map(str, gap.cables))}"
    if np.isinf(gap.shortfall):
        return f"{when}: no additional force alone is sufficient; limiting: {cables}"
    short = f"shortfall up to {n(gap.shortfall, '.3g', 'N')}"
    if gap.hopeless:
        short += f", and at {gap.hopeless} of {gap.last - gap.first + 1} poses no additional force alone is sufficient"
    return f"{when}: {short}; limits of {cables}"


def tell(runs: Sequence[ConfirmedRun], output: Output, notes: Sequence[str] = (), *, as_json: bool) -> int:
    """Print the summary, notes and the infeasible parts of the paths; returns the exit code."""

    def show() -> None:
        show_table(_summary_grid(runs))
        for note in notes:
            show_text(note)

    output.report(lambda: {"runs": [_record(run) for run in runs]}, _verdict(runs), show, as_json=as_json)
    return max((_complaints(run) for run in runs), default=0)


def _verdict(runs: Sequence[ConfirmedRun]) -> str:
    """Sentence with the number of feasible, stable poses of all runs."""
    poses = sum(run.plan.status.size for run in runs)
    held = sum(int(np.sum(run.plan.feasible)) - run.lost for run in runs)
    of = "" if len(runs) == 1 else f" of {len(runs)} runs"
    if held == poses:
        return f"All {poses:,} poses{of} are feasible and stable."
    return f"{held:,} of {poses:,} poses{of} are feasible and stable."


def _summary_grid(runs: Sequence[ConfirmedRun]) -> TextTable:
    """Table with one column per run and one row per number."""
    heads = [""]
    for run in runs:
        name = fill(run.plan.state.one_robot.name, WIDE, break_long_words=False, break_on_hyphens=False)
        how = fill(run.plan.method, NARROW, break_on_hyphens=False)
        heads.append(f"{name}\n{type(run.plan.state.cables.model).__name__}\n{how}")
    numbers = [summary(run) for run in runs]
    rows = [
        [label, *(n(column[field], form, size=1e3 * column[LONGEST]) for column in numbers)]
        for field, (label, form) in ROWS.items()
    ]
    return TextTable(heads, rows)


def _complaints(run: ConfirmedRun) -> int:
    """Print the infeasible parts of the path; returns the exit code of this run."""
    name, gaps, plan = run.plan.state.one_robot.name, run.plan.gaps, run.plan
    for gap in gaps[:MOST_GAPS]:
        left = "is unstable" if gap.status is PoseStatus.UNSTABLE else "leaves the feasible region"
        show_note(f"{name}: ", f"the path {left} {_gap_text(gap, plan)}", style="bold red")
    if len(gaps) > MOST_GAPS:
        show_note(f"{name}: ", f"and {len(gaps) - MOST_GAPS} more times", style="bold red")
    if gaps:
        limits = all(gap.status is PoseStatus.INFEASIBLE for gap in gaps)
        show_note("", "The file contains the feasible part and marks the rest." + WIDEN * limits)
    if run.lost > np.sum(plan.feasible & ~plan.solved):  # the infeasible parts do not include them
        what = f"{run.lost} of the planned poses are not stable equilibria: the platform would leave its path"
        show_note(f"{name}: ", f"{what}; move the path, or raise the tensions", style="bold red")
    return OUTSIDE if gaps or run.lost else 0


def _record(run: ConfirmedRun) -> dict[str, Any]:
    plan = run.plan
    clock = plan.path.time if plan.path is not None else None
    return {
        "robot": plan.state.one_robot.name,
        "model": type(plan.state.cables.model).__name__,
        "tension": type(plan.tension).__name__,
        "tension_variable": plan.tension.variable,
        "poses": plan.status.size,
        **summary(run),
        "poses_not_stable": run.lost,
        "gaps": [
            {
                "from_s": None if clock is None else clock[gap.first],
                "to_s": None if clock is None else clock[gap.last],
                "shortfall_n": gap.shortfall,
                "cables": list(gap.cables),
                "reason": gap.status.text,
            }
            for gap in plan.gaps
        ],
    }


def _range(values: Array) -> tuple[float, float]:
    finite = values[~np.isnan(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)

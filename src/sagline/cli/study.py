"""One run of a robot along a path: planned, confirmed, and summed up in a few numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from textwrap import fill
from time import perf_counter
from typing import Any, NamedTuple, Protocol

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.cli.ending import OUTSIDE
from sagline.cli.results import listed
from sagline.cli.tables import Grid, show_table, written
from sagline.cli.terminal import note, show, show_json
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.core.progress import Progress
from sagline.files.writing import create_folder, file_stem
from sagline.kinematics.confirm import Confirmation, confirm
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Gap, Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

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
MOST_GAPS = 5  # told in full
WIDEN = " Move the path, or widen the tension limits."
SAME_PLACE = 1e-6  # m: far above rounding, far below any second equilibrium


class Stages(Protocol):
    """Told of each part of the work, it gives what to call with how much of it is done."""

    def stage(self, what: str) -> Progress:
        """A new part begins."""


class Run(NamedTuple):
    """A confirmed plan along a path.

    Attributes:
        confirmation: The plan, and where its lengths really lead.
        seconds: Time the inverse kinematics took, compiled [s].
    """

    confirmation: Confirmation
    seconds: float

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.confirmation.plan

    @property
    def name(self) -> str:
        """Robot and model, as files are named."""
        return run_name(self.plan.state.one_robot, self.plan.state.cables.model)

    @property
    def lost(self) -> int:
        """Number of planned poses in which the platform would not stay: its equilibrium there is none, or unstable."""
        stays = self.confirmation.held
        if isinstance(self.plan.state.cables.model, Catenary):  # planned exactly: it rests elsewhere only if it left
            stays = stays & (np.linalg.norm(self.confirmation.position_error, axis=-1) < SAME_PLACE)
        return int(np.sum(self.plan.feasible & ~stays))


class Summary(NamedTuple):
    """The numbers of one run; over its feasible poses, NaN if there are none. Units are in the names."""

    position_error_max_mm: float
    position_error_mean_mm: float
    chord_tension_min_n: float
    chord_tension_max_n: float
    unstrained_length_min_m: float
    unstrained_length_max_m: float
    adjusting_length_min_mm: float
    adjusting_length_max_mm: float
    feasible_share_percent: float
    inverse_us_per_pose: float


def run_name(robot: Robot, model: CableModel) -> str:
    """How the files of a run are named, without a suffix."""
    return file_stem(robot.name, type(model).__name__.lower())


def run_along(
    robot: Robot, path: Path, model: CableModel, tension: TensionMethod, line: Stages, wrench: Array | None = None
) -> Run:
    """Plan a path, and confirm the plan with exact cables.

    Args:
        robot: The robot.
        path: The path.
        model: Cable model the lengths are planned with.
        tension: How the load is shared.
        line: Told of planning and confirming.
        wrench: External wrench, shape (6,), as `inverse` takes it; None for none.

    Raises:
        InvalidValueError: If the robot's tensions cannot be determined.
        CableGeometryError: If a cable has no length at some pose.
    """
    inverse(robot, path.pose[:1], model, tension, wrench)  # loads the compiled kernels, so that the work alone is timed
    start = perf_counter()
    told = line.stage(f"{robot.name}: planning {len(path):,} poses")
    plan = inverse(robot, path, model, tension, wrench, progress=told)
    seconds = perf_counter() - start
    return Run(confirm(plan, progress=line.stage(f"{robot.name}: confirming {len(path):,} poses")), seconds)


def summary(run: Run) -> Summary:
    """The run in numbers."""
    plan = run.plan
    error = 1e3 * np.linalg.norm(run.confirmation.position_error, axis=-1)
    largest, mean = (
        float(f(error[~np.isnan(error)])) if not np.isnan(error).all() else np.nan for f in (np.max, np.mean)
    )
    return Summary(
        largest,
        mean,
        *_range(plan.chord_tension),
        *_range(plan.unstrained_length),
        *_range(1e3 * plan.state.cables.adjusting_length),
        100.0 * float(np.mean(plan.feasible)),
        1e6 * run.seconds / plan.status.size,
    )


def gap_text(gap: Gap, plan: Plan) -> str:
    """When a path leaves the feasible region, by how much, and which cables stand against it."""
    assert plan.path is not None
    first, last = (f"{plan.path.time[k]:g} s" for k in (gap.first, gap.last))
    when = f"from {first} to {last}" if gap.last > gap.first else f"at {first}"
    if np.isnan(gap.shortfall):
        return f"{when}: {gap.status.text}"
    count = plan.state.one_robot.cable_count
    cables = "all cables" if len(gap.cables) == count else f"cables {', '.join(map(str, gap.cables))}"
    if np.isinf(gap.shortfall):
        return f"{when}: no change of the force alone would do; limits of {cables}"
    short = f"short by up to {n(gap.shortfall, '.3g', 'N')}"
    if gap.hopeless:
        short += f", and at {gap.hopeless} of {gap.last - gap.first + 1} poses no force alone would do"
    return f"{when}: {short}; limits of {cables}"


def tell(runs: Sequence[Run], files: Sequence[FilePath], folder: FilePath, *, as_json: bool) -> int:
    """Print the numbers and what went wrong; returns the exit code."""
    if as_json:
        show_json({"runs": [_record(run) for run in runs], "files": list(files)})
    else:
        show_table(summary_grid(runs))
        show(f"In {folder.resolve()}: {listed(files)}", whole=True)
    return max((_complaints(run) for run in runs), default=0)


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


def _complaints(run: Run) -> int:
    """Say where the path cannot be followed; the exit code of this run."""
    name, gaps, plan = run.plan.state.one_robot.name, run.plan.gaps, run.plan
    for gap in gaps[:MOST_GAPS]:
        note(f"{name}: ", f"the path leaves the feasible region {gap_text(gap, plan)}", style="bold red")
    if len(gaps) > MOST_GAPS:
        note(f"{name}: ", f"and {len(gaps) - MOST_GAPS} times more", style="bold red")
    if gaps:
        limits = all(gap.status is PoseStatus.INFEASIBLE for gap in gaps)
        note("", "The file keeps the feasible part and marks the rest." + WIDEN * limits)
    if run.lost:
        what = f"{run.lost} of the planned poses are no stable equilibria: there the platform would leave its path"
        note(f"{name}: ", f"{what}; move it, or raise the tensions", style="bold red")
    return OUTSIDE if gaps or run.lost else 0


def _record(run: Run) -> dict[str, Any]:
    plan = run.plan
    clock = plan.path.time if plan.path is not None else None
    return {
        "robot": plan.state.one_robot.name,
        "model": type(plan.state.cables.model).__name__,
        "tension": type(plan.tension).__name__,
        "tension_variable": plan.tension.variable,
        "poses": plan.status.size,
        **summary(run)._asdict(),
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


def write_plans(runs: Sequence[Run], folder: FilePath) -> list[FilePath]:
    """Save the plan of each run; returns the files."""
    create_folder(folder)
    files = [folder / f"{run.name}.nc" for run in runs]
    for run, file in zip(runs, files, strict=True):
        run.plan.save(file)
    return files

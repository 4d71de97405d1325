"""`sagline track`: the plan of a robot along a path, its confirmation with exact cables, and its summary."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import FigureMaker, Output, TextTable, values_of
from sagline.cli.terminal import ProgressLine, show_note, show_text, working
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.files.writing import file_stem

TOO_FAR = 100.0  # largest distance of a path from the robot, divided by the robot's size
FIGURES = ("path", "velocity", "cables", "error")


def track(
    robot: str = opt.ROBOT,
    path: Path | None = opt.argument(
        None, "PATH", "Waypoints in .yaml, times and poses in .csv, or G-code in .ngc. Default: the article's path."
    ),
    model: str = opt.MODEL,
    tension: str = opt.TENSION,
    variable: Any = opt.VARIABLE,
    wrench: Any = opt.WRENCH,
    payload: float | None = opt.PAYLOAD,
    uncertainty: bool = opt.flag(
        False,
        "Errors of poses and tensions due to the robot's tolerances.",
        opt.only_without("--base"),
        "--uncertainty",
    ),
    bases: list[str] | None = opt.BASES,
    files: opt.Files = opt.Files(),
) -> int:
    """Plan the cable lengths of a robot along a path, and confirm them with exact catenaries.

    The lengths are computed with the chosen cable model. The confirmation finds the equilibrium of the platform on
    exact catenaries of these lengths. The position error is the distance of this equilibrium from the planned pose.
    The plan is written to DIR/ROBOT-MODEL.nc. --csv also writes poses, lengths and tensions as a table, and with
    --uncertainty a table of the expected errors.

    For example:

        sagline track article-suspended
        sagline track own_robot.yaml own_path.yaml --model empirical --out results
        sagline track cogiro own_samples.csv --payload 20 --csv
        sagline track cogiro own_path.yaml --base ship.yaml=0,1,2,3
    """
    from sagline.cables.models import model_of

    machine = opt.robot_with_payload(robot, payload)
    way = sl.article_path() if path is None else load_path_near(machine, path)
    cable, anchors = model_of(model), anchors_of(machine, bases)
    if uncertainty:  # refuse missing tolerances before any other work
        sl.inverse(machine, way.pose[:1], cable).uncertainty()
    tables = (".csv", "-uncertainty.csv")[: 1 + uncertainty]
    output = Output(files, run_name(machine, cable), [".nc"], [f"-{figure}" for figure in FIGURES], *tables)
    with working(f"{machine.name}: planning and confirming {len(way):,} poses") as line:
        how = {"model": cable, "tension": opt.tension_named(tension, variable), "wrench": wrench}
        run = ConfirmedRun.along(machine, way, line, anchors, **how)
        run = run._replace(uncertainty=run.plan.uncertainty() if uncertainty else None)
    with working("writing"):
        run.plan.save(output.file(".nc"))
        output.table(".csv", run.plan.table)
        if run.uncertainty is not None:
            output.table("-uncertainty.csv", run.uncertainty.table)
        output.draw(*_figures(run))
    return tell([run], output, [] if run.uncertainty is None else [f"{run.uncertainty}."])


def load_path_near(robot: sl.Robot, file: Path) -> sl.Path:
    """Load a path. FileError if it is so far from `robot` that its numbers are probably in another unit."""
    way = sl.load_path(file)
    size = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    away = np.linalg.norm(way.pose.position - robot.frame_anchors.mean(axis=0), axis=1)
    k = int(np.argmax(away))
    if away[k] > TOO_FAR * size:
        far = f"leads {away[k]:.4g} m away from {robot.name}, whose frame measures {size:.3g} m"
        step = "If these are millimeters, write the unit: x [mm] in CSV, 1500 mm in YAML."
        raise sl.FileError(file, f"{far}, at {way.time[k]:g} s", step)
    return way


def anchors_of(robot: sl.Robot, bases: Sequence[str] | None) -> sl.AnchorMotion | None:
    """Motion of the anchors from the texts FILE=CABLES of the option --base; None without bases."""
    found = []
    for text in bases or ():
        file, _, cables = text.rpartition("=")
        numbers = cables.split(",")
        if not file or not all(re.fullmatch(r"[0-9]{1,4}", number.strip()) for number in numbers):
            step = "Give the file and the cables: --base ship.yaml=0,1,2,3."
            raise sl.InvalidValueError("--base", repr(text), "FILE=CABLES", step)
        found.append((sl.load_path(file), [int(number) for number in numbers]))
    return sl.anchors_on_bases(robot, found) if found else None


def _figures(run: ConfirmedRun) -> tuple[FigureMaker, ...]:
    """Functions that draw the figures, in the order of `FIGURES`."""
    way = run.plan.path
    assert way is not None
    return (
        lambda: sl.plot.path(way),
        lambda: sl.plot.velocity(way),
        lambda: sl.plot.overview(run.plan),
        lambda: sl.plot.error(run.confirmation),
    )


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
WIDE, NARROW = 30, 16  # largest widths of the names of robot and tension method in a column's head, in characters
LONGEST = "unstrained_length_max_m"  # size relative to which a position error is rounding
MOST_GAPS = 5  # largest number of infeasible parts of a path that are printed
WIDEN = " Move the path, or widen the tension limits."
# [m], far above the rounding errors of an equilibrium, and far below its distance from a second equilibrium
SAME_PLACE = 1e-6


class ConfirmedRun(NamedTuple):
    """A plan along a path, its confirmation, computing time of the inverse kinematics [s], and expected errors."""

    confirmation: sl.Confirmation
    seconds: float
    uncertainty: sl.Uncertainty | None = None

    @property
    def plan(self) -> sl.Plan:
        """The plan."""
        return self.confirmation.plan

    @property
    def lost(self) -> int:
        """Number of planned poses without a stable equilibrium of the platform."""
        stays = self.confirmation.held
        if isinstance(self.plan.state.cables.model, sl.Catenary):  # exact: a different position is another equilibrium
            stays = stays & (np.linalg.norm(self.confirmation.position_error, axis=-1) < SAME_PLACE)
        return int(np.sum(self.plan.feasible & ~stays))

    @classmethod
    def along(
        cls, robot: sl.Robot, path: sl.Path, line: ProgressLine, anchors: sl.AnchorMotion | None = None, **how: Any
    ) -> ConfirmedRun:
        """Plan a path, and confirm the plan with exact cables. `how`: model, tension and wrench as in `inverse`."""
        sl.inverse(robot, path.pose[:1], **how)  # load the compiled kernels before the time is measured
        start = perf_counter()
        progress = line.stage(f"{robot.name}: planning {len(path):,} poses")
        plan = sl.inverse(robot, path, anchors=anchors, progress=progress, **how)
        seconds = perf_counter() - start
        return cls(sl.confirm(plan, progress=line.stage(f"{robot.name}: confirming {len(path):,} poses")), seconds)

    def summary(self) -> dict[str, float]:
        """Numbers of the feasible poses, by the keys of `ROWS`. They are NaN if no pose is feasible."""
        plan = self.plan
        error = 1e3 * np.linalg.norm(self.confirmation.position_error, axis=-1)
        known = error[~np.isnan(error)]
        numbers = (
            *((float(known.max()), float(known.mean())) if known.size else (np.nan, np.nan)),
            *_range(plan.chord_tension),
            *_range(plan.unstrained_length),
            *_range(1e3 * plan.state.cables.adjusting_length),
            100.0 * float(np.mean(plan.feasible)),
            1e6 * self.seconds / plan.status.size,
        )
        return dict(zip(ROWS, numbers, strict=True))


def run_name(robot: sl.Robot, model: sl.CableModel) -> str:
    """Name of the files of a run, without suffix."""
    return file_stem(robot.name, type(model).__name__.lower())


def _gap_text(gap: sl.Gap, plan: sl.Plan) -> str:
    """Text about an infeasible part of a path: its time, its shortfall and the limiting cables."""
    assert plan.path is not None
    first, last = (f"{plan.path.time[k]:g} s" for k in (gap.first, gap.last))
    when = f"from {first} to {last}" if gap.last > gap.first else f"at {first}"
    if np.isnan(gap.shortfall):
        return f"{when}: {gap.status.text}"
    count = plan.robot.cable_count
    cables = "all cables" if len(gap.cables) == count else f"cables {', '.join(map(str, gap.cables))}"
    if np.isinf(gap.shortfall):
        return f"{when}: no additional force alone is sufficient; limiting: {cables}"
    short = f"shortfall up to {n(gap.shortfall, '.3g', 'N')}"
    if gap.hopeless:
        short += f", and at {gap.hopeless} of {gap.last - gap.first + 1} poses no additional force alone is sufficient"
    return f"{when}: {short}; limits of {cables}"


def tell(runs: Sequence[ConfirmedRun], output: Output, notes: Sequence[str] = ()) -> int:
    """Print the summary, `notes`, and the infeasible parts of the paths. Returns the exit code."""

    def show() -> None:
        _summary_grid(runs).show()
        for note in notes:
            show_text(note)

    output.report(lambda: {"runs": [_record(run) for run in runs]}, _verdict(runs), show)
    return max((_complaints(run) for run in runs), default=0)


def _verdict(runs: Sequence[ConfirmedRun]) -> str:
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
        name = fill(run.plan.robot.name, WIDE, break_long_words=False, break_on_hyphens=False)
        how = fill(run.plan.method, NARROW, break_on_hyphens=False)
        heads.append(f"{name}\n{type(run.plan.state.cables.model).__name__}\n{how}")
    numbers = [run.summary() for run in runs]
    rows = [
        [label, *(n(column[field], form, size=1e3 * column[LONGEST]) for column in numbers)]
        for field, (label, form) in ROWS.items()
    ]
    return TextTable(heads, rows)


def _complaints(run: ConfirmedRun) -> int:
    """Print the infeasible parts of the path of `run`. Returns the exit code."""
    name, gaps, plan = run.plan.robot.name, run.plan.gaps, run.plan
    for gap in gaps[:MOST_GAPS]:
        left = "is unstable" if gap.status is sl.PoseStatus.UNSTABLE else "leaves the feasible region"
        show_note(f"{name}: ", f"the path {left} {_gap_text(gap, plan)}", style="bold red")
    if len(gaps) > MOST_GAPS:
        show_note(f"{name}: ", f"and {len(gaps) - MOST_GAPS} more times", style="bold red")
    if gaps:
        limits = all(gap.status is sl.PoseStatus.INFEASIBLE for gap in gaps)
        show_note("", "The file contains the feasible part and marks the rest." + WIDEN * limits)
    if run.lost > np.sum(plan.feasible & ~plan.solved):  # poses that are not in the infeasible parts
        what = f"{run.lost} of the planned poses are not stable equilibria: the platform would leave its path"
        show_note(f"{name}: ", f"{what}; move the path, or raise the tensions", style="bold red")
    return OUTSIDE if gaps or run.lost else 0


def _record(run: ConfirmedRun) -> dict[str, Any]:
    plan = run.plan
    clock = plan.path.time if plan.path is not None else None
    return {
        "robot": plan.robot.name,
        "model": type(plan.state.cables.model).__name__,
        "tension": type(plan.tension).__name__,
        "tension_variable": plan.tension.variable,
        "poses": plan.status.size,
        **run.summary(),
        "poses_not_stable": run.lost,
        **({} if run.uncertainty is None else _errors(run.uncertainty)),
        "gaps": [
            {
                "from_s": None if clock is None else clock[gap.first],
                "to_s": None if clock is None else clock[gap.last],
                **values_of(gap, "shortfall_n", "cables"),
                "reason": gap.status.text,
            }
            for gap in plan.gaps
        ],
    }


def _errors(found: sl.Uncertainty) -> dict[str, Any]:
    return {
        "expected_error_max_mm": _range(1e3 * found.position)[1],
        "expected_rotation_max_rad": _range(found.rotation)[1],
        "expected_tension_max_n": _range(found.tension)[1],
    }


def _range(values: Array) -> tuple[float, float]:
    finite = values[~np.isnan(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)

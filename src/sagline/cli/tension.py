"""`sagline tension`: the feasible tensions of one pose, and what every way of sharing chooses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sagline.cli.choices import Model, Variable
from sagline.cli.ending import OUTSIDE
from sagline.cli.entries import INVERSE, MARGINS, POLYGON, SHARING
from sagline.cli.results import figure_files, write_figures
from sagline.cli.tables import Grid, show_table
from sagline.cli.terminal import note, show, show_json, working
from sagline.cli.values import loaded, middle_of
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.files.names import file_stem
from sagline.files.robot_file import load_robot
from sagline.files.typed import pose_of, wrench_of
from sagline.files.whole import check_files, made_folder
from sagline.kinematics.inverse import inverse
from sagline.kinematics.polygon import tension_polygon
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose
from sagline.tension.margin import capacity_margin
from sagline.tension.method import TensionMethod
from sagline.tension.methods import METHODS
from sagline.tension.minimum_norm import MinimumNorm
from sagline.tension.singular import unresisted_motion

if TYPE_CHECKING:
    from sagline.kinematics.plan import Plan
    from sagline.robot.robot import Robot

ALONE = {name: method for name, method in METHODS.items() if name not in ("Closest", "QuadraticProgram", "PolygonWalk")}


def tension(
    name: str,
    pose: str | None,
    model: Model,
    variable: Variable,
    wrench: str | None,
    payload: str | None,
    folder: Path,
    *,
    figures: bool,
    as_json: bool,
) -> int:
    """Share the load of one pose in every way, tell, and draw; returns the exit code.

    Raises:
        SaglineError: If an input is wrong or the folder cannot be written.
    """
    load, place = wrench_of(wrench), None if pose is None else pose_of(pose)
    robot = loaded(load_robot(name), payload)
    place = middle_of(robot) if place is None else place
    drawn = figures and robot.cable_count == robot.degrees_of_freedom + 2
    name_of_figure = file_stem(robot.name, "tension")
    if drawn:
        check_files(folder, figure_files([name_of_figure]))
    with working(f"{robot.name}: sharing the load", INVERSE, SHARING, MARGINS, *[POLYGON] * drawn):
        least = inverse(robot, place, model.build(), MinimumNorm(variable.value), load)  # refuses what none can share
        plans = {title: _plan(robot, place, model, method(variable.value), load) for title, method in ALONE.items()}
        reason = _reason(robot, place, least)
        margin = float(capacity_margin(least.state))
        shape = tension_polygon(robot, place, model.build(), load, variable.value) if drawn else None
    for text in least.warnings:
        note(f"{robot.name}: ", text)
    if not any(plan is not None and plan.feasible for plan in plans.values()):
        note("No tensions: ", reason, style="bold red")
        return OUTSIDE
    files: list[Path] = []
    if shape is not None:
        made_folder(folder)
        from sagline import plot

        points = {title: plan.chord_tension for title, plan in plans.items() if plan is not None}
        files = write_figures({name_of_figure: plot.polygon(shape, points)}, folder)
    if as_json:
        show_json(
            {"capacity_margin": margin, "tensions": {k: _record(plan) for k, plan in plans.items()}, "files": files}
        )
        return 0
    show_table(_grid(robot, plans))
    show(f"Extra force in the worst direction before no tensions balance it: {n(margin, unit='N')}")
    if files:
        show(f"In {folder.resolve()}: {', '.join(file.name for file in files)}", whole=True)
    return 0


def _plan(robot: Robot, pose: Pose, model: Model, method: TensionMethod, wrench: Array | None) -> Plan | None:
    """None where the method cannot share among the robot's cables."""
    try:
        return inverse(robot, pose, model.build(), method, wrench)
    except InvalidValueError:
        return None


def _reason(robot: Robot, pose: Pose, plan: Plan) -> str:
    status = PoseStatus(int(plan.status))
    if status is PoseStatus.SINGULAR:
        return f"{status.text}. No cable resists {unresisted_motion(robot, pose).text}"
    if status is PoseStatus.INFEASIBLE:
        cables = "blocking cables " + ", ".join(str(i) for i in np.flatnonzero(plan.blocking))
        if np.isfinite(plan.shortfall):
            return f"{status.text}. Shortfall {n(plan.shortfall, unit='N')}; {cables}"
        no_force = "No change of the force alone would do; " if np.isinf(plan.shortfall) else ""
        return f"{status.text}. {no_force}{cables}"
    return status.text


def _record(plan: Plan | None) -> Any:
    if plan is None:
        return None
    return {"status": PoseStatus(int(plan.status)).name, "chord_tension": list(map(float, plan.chord_tension))}


def _grid(robot: Robot, plans: dict[str, Plan | None]) -> Grid:
    rows = []
    for title, plan in plans.items():
        if plan is not None and plan.feasible:
            rows.append([title, *(f"{value:.1f}" for value in plan.chord_tension), ""])
        else:
            why = "cannot share here" if plan is None else PoseStatus(int(plan.status)).name.lower().replace("_", " ")
            rows.append([title, *[""] * robot.cable_count, why])
    heads = ["", *map(str, range(robot.cable_count)), ""]
    if not any(row[-1] for row in rows):
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    return Grid(heads, rows, "Chord tensions [N]", left=frozenset({0, robot.cable_count + 1}))

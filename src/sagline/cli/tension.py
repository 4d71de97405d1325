"""`sagline tension`: the feasible tensions of one pose, and what every way of sharing chooses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from sagline.cli.choices import Model, Variable
from sagline.cli.entries import INVERSE, MARGINS, POLYGON, SHARING
from sagline.cli.results import figure_files, write_figures
from sagline.cli.tables import plain_table
from sagline.cli.terminal import OUTSIDE, note, show, show_json, working
from sagline.errors import InvalidValueError
from sagline.files.names import file_stem
from sagline.files.pose_text import parse_pose
from sagline.files.robot_file import load_robot
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
    name: str, pose: str | None, model: Model, variable: Variable, folder: Path, *, figures: bool, as_json: bool
) -> int:
    """Share the load of one pose in every way, tell, and draw; returns the exit code.

    Raises:
        SaglineError: If an input is wrong or the folder cannot be written.
    """
    robot = load_robot(name)
    place = _pose(robot, pose)
    drawn = figures and robot.cable_count == robot.degrees_of_freedom + 2
    name_of_figure = file_stem(robot.name, "tension")
    if drawn:
        check_files(folder, figure_files([name_of_figure]))
    with working(f"{robot.name}: sharing the load", INVERSE, SHARING, MARGINS, *[POLYGON] * drawn):
        plans = {title: _plan(robot, place, model, method(variable.value)) for title, method in ALONE.items()}
    least = plans[MinimumNorm.__name__]
    assert least is not None
    if least.status not in (PoseStatus.SOLVED, PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED):
        note("Not feasible: ", _reason(robot, place, least), style="bold red")
        return OUTSIDE
    files: list[Path] = []
    if drawn:
        made_folder(folder)
        from sagline import plot

        shape = tension_polygon(robot, place, model.build(), variable=variable.value)
        points = {title: plan.chord_tension for title, plan in plans.items() if plan is not None}
        files = write_figures({name_of_figure: plot.polygon(shape, points)}, folder)
    margin = float(capacity_margin(least.state))
    if as_json:
        show_json(
            {"capacity_margin": margin, "tensions": {k: _record(plan) for k, plan in plans.items()}, "files": files}
        )
        return 0
    show(_table(robot, plans))
    show(f"Extra force in the worst direction before no tensions balance it: {margin:.4g} N")
    if files:
        show(f"In {folder.resolve()}: {', '.join(file.name for file in files)}")
    return 0


def _plan(robot: Robot, pose: Pose, model: Model, method: TensionMethod) -> Plan | None:
    """None where the method cannot share among the robot's cables."""
    try:
        return inverse(robot, pose, model.build(), method)
    except InvalidValueError:
        return None


def _pose(robot: Robot, text: str | None) -> Pose:
    if text is None:
        if robot.test_box is None:
            raise InvalidValueError("--pose", "missing", "X,Y,Z or X,Y,Z,A,B,C", "This robot names no box of poses.")
        return Pose((robot.test_box.low + robot.test_box.high) / 2, np.eye(3))
    return parse_pose(text)


def _reason(robot: Robot, pose: Pose, plan: Plan) -> str:
    status = PoseStatus(int(plan.status))
    if status is PoseStatus.SINGULAR:
        return f"{status.text}. No cable resists {unresisted_motion(robot, pose).text}"
    if status is PoseStatus.INFEASIBLE:
        cables = ", ".join(str(i) for i in np.flatnonzero(plan.blocking))
        return f"{status.text}. Shortfall {float(plan.shortfall):.4g} N; blocking cables {cables}"
    return status.text


def _record(plan: Plan | None) -> Any:
    if plan is None:
        return None
    return {"status": PoseStatus(int(plan.status)).name, "chord_tension": list(map(float, plan.chord_tension))}


def _table(robot: Robot, plans: dict[str, Plan | None]) -> Table:
    table = plain_table("Chord tensions [N]")
    table.add_column("", no_wrap=True)
    for i in range(robot.cable_count):
        table.add_column(f"{i}", justify="right", no_wrap=True)
    table.add_column("")
    for title, plan in plans.items():
        if plan is not None and plan.feasible:
            table.add_row(title, *(f"{value:.1f}" for value in plan.chord_tension), "")
        else:
            why = "cannot share here" if plan is None else PoseStatus(int(plan.status)).name.lower().replace("_", " ")
            table.add_row(title, *([""] * robot.cable_count), why)
    return table

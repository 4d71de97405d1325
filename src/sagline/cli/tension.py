"""`sagline tension`: the feasible tensions of one pose, and what every way of sharing chooses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.entries import INVERSE, MARGINS, POLYGON, SHARING
from sagline.cli.options import (
    JsonOption,
    Model,
    ModelOption,
    OutOption,
    PayloadOption,
    PoseOption,
    RobotArgument,
    Variable,
    VariableOption,
    WrenchOption,
    figures_flag,
)
from sagline.cli.output import Grid, Output, show_table
from sagline.cli.terminal import note, show, show_json, working
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n

if TYPE_CHECKING:
    from sagline.core.arrays import Array
    from sagline.kinematics.plan import Plan
    from sagline.robot.pose import Pose
    from sagline.robot.robot import Robot
    from sagline.tension.method import TensionMethod

LEFT_OUT = ("Closest", "QuadraticProgram", "PolygonWalk")  # at one pose they choose what others do


def tension(
    name: RobotArgument,
    pose: PoseOption = None,
    model: ModelOption = Model.CATENARY,
    variable: VariableOption = Variable.CHORD,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    folder: OutOption = Path("output"),
    figures: Annotated[bool, figures_flag("Draw the polygon, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> int:
    """Share the load of one pose in nine ways, and draw the polygon of feasible tensions with all of them in it.

    Three ways are left out: at one pose, without targets, Closest and QuadraticProgram choose what MinimumNorm
    does; PolygonWalk, by its optimum, what LowestSum, MinimumNorm or Centroid does.

    For example:

        sagline tension article-mixed --pose 1,0.5,2.5
        sagline tension cogiro --pose 0,0,2,10,0,0 --variable frame_end --no-figures
    """
    from sagline.cli.values import middle_of, robot_with
    from sagline.files.pose_text import pose_of, wrench_of
    from sagline.files.writing import file_stem
    from sagline.kinematics.inverse import inverse
    from sagline.kinematics.polygon import tension_polygon
    from sagline.tension.margin import capacity_margin
    from sagline.tension.methods import METHODS, MinimumNorm

    load, place = wrench_of(wrench), None if pose is None else pose_of(pose)
    robot = robot_with(name, payload)
    place = middle_of(robot) if place is None else place
    drawn = figures and robot.cable_count == robot.degrees_of_freedom + 2
    output = Output(folder, (), [file_stem(robot.name, "tension")] * drawn)
    with working(f"{robot.name}: sharing the load", INVERSE, SHARING, MARGINS, *[POLYGON] * drawn):
        least = inverse(robot, place, model.build(), MinimumNorm(variable.value), load)  # refuses what none can share
        plans = {
            title: _plan(robot, place, model, method(variable.value), load)
            for title, method in METHODS.items()
            if title not in LEFT_OUT
        }
        reason = _reason(robot, place, least)
        margin = float(capacity_margin(least.state))
        shape = tension_polygon(robot, place, model.build(), load, variable.value) if drawn else None
    for text in least.warnings:
        note(f"{robot.name}: ", text)
    if not any(plan is not None and plan.feasible for plan in plans.values()):
        note("No tensions: ", reason, style="bold red")
        return OUTSIDE
    if shape is not None:
        from sagline import plot

        points = {title: plan.chord_tension for title, plan in plans.items() if plan is not None}
        output.draw(plot.polygon(shape, points))
    if as_json:
        tensions = {title: _record(plan) for title, plan in plans.items()}
        show_json({"capacity_margin": margin, "tensions": tensions, "files": output.files})
        return 0
    show_table(_grid(robot, plans))
    show(f"Extra force in the worst direction before no tensions balance it: {n(margin, unit='N')}")
    if output.files:
        show(f"In {folder.resolve()}: {', '.join(file.name for file in output.files)}", whole=True)
    return 0


def _plan(robot: Robot, pose: Pose, model: Model, method: TensionMethod, wrench: Array | None) -> Plan | None:
    """The plan of a method; None if the method is not defined for the robot."""
    from sagline.kinematics.inverse import inverse

    try:
        return inverse(robot, pose, model.build(), method, wrench)
    except InvalidValueError:
        return None


def _reason(robot: Robot, pose: Pose, plan: Plan) -> str:
    from sagline.kinematics.status import PoseStatus
    from sagline.tension.singular import unresisted_motion

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
    from sagline.kinematics.status import PoseStatus

    if plan is None:
        return None
    return {"status": PoseStatus(int(plan.status)).name, "chord_tension": list(map(float, plan.chord_tension))}


def _grid(robot: Robot, plans: dict[str, Plan | None]) -> Grid:
    from sagline.kinematics.status import PoseStatus

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

"""`sagline tension`: comparison of all tension distribution methods at one pose."""

from __future__ import annotations

from typing import Any

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable
from sagline.cli.terminal import show_note, show_text
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.files.writing import file_stem

TABLE = "-tensions.csv"
LEFT_OUT = ("Closest", "QuadraticProgram", "PolygonWalk")  # at a single pose, they give the tensions of other methods


def tension(
    name: str = opt.ROBOT,
    pose: Any = opt.POSE,
    model: str = opt.MODEL,
    variable: Any = opt.VARIABLE,
    wrench: Any = opt.WRENCH,
    payload: float | None = opt.PAYLOAD,
    files: opt.Files = opt.Files(),
) -> int:
    """Compare tension distribution methods at one pose, and draw their tensions into the tension polygon.

    Three methods are left out, because at a single pose their tensions are those of other methods. Closest and
    QuadraticProgram give the tensions of MinimumNorm. PolygonWalk gives those of LowestSum, MinimumNorm or Centroid.

    For example:

        sagline tension article-mixed --pose 1,0.5,2.5
        sagline tension cogiro --pose 0,0,2,10,0,0 --variable frame_end --no-figures
    """
    from sagline.robot.reach import is_underconstrained
    from sagline.tension.methods import methods_by_name

    robot = opt.robot_with_payload(name, payload)
    place = opt.middle_pose(robot) if pose is None else pose
    drawn = files.figures and robot.cable_count == robot.degrees_of_freedom + 2
    output = Output(files, file_stem(robot.name), (), ["-tension"] * drawn, TABLE)
    # raises an error if no method is defined for the robot
    least = sl.inverse(robot, place, model, sl.MinimumNorm(variable), wrench)
    fewer_cables = is_underconstrained(robot)
    plans: dict[str, sl.Plan | None] = {"balance": least}
    if not fewer_cables:
        methods = {title: method for title, method in methods_by_name().items() if title not in LEFT_OUT}
        plans = {title: _plan(robot, place, model, method(variable), wrench) for title, method in methods.items()}
    why = reason(robot, place, least)
    margin = None if fewer_cables else float(sl.capacity_margin(least.state))
    shape = sl.tension_polygon(robot, place, model, wrench, variable) if drawn else None
    for text in least.warnings:
        show_note(f"{robot.name}: ", text)
    if not any(plan is not None and plan.feasible for plan in plans.values()):
        show_note("No tensions: ", why, style="bold red")
        return OUTSIDE
    if shape is not None:
        points = {title: plan.chord_tension for title, plan in plans.items() if plan is not None}
        output.draw(lambda: sl.plot.polygon(shape, points))
    output.table(TABLE, lambda: _rows(robot, plans))
    tensions = {title: _record(plan) for title, plan in plans.items()}

    def tell() -> None:
        _grid(robot, plans).show()
        if margin is not None:
            what = "The cables can balance this additional force in any direction"
            show_text(f"Capacity margin: {n(margin, unit='N')}. {what}.")

    count = sum(plan is not None and plan.feasible for plan in plans.values())
    verdict = f"{robot.name}: {count} of {len(plans)} methods have tensions within the limits."
    if fewer_cables:
        verdict = f"{robot.name}: the balance of the underconstrained platform determines all tensions."
    output.report(lambda: {"capacity_margin": margin, "tensions": tensions}, verdict, tell)
    return 0


def _plan(robot: sl.Robot, pose: sl.Pose, model: str, method: sl.TensionMethod, wrench: Array | None) -> sl.Plan | None:
    """The plan of a method; None if the method is not defined for the robot."""
    try:
        return sl.inverse(robot, pose, model, method, wrench)
    except sl.InvalidValueError:
        return None


def reason(robot: sl.Robot, pose: sl.Pose, plan: sl.Plan) -> str:
    """Reason why a pose is infeasible: shortfall and limiting cables, or the motion that no cable resists."""
    status = sl.PoseStatus(int(plan.status))
    if status is sl.PoseStatus.SINGULAR:
        return f"{status.text}. No cable resists {sl.unresisted_motion(robot, pose).text}"
    if status is sl.PoseStatus.INFEASIBLE:
        cables = "blocking cables " + ", ".join(str(i) for i in np.flatnonzero(plan.blocking))
        if np.isfinite(plan.shortfall):
            return f"{status.text}. Shortfall {n(plan.shortfall, unit='N')}; {cables}"
        no_force = "No change of the force alone is sufficient; " if np.isinf(plan.shortfall) else ""
        return f"{status.text}. {no_force}{cables}"
    return status.text


def _record(plan: sl.Plan | None) -> Any:
    if plan is None:
        return None
    return {"status": sl.PoseStatus(int(plan.status)).name, "chord_tension": list(map(float, plan.chord_tension))}


def _rows(robot: sl.Robot, plans: dict[str, sl.Plan | None]) -> list[list[object]]:
    """Status and tensions of each method that is defined for the robot."""
    known = {title: _record(plan) for title, plan in plans.items() if plan is not None}
    head = ["method", "status", *(f"T{k} [N]" for k in range(robot.cable_count))]
    return [head, *([title, each["status"], *each["chord_tension"]] for title, each in known.items())]


def _grid(robot: sl.Robot, plans: dict[str, sl.Plan | None]) -> TextTable:
    rows = []
    for title, plan in plans.items():
        if plan is not None and plan.feasible:
            rows.append([title, *(f"{value:.1f}" for value in plan.chord_tension), ""])
        else:
            why = "not defined" if plan is None else sl.PoseStatus(int(plan.status)).name.lower().replace("_", " ")
            rows.append([title, *[""] * robot.cable_count, why])
    heads = ["", *map(str, range(robot.cable_count)), ""]
    if not any(row[-1] for row in rows):
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    return TextTable(heads, rows, "Chord tensions [N]", left=frozenset({0, robot.cable_count + 1}))

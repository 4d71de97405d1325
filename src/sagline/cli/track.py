"""`sagline track`: the plan of a robot along a path."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from sagline.cli.options import (
    USUAL_FORMATS,
    FiguresOption,
    FigureStyle,
    FormatsOption,
    JsonOption,
    ModelName,
    ModelOption,
    OutOption,
    PayloadOption,
    RobotArgument,
    StyleOption,
    TableOption,
    Tension,
    TensionOption,
    TensionVariable,
    VariableOption,
    WrenchOption,
    argument,
)
from sagline.cli.output import Output
from sagline.cli.terminal import working
from sagline.core.errors import FileError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sagline.cli.study import ConfirmedRun
    from sagline.motion.path import Path as MotionPath
    from sagline.robot.robot import Robot

TOO_FAR = 100.0  # largest distance of a path from the robot, divided by the robot's size
FIGURES = ("path", "velocity", "cables", "error")


def track(
    robot: RobotArgument,
    path: Annotated[
        Path | None, argument("PATH", "Waypoints in .yaml, or times and poses in .csv. Default: the article's path.")
    ] = None,
    model: ModelOption = ModelName.CATENARY,
    tension: TensionOption = Tension.CLOSEST,
    variable: VariableOption = TensionVariable.CHORD,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    folder: OutOption = Path("output"),
    figures: FiguresOption = True,
    formats: FormatsOption = USUAL_FORMATS,
    style: StyleOption = FigureStyle.PLAIN,
    table: TableOption = False,
    as_json: JsonOption = False,
) -> int:
    """Plan the cable lengths of a robot along a path, and confirm them with exact catenaries.

    The confirmation gives exact catenaries the lengths of the chosen model, and finds the equilibrium of the platform.
    The position error is the distance of this equilibrium from the planned pose. The plan is written to
    DIR/ROBOT-MODEL.nc; --csv also writes poses, lengths and tensions as a table.

    For example:

        sagline track article-suspended
        sagline track own_robot.yaml own_path.yaml --model empirical --out results
        sagline track cogiro own_samples.csv --payload 20 --csv
    """
    from sagline.cli.study import run_along, run_name, tell
    from sagline.cli.values import robot_with_payload
    from sagline.files.path_file import load_path
    from sagline.motion.rest_to_rest import article_path

    machine = robot_with_payload(robot, payload)
    way = article_path() if path is None else load_path(path)
    if path is not None:
        check_unit(path, way, machine)
    cable = model.build()
    name = run_name(machine, cable)
    drawn = [f"-{figure}" for figure in FIGURES if figures]
    output = Output(folder, name, [".nc", *[".csv"] * table], drawn, formats, style)
    method = tension.build(variable)
    with working(f"{machine.name}: planning and confirming {len(way):,} poses") as line:
        run = run_along(machine, way, cable, method, line, wrench)
    with working("writing"):
        run.plan.save(output.file(".nc"))
        if table:
            output.table(".csv", run.plan.table().rows)
        if figures:
            output.draw(*_figures(run))
    return tell([run], output, as_json=as_json)


def check_unit(file: Path, way: MotionPath, robot: Robot) -> None:
    """Raise FileError if a path is so far from the robot that its numbers are probably in another unit."""
    size = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    away = np.linalg.norm(way.pose.position - robot.frame_anchors.mean(axis=0), axis=1)
    k = int(np.argmax(away))
    if away[k] > TOO_FAR * size:
        reason = (
            f"leads {away[k]:.4g} m away from {robot.name}, whose frame measures {size:.3g} m, at {way.time[k]:g} s"
        )
        raise FileError(file, reason, "If these are millimeters, write the unit: x [mm] in CSV, 1500 mm in YAML.")


def _figures(run: ConfirmedRun) -> tuple[Callable[[], Figure | Axes], ...]:
    """The figures, in the order of FIGURES."""
    from sagline import plot

    way = run.plan.path
    assert way is not None
    return (
        lambda: plot.path(way),
        lambda: plot.velocity(way),
        lambda: plot.overview(run.plan),
        lambda: plot.error(run.confirmation),
    )

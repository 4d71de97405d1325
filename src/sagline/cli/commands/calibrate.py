"""`sagline calibrate`: what a robot's anchors, zeros and cables really are."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Model
from sagline.cli.options import JsonOption, ModelOption, RobotArgument


def _deviation(what: str) -> typer.models.OptionInfo:
    found: typer.models.OptionInfo = typer.Option(
        metavar="NUMBER", help=f"Standard deviation of {what}. Default: what the log says.", show_default=False
    )
    return found


def calibrate(
    robot: RobotArgument,
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="LOG",
            help="CSV: one row a pose; count_0, ... or length_0, ..., load_cell_0, ..., and x, y, z where measured.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="The robot that was found, .yaml, or all that was found, .nc; may be given twice. With --plan: the "
            "poses, .yaml.",
            show_default=False,
        ),
    ] = None,
    unknowns: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="What is looked for, with commas between. Default: "
            "frame_anchors,length_zero,axial_stiffness,mass,center_of_mass.",
            show_default=False,
        ),
    ] = None,
    length_deviation: Annotated[str | None, _deviation("a length off a drum, counted or given, '0.5 mm'")] = None,
    tension_deviation: Annotated[str | None, _deviation("a load cell's reading, '5 N'")] = None,
    position_deviation: Annotated[str | None, _deviation("a measured coordinate, '1 mm'")] = None,
    rotation_deviation: Annotated[str | None, _deviation("a measured rotation, '1 mrad'")] = None,
    folds: Annotated[
        int, typer.Option(metavar="NUMBER", help="Parts of the poses that are predicted from the others; 0 for none.")
    ] = 5,
    robust: Annotated[
        bool, typer.Option("--robust/--no-robust", help="Poses that do not fit the rest count less.")
    ] = True,
    model: ModelOption = Model.CATENARY,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A figure of the fit: .png, .svg or .pdf.", show_default=False),
    ] = None,
    plan: Annotated[
        int | None,
        typer.Option(metavar="NUMBER", help="Choose so many poses to measure, instead of a LOG.", show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="NUMBER", help="Of the poses among which --plan chooses.")] = 0,
    as_json: JsonOption = False,
) -> int:
    """Find what a robot's anchors, zeros and cables really are, from its own readings.

    It stands at some poses; what encoders, load cells and perhaps a measuring system read there is in LOG. Told are the
    numbers with their standard errors, what the readings leave open, and which do not fit. With --plan, before anybody
    measures: the poses and tensions that tell most, and the errors to expect. Exit code 1 where the search did not
    converge, or the fit says that model or deviations are wrong.

    For example:

        sagline calibrate winches_robot.yaml winches.csv --out calibrated.yaml
        sagline calibrate winches_robot.yaml winches.csv --folds 10 --out found.nc
        sagline calibrate winches_robot.yaml --plan 40 --out poses.yaml
    """
    from sagline.cli.calibrate import Asked, Deviations, fit, plan_poses

    deviations = Deviations(length_deviation, tension_deviation, position_deviation, rotation_deviation)
    asked = Asked(robot, unknowns, deviations, tuple(out or ()), plot)
    if plan is not None:
        return plan_poses(asked, plan, seed, log, as_json=as_json)
    return fit(asked, log, model.build(), folds, robust=robust, as_json=as_json)

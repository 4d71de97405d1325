"""`sagline forward` and `sagline tension`: single poses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Model, Variable
from sagline.cli.options import (
    JsonOption,
    ModelOption,
    OutOption,
    PayloadOption,
    RobotArgument,
    VariableOption,
    WrenchOption,
)


def forward(
    robot: RobotArgument,
    lengths: Annotated[
        Path, typer.Argument(metavar="CSV", help="Columns L0, L1, ... and perhaps time; units in brackets: L0 [mm].")
    ],
    counts: Annotated[
        bool,
        typer.Option("--counts", help="The columns are C0, C1, ...: counts of the encoders of the robot's winches."),
    ] = False,
    model: ModelOption = Model.CATENARY,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    out: OutOption = Path("output"),
    as_json: JsonOption = False,
) -> int:
    """Find the poses in which the platform rests on cables of measured lengths.

    The first sample needs no start; each other begins where the last one ended. Exit code 1 where a sample
    ends in no stable equilibrium.

    For example:

        sagline forward cogiro lengths.csv --out poses
        sagline forward my_robot.yaml counts.csv --counts
    """
    from sagline.cli.forward import forward as run

    return run(robot, lengths, model, wrench, payload, out, counts=counts, as_json=as_json)


def tension(
    robot: RobotArgument,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z[,A,B,C]",
            help="Position [m] and angles about z, y, x [degrees]. Default: the middle of the robot's test box.",
        ),
    ] = None,
    model: ModelOption = Model.CATENARY,
    variable: VariableOption = Variable.CHORD,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    out: OutOption = Path("output"),
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Draw the polygon, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> int:
    """Share the load of one pose in nine ways, and draw the polygon of feasible tensions with all of them in it.

    Three ways are left out: at one pose, without targets, Closest and QuadraticProgram choose what MinimumNorm
    does; PolygonWalk, by its optimum, what LowestSum, MinimumNorm or Centroid does.

    For example:

        sagline tension article-mixed --pose 1,0.5,2.5
        sagline tension cogiro --pose 0,0,2,10,0,0 --variable frame_end --no-figures
    """
    from sagline.cli.tension import tension as run

    return run(robot, pose, model, variable, wrench, payload, out, figures=figures, as_json=as_json)

"""`sagline track`, `sagline run`, `sagline lengths`, `sagline encoder`: along a path."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Model, Tension, Variable, Winding
from sagline.cli.options import (
    JsonOption,
    ModelOption,
    OutOption,
    PayloadOption,
    RobotArgument,
    VariableOption,
    WrenchOption,
)


def track(
    robot: RobotArgument,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="PATH",
            help="Waypoints in .yaml, or time and pose in .csv. Default: the article's path.",
            show_default=False,
        ),
    ] = None,
    model: ModelOption = Model.CATENARY,
    tension: Annotated[
        Tension,
        typer.Option(
            metavar="METHOD",
            help=f"How the load is shared among redundant cables: {', '.join(each.value for each in Tension)}.",
        ),
    ] = Tension.CLOSEST,
    variable: VariableOption = Variable.CHORD,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    out: OutOption = Path("output"),
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Draw figures, as PNG and SVG.")] = True,
    table: Annotated[
        bool, typer.Option("--csv", help="Write the plan as DIR/ROBOT-MODEL.csv too: poses, lengths, tensions.")
    ] = False,
    as_json: JsonOption = False,
) -> int:
    """Plan a robot's cable lengths along a path, and prove them with the exact cable.

    The lengths of the chosen model are wound onto exact catenaries; the position error is where the platform then
    really rests, less where it was planned. The plan is written to DIR/ROBOT-MODEL.nc.

    For example:

        sagline track article-suspended
        sagline track own_robot.yaml own_path.yaml --model empirical --out results
        sagline track cogiro own_samples.csv --payload 20 --csv
    """
    from sagline.cli.track import track as run

    return run(
        robot, path, model, tension, variable, wrench, payload, out, figures=figures, table=table, as_json=as_json
    )


def run(out: OutOption = Path("output"), as_json: JsonOption = False) -> int:
    """Run the article's test: both simulated robots, its empirical model and the exact one, figures 18 to 22.

    Tensions are the least norm of the horizontal tensions T_x, as the article's figures show them.
    """
    from sagline.cli.run import run_article

    return run_article(out, as_json=as_json)


def lengths(
    plan: Annotated[Path, typer.Argument(metavar="RUN.nc", help="A run written by sagline track.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write. Default: stdout.", show_default=False)
    ] = None,
) -> int:
    """Take the planned lengths out of a run: a row a sample, as `sagline forward` reads them and controllers do.

    Rows are feasible ones; how many are not, and so are left out, is told on stderr (exit code 1).

    For example:

        sagline lengths output/cogiro-catenary.nc --out lengths.csv
    """
    from sagline.cli.lengths import write_lengths

    return write_lengths(plan, out)


def encoder(
    plan: Annotated[Path, typer.Argument(metavar="RUN.nc", help="A run written by sagline track.", show_default=False)],
    winding: Annotated[
        Winding,
        typer.Option(
            metavar="WINDING",
            help="What lies on the drums: constant, cable at the winches' winding_tension; remembered, cable wound "
            "along the run at the tension it had there.",
        ),
    ] = Winding.CONSTANT,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write. Default: stdout.", show_default=False)
    ] = None,
) -> int:
    """Take the counts of the encoders out of a run: a row a sample, for the drives.

    The robot's winches must say drum_radius, groove_pitch, counts_per_turn and length_zero, its cables their diameter.
    Rows are feasible ones. Exit code 1 where some are not, or winches would exceed their speed_limit or torque_limit.

    For example:

        sagline encoder output/my-robot-catenary.nc --out counts.csv
    """
    from sagline.cli.lengths import write_counts

    return write_counts(plan, winding, out)

"""`sagline design`: better robots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.options import JsonOption, RobotArgument


def design(
    robot: RobotArgument,
    file: Annotated[
        Path, typer.Argument(metavar="DESIGN", help="What may change and what should be better, design.yaml.")
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for what is found; a search in it is gone on with.")
    ] = Path("front"),
    evaluations: Annotated[
        str | None,
        typer.Option(metavar="NUMBER", help="Robots that are tried. Default: as the file says.", show_default=False),
    ] = None,
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Draw what was tried and found, as PNG and SVG.")
    ] = True,
    as_json: JsonOption = False,
) -> None:
    r"""Search for a better robot: anchors, cables and limits that may change, and goals, stand in a file.

    Found robots are ordinary robot files; front.csv lists them. Whatever is rated is kept in the folder at once: after
    Ctrl-C, or with more --evaluations, the same command goes on from there.

    For example:

        sagline design own_robot.yaml design.yaml --out front
        sagline design own_robot.yaml design.yaml --out front \
            --evaluations 600
    """
    from sagline.cli.design import design as run

    run(robot, file, out, evaluations, figures=figures, as_json=as_json)

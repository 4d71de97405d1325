"""Arguments and options that several subcommands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Model, Variable, robot_completions

RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A preset (see sagline robots) or a robot file, robot.yaml.",
        autocompletion=robot_completions,
    ),
]
OutOption = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; created if missing.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the numbers as JSON and nothing else on stdout.")]
ModelOption = Annotated[
    Model, typer.Option(metavar="MODEL", help=f"Cable model: {', '.join(model.value for model in Model)}.")
]
VariableOption = Annotated[
    Variable,
    typer.Option(
        metavar="VARIABLE", help=f"The tension in which it is shared: {', '.join(each.value for each in Variable)}."
    ),
]
WrenchOption = Annotated[
    str | None,
    typer.Option(
        metavar="FX,FY,FZ[,MX,MY,MZ]",
        help="Force [N] and moment [N m] that act on the platform besides its weight: at its center of mass, along "
        "the world's axes.",
    ),
]
PayloadOption = Annotated[
    str | None,
    typer.Option(
        metavar="MASS",
        help="Mass that the platform carries besides its own, 20 or '20 kg'; its inertia grows in proportion.",
    ),
]

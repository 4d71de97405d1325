"""`sagline workspace`: where a robot can work."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Model
from sagline.cli.options import JsonOption, ModelOption, OutOption, PayloadOption, RobotArgument

LoadsOption = Annotated[
    str | None,
    typer.Option(
        metavar="LOADS",
        help="Loads that the platform bears all over it besides its weight: '±100 N, ±20 N m', accelerations "
        "'±2 m/s^2, ±1 rad/s^2', both, or one wrench FX,FY,FZ[,MX,MY,MZ].",
        show_default=False,
    ),
]


def _limit(metavar: str, text: str) -> typer.models.OptionInfo:
    found: typer.models.OptionInfo = typer.Option(metavar=metavar, help=text, show_default=False)
    return found


def workspace(
    robot: RobotArgument,
    wrench: LoadsOption = None,
    payload: PayloadOption = None,
    tilt: Annotated[
        str | None, _limit("ANGLE", "The platform has to tilt so far about any axis, '10deg'. Default: it is level.")
    ] = None,
    box: Annotated[
        str | None, _limit("BOX", "Where to look: '-2..2, -1..1, 1..3 m'. Default: the robot's frame.")
    ] = None,
    reserve: Annotated[str | None, _limit("FORCE", "Margin that is left everywhere [N].")] = None,
    max_sag: Annotated[str | None, _limit("LENGTH", "No cable sags further, '5 cm'.")] = None,
    min_stiffness: Annotated[
        str | None, _limit("NUMBER", "A force moves the platform no further than force over this [N/m].")
    ] = None,
    min_frequency: Annotated[str | None, _limit("HZ", "The platform swings no slower, cables without mass.")] = None,
    clearance: Annotated[str | None, _limit("LENGTH", "Cables, and what they pass, stay so far apart, '3 cm'.")] = None,
    scene: Annotated[
        str | None,
        _limit("FILE", "With --clearance: a robot file with a scene, or a mesh in meters. Default: the robot's scene."),
    ] = None,
    in_frame: Annotated[bool, typer.Option("--in-frame", help="The whole platform stays within the frame.")] = False,
    to_prove: Annotated[
        str | None,
        typer.Option("--prove", metavar="BOX", help="Prove that it can work in all of this box.", show_default=False),
    ] = None,
    budget: Annotated[str, typer.Option(metavar="TIME", help="Of the proof [s].")] = "10",
    cells: Annotated[
        int, typer.Option(metavar="NUMBER", help="Cells of the grid along the longest edge of the box.")
    ] = 32,
    model: ModelOption = Model.CATENARY,
    out: OutOption = Path("output"),
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Draw hull and slice, as PNG and SVG.")
    ] = True,
    as_json: JsonOption = False,
) -> int:
    """Find where a robot can work: volume with its error bar, and what limits it where.

    The platform can be held wherever the cables, as they sag, bear all loads within their limits. DIR has the workspace
    in NetCDF, its hull in GLB and figures. Exit code 1 where it is empty, when the nearest pose is told, and where not
    all of the box of --prove is proved.

    For example:

        sagline workspace article-suspended
        sagline workspace cogiro --wrench "±100 N, ±20 N m" --tilt 10deg
        sagline workspace article-suspended --prove "-2..2, -1..1, 1..3 m"
        sagline workspace ipanema-1 --max-sag "5 cm" --box "-1..1, -1..1, 0..2 m"
    """
    from sagline.cli.workspace import Asked, How, Where, find

    asked = Asked(reserve, max_sag, min_stiffness, min_frequency, clearance, scene, in_frame)
    where = Where(wrench, payload, tilt, box, to_prove, budget)
    return find(robot, where, asked, How(cells, model.build()), out, figures=figures, as_json=as_json)

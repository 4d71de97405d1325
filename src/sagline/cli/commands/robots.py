"""`sagline robots`, `show`, `new`, `convert`, `export-c`, `export-scl`, `examples`: robots and their files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import Format
from sagline.cli.options import JsonOption, RobotArgument


def robots(as_json: JsonOption = False) -> None:
    """List the robots that come with sagline."""
    from sagline.cli.robots import list_robots

    list_robots(as_json=as_json)


def show(robot: RobotArgument, as_json: JsonOption = False) -> None:
    """Show every value of a robot with its unit; what its source does not give is marked, with the reason.

    For example:

        sagline show ipanema-1
        sagline show own_robot.yaml --json
    """
    from sagline.cli.robots import show_robot

    show_robot(robot, as_json=as_json)


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The robot file to write, my_robot.yaml.")],
    frame: Annotated[str | None, typer.Option(metavar="SIZE", help='Edges of the frame, "6 x 4 x 3 m".')] = None,
    layout: Annotated[
        str | None, typer.Option(metavar="LAYOUT", help="Cables from the top, or mixed: from above and below.")
    ] = None,
    cables: Annotated[str | None, typer.Option(metavar="NUMBER", help="Number of cables, 6 to 8.")] = None,
    platform: Annotated[
        str | None, typer.Option(metavar="SIZE", help='Edges of the platform, "0.5 x 0.5 x 0.4 m".')
    ] = None,
    mass: Annotated[
        str | None, typer.Option(metavar="MASS", help='Mass of the platform with its load, "30 kg".')
    ] = None,
    rope: Annotated[
        str | None,
        typer.Option(metavar="ROPE", help="What the cables are: dyneema-sk78, dyneema-sk62, steel-6x19, steel-7x19."),
    ] = None,
    diameter: Annotated[str | None, typer.Option(metavar="LENGTH", help='Diameter of the rope, "4 mm".')] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
    look: Annotated[bool, typer.Option("--view", help="Look at it in the browser afterwards.")] = False,
) -> int:
    r"""Make a robot file of your own: asks for what no option says, checks it, explains it.

    Without a terminal, answers are the lines of the input; an empty line takes the default.

    For example:

        sagline new my_robot.yaml
        sagline new my_robot.yaml --frame "15 x 11 x 6 m" --mass "50 kg" \
            --rope steel-6x19 --diameter "3 mm"
    """
    from sagline.cli.new import new as make

    answers = {
        "frame": frame, "layout": layout, "cables": cables, "platform": platform, "mass": mass, "rope": rope,
        "diameter": diameter,
    }  # fmt: skip
    machine = make(file, answers, force=force)
    if not look:
        return 0
    from sagline.cli.view import serve

    return serve(machine, file, "127.0.0.1", 8080, browser=True)


def convert(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="A WireX file, robot.wcrfx; the folder of a CASPR robot, or its .xml; a robot file; or a preset.",
        ),
    ],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write. Default: stdout.")] = None,
    form: Annotated[
        Format,
        typer.Option(
            "--format", metavar="FORMAT", help="robot: a robot file in YAML; mjcf: a MuJoCo model with straight cables."
        ),
    ] = Format.ROBOT,
    linear_density: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="Mass of all cables per length, '65 g/m' for instance.")
    ] = None,
    axial_stiffness: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="EA of all cables, '700 kN' for instance.")
    ] = None,
    cable_set: Annotated[
        str | None, typer.Option(metavar="NAME", help="CASPR: which set of cables. Default: the file's own.")
    ] = None,
    at: Annotated[
        tuple[str, str, str] | None,
        typer.Option(metavar="X Y Z", help="MuJoCo: where the platform starts, in m. Default: middle of the test box."),
    ] = None,
) -> None:
    r"""Convert a robot of CASPR or WireX to a robot file, or any robot to a MuJoCo model.

    What had to be assumed and what was lost is told on stderr, and stands in the robot file.

    For example:

        sagline convert robot.wcrfx --out robot.yaml
        sagline convert robot.wcrfx --out my_robot.yaml \
            --linear-density "20 g/m" --axial-stiffness "50 kN"
        sagline convert cogiro --format mjcf --out cogiro.xml
    """
    from sagline.cli.convert import convert as run

    run(source, out, form, linear_density, axial_stiffness, cable_set, at)


def export_c(
    robot: RobotArgument,
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="The source, sagline.c; header and SCL text stand beside it.")
    ] = Path("sagline.c"),
    single: Annotated[
        bool, typer.Option("--float", help="Single precision, for controllers that compute no other in hardware.")
    ] = False,
) -> None:
    """Write C99 that finds a robot's tensions and lengths on a microcontroller, and a cable's length in SCL for a PLC.

    The source needs no heap and answers every call with a status; tensions are those of Closest or MinimumNorm. It
    covers robots with two redundant cables and nothing behind their frame anchors.

    For example:

        sagline export-c article-prototype --out sagline.c
        sagline export-c own_robot.yaml --out robot.c --float
    """
    from sagline.cli.export_c import export

    export(robot, out, single_precision=single)


def export_scl(
    robot: RobotArgument,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The source.")] = Path("plc.scl"),
) -> None:
    """Write the PLCs' side of a robot as SCL source for TIA Portal: data blocks, limits, and the program of a group.

    The program grants control to one controller at a time, keeps to the limits, and slows the winches down by itself
    when commands stay away. No compiler has seen it; its head says what is to be set in the CPU.

    For example:

        sagline export-scl article-prototype --out plc.scl
    """
    from sagline.cli.export_scl import export

    export(robot, out)


def examples(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; created if missing.")] = Path(
        "sagline-examples"
    ),
    force: Annotated[bool, typer.Option("--force", help="Replace files that exist.")] = False,
) -> None:
    """Write the files that the documentation's commands work with: a robot, a path, lengths, measurements, scripts.

    For example:

        sagline examples --out DIR
        cd DIR
        sagline track own_robot.yaml own_path.yaml
    """
    from sagline.cli.examples import write_examples

    write_examples(out, force=force)

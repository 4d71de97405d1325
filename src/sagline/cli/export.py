"""`sagline export-c` and `sagline export-scl`: source for the microcontroller or the PLCs of a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sagline.cli.entries import INVERSE
from sagline.cli.options import RobotArgument, flag, option
from sagline.cli.terminal import note, show, working


def export_c(
    robot: RobotArgument,
    out: Annotated[Path, option("FILE", "The source, sagline.c; header and SCL text stand beside it.", "--out")] = Path(
        "sagline.c"
    ),
    single_precision: Annotated[
        bool, flag("Single precision, for controllers that compute no other in hardware.", "--float")
    ] = False,
) -> None:
    """Write C99 that finds a robot's tensions and lengths on a microcontroller, and a cable's length in SCL for a PLC.

    The source needs no heap and answers every call with a status; tensions are those of Closest or MinimumNorm. It
    covers robots with two redundant cables and nothing behind their frame anchors.

    For example:

        sagline export-c article-prototype --out sagline.c
        sagline export-c own_robot.yaml --out robot.c --float
    """
    from sagline.files.controller_source import export_c
    from sagline.files.robot_file import load_robot

    loaded = load_robot(robot)
    source, header, scl = export_c(loaded, out, single_precision=single_precision)
    precision = "single" if single_precision else "double"
    note(f"{loaded.name}: ", f"{loaded.cable_count} cables, {loaded.motion_pattern}, {precision} precision")
    show(f"{source}: C99, the same for every robot; cc -std=c99 -O2 -c {source.name}", whole=True)
    show(f"{header}: this robot's constants, and what is offered", whole=True)
    show(f"{scl}: P3 in SCL for a Siemens PLC, which no compiler has seen yet", whole=True)


def export_scl(
    robot: RobotArgument,
    out: Annotated[Path, option("FILE", "The source.", "--out")] = Path("plc.scl"),
) -> None:
    """Write the PLCs' side of a robot as SCL source for TIA Portal: data blocks, limits, and the program of a group.

    The program grants control to one controller at a time, keeps to the limits, and slows the winches down by itself
    when commands stay away. No compiler has seen it; its head says what is to be set in the CPU.

    For example:

        sagline export-scl article-prototype --out plc.scl
    """
    from sagline.control.link import groups_of
    from sagline.files.controller_source import export_scl
    from sagline.files.robot_file import load_robot

    loaded = load_robot(robot)
    with working("", INVERSE):
        path = export_scl(loaded, out)
    groups = len(groups_of(loaded.cable_count))
    show(f"{path}: SCL for the {groups} PLCs of {loaded.name}, which no compiler has seen yet", whole=True)

"""`sagline export-c` and `sagline export-scl`: source code for a robot's microcontroller or PLCs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sagline.cli.options import (
    OutOption,
    RobotArgument,
    Tension,
    TensionVariable,
    VariableOption,
    choice_option,
    flag,
)
from sagline.cli.output import file_of
from sagline.cli.terminal import show_note, show_text
from sagline.files.writing import create_folder


def export_c(
    robot: RobotArgument,
    out: OutOption = Path("sagline.c"),
    tension: Annotated[
        list[Tension] | None,
        choice_option("METHOD", "Tension distribution method", Tension),
    ] = None,
    variable: VariableOption = TensionVariable.CHORD,
    forward: Annotated[bool, flag("Write the forward kinematics too.", "--forward")] = False,
    single_precision: Annotated[
        bool, flag("Single precision, for controllers without double precision in hardware.", "--float")
    ] = False,
) -> None:
    """Write C99 source of a robot's kinematics for a microcontroller, and SCL source of a cable's length for a PLC.

    The source has the kernels of sagline, including pulleys. They compute the tensions and lengths of a pose and, with
    --forward, the pose of given lengths. The source needs no heap, and every call returns a status. The header and the
    SCL file are written next to the source. --tension can be repeated.

    For example:

        sagline export-c article-prototype --out sagline.c
        sagline export-c own_robot.yaml --out robot.c --float --forward
        sagline export-c cogiro --tension minimum-norm --tension centroid
    """
    from sagline.files.c_source import export_c
    from sagline.files.robot_file import load_robot

    loaded = load_robot(robot)
    methods = [each.build(variable) for each in tension or [Tension.CLOSEST]]
    target = file_of(out, "sagline.c")
    create_folder(target.parent)
    source, header, scl = export_c(loaded, target, tension=methods, forward=forward, single_precision=single_precision)
    precision = "single" if single_precision else "double"
    show_note(f"{loaded.name}: ", f"{loaded.cable_count} cables, {loaded.motion_pattern}, {precision} precision")
    show_text(f"{source}: C99; cc -std=c99 -O2 -ffp-contract=off -c {source.name}", whole=True)
    show_text(f"{header}: the declarations", whole=True)
    show_text(f"{scl}: P3 in SCL for a Siemens PLC, not compiled yet", whole=True)


def export_scl(
    robot: RobotArgument,
    out: OutOption = Path("plc.scl"),
) -> None:
    """Write SCL source for the PLCs of a robot, for TIA Portal: data blocks, limits, and the program of one group.

    The program accepts commands of one controller at a time. It enforces the limits, and slows the winches down when
    commands are missing. It has not been compiled yet; the comment at its head lists the settings of the CPU.

    For example:

        sagline export-scl article-prototype --out plc.scl
    """
    from sagline.control.link import groups_of
    from sagline.files.c_source import export_scl
    from sagline.files.robot_file import load_robot

    loaded = load_robot(robot)
    target = file_of(out, "plc.scl")
    create_folder(target.parent)
    path = export_scl(loaded, target)
    groups = len(groups_of(loaded.cable_count))
    show_text(f"{path}: SCL for the {groups} PLCs of {loaded.name}, not compiled yet", whole=True)

"""`sagline export-c`: a robot for a microcontroller."""

from __future__ import annotations

from pathlib import Path

from sagline.cli.terminal import note, show
from sagline.files.c_source import export_c
from sagline.files.robot_file import load_robot


def export(robot: str, out: Path, *, single_precision: bool) -> None:
    """Write source, header and SCL text, and say what they are.

    Args:
        robot: A preset or the path of a robot file.
        out: The source to write.
        single_precision: Whether numbers are `float`.

    Raises:
        SaglineError: If the robot is wrong, the source does not cover it, or the files cannot be written.
    """
    loaded = load_robot(robot)
    source, header, scl = export_c(loaded, out, single_precision=single_precision)
    precision = "single" if single_precision else "double"
    note(f"{loaded.name}: ", f"{loaded.cable_count} cables, {loaded.motion_pattern}, {precision} precision")
    show(f"{source}: C99, the same for every robot; cc -std=c99 -O2 -c {source.name}", whole=True)
    show(f"{header}: this robot's constants, and what is offered", whole=True)
    show(f"{scl}: P3 in SCL for a Siemens PLC, which no compiler has seen yet", whole=True)

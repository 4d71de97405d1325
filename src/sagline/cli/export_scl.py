"""`sagline export-scl`: what the PLCs of a robot need."""

from __future__ import annotations

from pathlib import Path

from sagline.cli.entries import INVERSE
from sagline.cli.terminal import show, working
from sagline.control.link import groups_of
from sagline.files.plc_source import export_scl
from sagline.files.robot_file import load_robot


def export(robot: str, out: Path) -> None:
    """Write the source, and say what it is.

    Args:
        robot: A preset or the path of a robot file.
        out: The file.

    Raises:
        SaglineError: If data of the winches are missing, or the file cannot be written.
    """
    loaded = load_robot(robot)
    with working("", INVERSE):
        path = export_scl(loaded, out)
    groups = len(groups_of(loaded.cable_count))
    show(f"{path}: SCL for the {groups} PLCs of {loaded.name}, which no compiler has seen yet", whole=True)

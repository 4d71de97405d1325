"""`sagline convert`: robots of other tools in, robot files and MuJoCo models out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from sagline.cables.cable import Cable
from sagline.cables.elastic import Elastic
from sagline.cli.choices import Format
from sagline.cli.entries import FORWARD, INVERSE
from sagline.cli.terminal import note, working
from sagline.errors import FileError, InvalidValueError
from sagline.files.imported import Imported
from sagline.files.quantity import in_si
from sagline.files.robot_file import dump_robot, load_robot
from sagline.files.whole import write_text
from sagline.kinematics.confirm import confirm
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from sagline.robot.robot import Robot


def convert(
    source: str,
    out: Path | None,
    form: Format,
    density: str | None,
    stiffness: str | None,
    cable_set: str | None,
    at: tuple[float, float, float] | None,
) -> None:
    """Read, convert, write to a file or to stdout, and report on stderr.

    Raises:
        SaglineError: If the source is wrong, cannot be converted, or the file cannot be written.
    """
    if out is not None and Path(source).exists() and out.resolve() == Path(source).resolve():
        raise FileError(out, "is the file to convert", "Name another file with --out.")
    imported = _read(source, _material(density, stiffness), cable_set)
    if form is Format.ROBOT:
        text = dump_robot(imported.robot)
    else:
        text, straightness = _mjcf(imported.robot, at)
        imported = replace(imported, lost=(*imported.lost, straightness))
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_text(out, text)
    _report(imported, out)


def _read(source: str, cables: Cable | None, cable_set: str | None) -> Imported:
    path = Path(source)
    if path.suffix.lower() == ".wcrfx":
        from sagline.files.wirex import load_wirex

        return load_wirex(path, cables)
    if path.suffix.lower() == ".xml" or path.is_dir():
        from sagline.files.caspr import load_caspr

        return load_caspr(path, cables, cable_set)
    robot = load_robot(source)
    return Imported(robot if cables is None else robot.replace(cables=cables), ())


def _material(density: str | None, stiffness: str | None) -> Cable | None:
    if density is None and stiffness is None:
        return None
    if density is None or stiffness is None:
        missing = "--linear-density" if density is None else "--axial-stiffness"
        raise InvalidValueError(missing, "missing", "both or none of the two", f"Add {missing}.")
    values = [
        in_si(text, unit, item)
        for text, unit, item in ((density, "kg/m", "--linear-density"), (stiffness, "N", "--axial-stiffness"))
    ]
    return Cable(*values)


def _mjcf(robot: Robot, at: tuple[float, float, float] | None) -> tuple[str, str]:
    """The model, and what it costs this robot that its tendons neither sag nor weigh."""
    from sagline.files.mjcf import dump_mjcf

    if at is None and robot.test_box is None:
        raise InvalidValueError("--at", "missing", "X Y Z in m", "Say where the platform starts.")
    position = at if at is not None else 0.5 * (robot.test_box.low + robot.test_box.high)  # type: ignore[union-attr]
    pose = Pose.from_euler(position, 0.0, 0.0, 0.0)
    with working(f"{robot.name}: planning and confirming one pose", INVERSE, FORWARD):
        text = dump_mjcf(robot, pose)
        proof = confirm(inverse(robot, pose, model=Elastic()))
    away = float(np.linalg.norm(proof.position_error))
    distance = f"{away:.2g} m" if away >= 0.1 else f"{max(1e3 * away, 0.001):.2g} mm"
    held = f"hold the platform {distance} away" if proof.held else "do not hold the platform near it"
    return text, f"Sag and weight of the cables: sagging cables of these lengths {held}."


def _report(imported: Imported, out: Path | None) -> None:
    robot = imported.robot
    note(f"{robot.name}: ", f"{robot.cable_count} cables, {robot.motion_pattern}" + (f", in {out}" if out else ""))
    for field, why in robot.assumed.items():
        note("Assumed: ", f"{field}: {why}")
    for what in imported.lost:
        note("Lost: ", what)

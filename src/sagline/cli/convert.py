"""`sagline convert`: conversion of robots of other tools to robot files, and of any robot to a MuJoCo model."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from sagline.cli.options import (
    FileOption,
    argument,
    only_with,
    option,
    quantity_option,
)
from sagline.cli.output import file_of
from sagline.cli.terminal import show_data, show_note
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.numbers import n
from sagline.files.writing import create_folder, write_text

if TYPE_CHECKING:
    from sagline.cables.cable import Cable
    from sagline.files.robot_xml import Imported
    from sagline.robot.robot import Robot


class _Format(StrEnum):
    """Formats of the output."""

    ROBOT = "robot"
    MJCF = "mjcf"


LEAST = 1e-6  # smallest position error that is printed [m]
ENDINGS = {_Format.ROBOT: (".yaml", ".yml"), _Format.MJCF: (".xml", ".mjcf")}


def convert(
    source: Annotated[
        str,
        argument(
            "SOURCE", "A WireX file, robot.wcrfx; the folder of a CASPR robot, or its .xml; a robot file; or a preset."
        ),
    ],
    out: FileOption = None,
    form: Annotated[
        _Format, option("KIND", "robot: a robot file in YAML; mjcf: a MuJoCo model with straight cables.", "--kind")
    ] = _Format.ROBOT,
    linear_density: Annotated[
        float | None,
        quantity_option("QUANTITY", "Linear density of all cables, for instance '65 g/m'.", "kg/m"),
        only_with("--axial-stiffness"),
    ] = None,
    axial_stiffness: Annotated[
        float | None,
        quantity_option("QUANTITY", "Axial stiffness EA of all cables, for instance '700 kN'.", "N"),
        only_with("--linear-density"),
    ] = None,
    cable_set: Annotated[str | None, option("NAME", "CASPR: name of the cable set. Default: that of the file.")] = None,
    at: Annotated[
        tuple[str, str, str] | None,
        option("X Y Z", "MuJoCo: initial position of the platform [m]. Default: middle of the test box."),
    ] = None,
) -> None:
    r"""Convert a robot of CASPR or WireX to a robot file, or convert any robot to a MuJoCo model.

    Assumptions, and data of the input that are lost, are printed on stderr and written into the robot file.

    For example:

        sagline convert robot.wcrfx --out robot.yaml
        sagline convert robot.wcrfx --out my_robot.yaml \
            --linear-density "20 g/m" --axial-stiffness "50 kN"
        sagline convert cogiro --kind mjcf --out cogiro.xml
    """
    from sagline.core.arrays import FARTHEST
    from sagline.files.pose_text import decimal_numbers
    from sagline.files.robot_file import dump_robot

    out = out if out is None else file_of(out, f"{Path(source).stem}{ENDINGS[form][0]}")
    if out is not None and Path(source).exists() and out.resolve() == Path(source).resolve():
        raise FileError(out, "is the file to convert", "Name another file with --out.")
    if out is not None and out.suffix.lower() not in ENDINGS[form]:
        kind = "a robot file" if form is _Format.ROBOT else "a MuJoCo model"
        raise FileError(
            out, f"is not a valid name for {kind}", f"Let it end in {ENDINGS[form][0]}, or choose another --kind."
        )
    if at is not None and form is _Format.ROBOT:
        raise InvalidValueError(
            "--at", "given for a robot file", "--kind mjcf", "A robot file contains no pose. Leave the option out."
        )
    place = None if at is None else decimal_numbers(at, "--at", "m", FARTHEST)
    imported = _read(source, _material(linear_density, axial_stiffness), cable_set)
    if form is _Format.ROBOT:
        text = dump_robot(imported.robot)
    else:
        text, straightness = _mjcf(imported.robot, place)
        imported = replace(imported, lost=(*imported.lost, straightness))
    if out is None:
        show_data(text)
    else:
        create_folder(out.parent)
        write_text(out, text)
    _report(imported, out)


def _read(source: str, cables: Cable | None, cable_set: str | None) -> Imported:
    from sagline.files.robot_file import load_robot
    from sagline.files.robot_xml import Imported

    path = Path(source)
    is_caspr = path.suffix.lower() == ".xml" or path.is_dir()
    if cable_set is not None and not is_caspr:
        raise InvalidValueError("--cable-set", repr(cable_set), "none except for CASPR", "Leave it out.")
    if path.suffix.lower() == ".wcrfx":
        from sagline.files.wirex import load_wirex

        return load_wirex(path, cables)
    if is_caspr:
        from sagline.files.caspr import load_caspr

        return load_caspr(path, cables, cable_set)
    robot = load_robot(source)
    return Imported(robot if cables is None else robot.replace(cables=cables), ())


def _material(density: float | None, stiffness: float | None) -> Cable | None:
    from sagline.cables.cable import Cable

    return None if density is None or stiffness is None else Cable(density, stiffness)


def _mjcf(robot: Robot, at: list[float] | None) -> tuple[str, str]:
    """The MuJoCo model of `robot`, and its position error, which results from tendons without sag and weight."""
    from sagline.cables.models import Elastic
    from sagline.files.mjcf import dump_mjcf
    from sagline.kinematics.confirm import confirm
    from sagline.kinematics.inverse import inverse
    from sagline.robot.pose import Pose

    if at is None and robot.test_box is None:
        raise InvalidValueError("--at", "missing", "X Y Z in m", "Give the initial position of the platform.")
    position = at if at is not None else 0.5 * (robot.test_box.low + robot.test_box.high)  # type: ignore[union-attr]
    pose = Pose.from_euler(position, 0.0, 0.0, 0.0)
    text = dump_mjcf(robot, pose)
    proof = confirm(inverse(robot, pose, model=Elastic()))
    away = float(np.linalg.norm(proof.position_error))
    held = (
        f"hold the platform {n(1e3 * max(away, LEAST), '.2g', 'mm')} away"
        if proof.held
        else "do not hold the platform near it"
    )
    return text, f"Sag and weight of the cables: sagging cables of these lengths {held}."


def _report(imported: Imported, out: Path | None) -> None:
    robot = imported.robot
    show_note(f"{robot.name}: ", f"{robot.cable_count} cables, {robot.motion_pattern}" + (f", in {out}" if out else ""))
    for field, why in robot.assumed.items():
        show_note("Assumed: ", f"{field}: {why}")
    for what in imported.lost:
        show_note("Lost: ", what)

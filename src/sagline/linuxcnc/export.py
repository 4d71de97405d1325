"""Kinematics of a robot as a module of LinuxCNC: the C source of the robot, with functions and pins for the control."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from sagline.core.arguments import brief, choice, file_path, instance
from sagline.core.errors import InvalidValueError
from sagline.files.c_source import filled, origin, source_of
from sagline.files.writing import atomic_files, create_folder
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.inverse import equilibrium_at
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import PoseLike, single_pose
from sagline.robot.reach import home_pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import DEFAULT, method_of

Unit = Literal["mm", "inch", "m"]
PER_METER: Final = {"mm": 1000.0, "inch": 1.0 / 0.0254, "m": 1.0}
MOST_JOINTS: Final = 16  # of LinuxCNC
NAME: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")


def export_linuxcnc(
    robot: Robot,
    folder: str | os.PathLike[str],
    *,
    name: str = "cablekins",
    unit: Unit = "mm",
    tension: TensionMethod | str = DEFAULT,
    home: PoseLike | None = None,
) -> tuple[Path, Path]:
    """Write the kinematics of a robot as a module for LinuxCNC, with sagging cables, pulleys and dead lengths.

    NAME.c is a module for LinuxCNC in user space, with the functions `kinematicsInverse` and `kinematicsForward`. The
    world position is X, Y, Z of the platform origin and A, B, C, rotations about the fixed axes x, y, z in this order
    (`Pose.from_euler(position, C, B, A)`). The joints are the unstrained lengths off the drums. Input pins
    `NAME.force-x` to `NAME.moment-z` are a wrench on the platform, `NAME.tension-0` and so on are the tensions of the
    last command [N], and `NAME.status` is the status of the last call in the C source. NAME.ini contains the settings
    for the INI file of the machine.

    Args:
        robot: The robot, with at most 16 cables; its winches may have pulleys and dead lengths, but no guides.
        folder: Folder of the files, created if it is missing; existing files are replaced.
        name: Name of the module: lower-case letters, digits and underscores.
        unit: Unit of lengths of the machine, LINEAR_UNITS in its INI file: "mm", "inch" or "m".
        tension: Tension distribution method. `Closest` gives the tensions of least norm, as for a single pose.
        home: Pose whose lengths become the home positions in NAME.ini. None: the middle of the test box of the robot,
            or of its frame.

    Returns:
        Paths of the source and of the settings.

    Raises:
        InvalidValueError: If an argument has the wrong type, the robot has too many cables or guides, or the home pose
            has no solution.
        FileError: If a file cannot be written, or the package was not built.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> source, settings = sl.export_linuxcnc(robot, ".")

    Source:
        LinuxCNC 2.9, Developer Manual, Kinematics.
    """
    instance(robot, Robot, "robot")
    place = file_path(folder, "folder", folder=True)
    choice(unit, "unit", get_args(Unit))
    if not NAME.fullmatch(instance(name, str, "name")):
        allowed = "lower-case letters, digits and _, a letter first, at most 40"
        raise InvalidValueError("name", brief(name), allowed, "Give for example cablekins.")
    if robot.cable_count > MOST_JOINTS:
        allowed = f"at most {MOST_JOINTS}, the joints of LinuxCNC"
        raise InvalidValueError("cables", str(robot.cable_count), allowed, "Export it with export_c.")
    method = method_of(tension)
    without_guides(robot, "export_linuxcnc", "inverse")
    state = equilibrium_at(robot, single_pose(home_pose(robot) if home is None else home, "home"), method)
    words = {**origin(robot), "module": name, "unit": unit, "units": repr(PER_METER[unit])}
    source, header = source_of(robot, [method], True, np.float64, name)
    source = source.replace(f'#include "{name}.h"\n', header)
    texts = (
        filled("c/linuxcnc_head.c", words) + source + filled("c/linuxcnc.c", words),
        _settings(state, name, unit),
    )
    names = (f"{name}.c", f"{name}.ini")
    with atomic_files(create_folder(place), names) as partials:
        for partial, text in zip(partials, texts, strict=True):
            partial.write_text(text, encoding="utf-8", newline="\n")
    return place / names[0], place / names[1]


def _settings(state: Equilibrium, name: str, unit: Unit) -> str:
    """Settings for the INI file of a machine; the home positions are the lengths of `state`."""
    robot, position = state.one_robot, PER_METER[unit] * state.pose.position
    turns = bool(robot.freedom[:, 3:].any())
    lines = [
        f"# {origin(robot)['name']}: settings for the INI file of LinuxCNC, written by sagline",
        "[KINS]",
        f"KINEMATICS = {name}",
        f"JOINTS = {robot.cable_count}",
        "[TRAJ]",
        f"COORDINATES = {'X Y Z A B C' if turns else 'X Y Z'}",
        f"LINEAR_UNITS = {'0.001' if unit == 'm' else unit}",  # a number: units of the machine per millimeter
        "ANGULAR_UNITS = degree",
        f"# HOME: unstrained length at X Y Z = {' '.join(f'{each:.3f}' for each in position)}",
    ]
    for i, length in enumerate(PER_METER[unit] * state.unstrained_length):
        lines += [f"[JOINT_{i}]", "TYPE = LINEAR", f"HOME = {length:.6f}"]
    return "\n".join(lines) + "\n"

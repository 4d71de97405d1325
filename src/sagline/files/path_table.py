"""Paths sampled in CSV: one row for each time, with the position and, if it changes, the orientation."""

from __future__ import annotations

from pathlib import Path as FilePath

import numpy as np

from sagline.core.errors import FileError, InvalidValueError
from sagline.files.table import Table, line_error
from sagline.motion.path import Path
from sagline.motion.sampled import path_from_samples
from sagline.robot.pose import Pose

PLACE = ("time", "x", "y", "z")
EULER = ("alpha", "beta", "gamma")
QUATERNION = ("qx", "qy", "qz", "qw")
UNITS = dict(zip(PLACE + EULER + QUATERNION, ("s", "m", "m", "m", "rad", "rad", "rad", "", "", "", ""), strict=True))
FARTHEST = 1e6  # m; beyond all machines
_LEAST_STEP = 1e-12  # s; over less, differences of positions tell no velocity
QUATERNION_TOLERANCE = 1e-3  # of a length 1, printed with three decimals; more is a mistake


def path_from_table(path: FilePath, text: str) -> Path:
    """The path of a CSV text.

    Args:
        path: The file, for messages.
        text: What is in it.

    Returns:
        The path, its velocities and accelerations those of a spline.

    Raises:
        FileError: If a column, row or number is wrong; it names the line.
        InvalidValueError: If the samples are no path for a reason that is no single line's.
    """
    table = Table.read(path, text, UNITS)
    _check_columns(table)
    time, *place = (table.columns[name] for name in PLACE)
    late = np.diff(time, prepend=-np.inf) < _LEAST_STEP
    table.refuse(late, "time", time, "s", "a time after that of the row before")
    if time.size < 2:
        step = "Add the samples of the path."
        raise FileError.of(path, InvalidValueError("number of samples", time.size, "at least two", step))
    for name in PLACE[1:]:
        values = table.columns[name]
        table.refuse(np.abs(values) > FARTHEST, name, values, "m", f"up to {FARTHEST:g} m; millimeters are {name} [mm]")
    position = np.stack(place, axis=-1)
    if "alpha" in table.columns:
        return path_from_samples(time, Pose.from_euler(position, *(table.columns[name] for name in EULER)))
    if "qx" not in table.columns:
        return path_from_samples(time, Pose.from_euler(position, 0.0, 0.0, 0.0))
    quaternion = np.stack([table.columns[name] for name in QUATERNION], axis=-1)
    length = np.linalg.norm(quaternion, axis=1)
    wrong = np.abs(length - 1.0) > QUATERNION_TOLERANCE
    table.refuse(wrong, "the length of qx, qy, qz, qw", length, "", f"1 to {QUATERNION_TOLERANCE:g}")
    return path_from_samples(time, Pose.from_quaternion(position, quaternion / length[:, np.newaxis]))


def _check_columns(table: Table) -> None:
    """Refuse a table that gives no position, or an orientation in half or in two ways."""
    orientation = table.columns.keys() & set(EULER + QUATERNION)
    wanted = PLACE + next((way for way in (EULER, QUATERNION) if orientation & set(way)), ())
    if missing := [name for name in wanted if name not in table.columns]:
        raise line_error(
            table.path, table.header, f"missing column {', '.join(missing)}; found: {', '.join(table.columns)}"
        )
    if surplus := table.columns.keys() - set(wanted):
        raise line_error(
            table.path,
            table.header,
            f"columns {', '.join(sorted(surplus))} beside {', '.join(EULER)}; allowed: one way",
        )

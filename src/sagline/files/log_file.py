"""Logs of winches in CSV: one row a pose, with the deviations of the sensors in comments above."""

from __future__ import annotations

import os
from typing import Final

import numpy as np

from sagline.calibration.log import WinchLog
from sagline.calibration.sensors import Sensors
from sagline.core.arguments import file_path, instance, optional
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.log_sensors import comments_of_sensors, sensors_of_comments
from sagline.files.log_table import log_columns, log_fields
from sagline.files.table import TABLE_LIMIT
from sagline.files.text import read_text
from sagline.files.whole import write_text

USUAL: Final = {"tension": "5 N", "position": "1 mm", "rotation": "1 mrad"}  # what a sensor may be off


def load_log(file: os.PathLike[str] | str, sensors: Sensors | None = None) -> WinchLog:
    """Read what a robot's encoders, load cells and perhaps a measuring system read at poses where it stood.

    A CSV file with one row a pose, below the names of its columns, in any order:

        # length_deviation: 0.5 mm
        # tension_deviation: 5 N
        # position_deviation: [1 mm, 1 mm, 2 mm]
        time [s],count_0,count_1,count_2,load_cell_0 [kN],load_cell_1 [kN],load_cell_2 [kN],x [mm],y [mm],z [mm]
        0,320530,312004,299911,0.41,0.52,0.39,1012.5,998.1,2003.0
        30,318112,311870,301442,0.44,0.50,0.41,,,

    - `count_0`, `count_1`, ...: of the encoders; or `length_0`, ...: off the drums, as the machine believes them.
    - `load_cell_0`, ...: at the frame ends; cables without a cell have no column.
    - `x`, `y`, `z`: of the target in the measuring system's axes, or some of the three.
    - `qx`, `qy`, `qz`, `qw`, or `alpha`, `beta`, `gamma` (about z, then the new y, then the new x): of the platform in
      these axes.
    - `x_commanded`, `y_commanded`, `z_commanded`, and perhaps `qx_commanded`, ... or `alpha_commanded`, ...: the pose
      that was commanded, level where only its position is given.
    - `time`.

    Units stand in brackets; without, they are s, m, N and rad. Cells are blank where nothing was read, but for times
    and commanded poses. Comments above the names of the columns say how far sensors are to be trusted, one number or
    one for each cable or axis, and where the measuring system stands: `# frame: {position: [1, 0, 0.5], euler: {alpha:
    90 deg}}` and `# target: [0, 0, 0.1]`, as of `Sensors`. Quaternions have length 1 to the 1e-3 of few printed
    decimals, and are normalized.

    Args:
        file: The file.
        sensors: In place of what the file says of them.

    Returns:
        The log; its source is the name of the file.

    Raises:
        FileError: If it cannot be read, a column, comment or number is wrong, or nothing says how far a sensor is to be
            trusted; the message names the line or the key.
        InvalidValueError: If sensors are none, or of another number of cables.

    Examples:
        >>> import sagline as sl
        >>> log = sl.WinchLog(counts=[[320530, 312004], [318112, 311870]])
        >>> log.save("two.csv")
        >>> print(sl.load_log("two.csv"))
        2 rows of 2 cables: counts; two.csv
    """
    path = file_path(file)
    optional(sensors, Sensors, "sensors")
    text = read_text(path, TABLE_LIMIT)
    said, rows = sensors_of_comments(text, path)
    given = said if sensors is None else sensors
    fields = log_fields(path, rows)
    for name, key in (("load_cells", "tension"), ("position", "position"), ("rotation", "rotation")):
        if fields[name] is not None and getattr(given, f"{key}_deviation") is None:
            wish = f"# {key}_deviation: {USUAL[key]}"
            step = f"Write a comment above the columns, for instance '{wish}', or give sensors (--{key}-deviation)."
            reason = f"does not say the {key}_deviation of what it holds"
            raise FileError(path, reason, step, item=f"{key}_deviation")
    try:
        return WinchLog(**fields, sensors=given, source=str(path))
    except InvalidValueError as error:
        if sensors is not None:
            raise
        raise FileError.of(path, error) from None


def save(log: WinchLog, file: os.PathLike[str] | str) -> None:
    """Write a log to a CSV file, whole or not at all; `load_log` reads the same numbers, to the last bit.

    Args:
        log: The log.
        file: The file, "winches.csv" for instance; a regular file that exists is replaced, anything else is refused.

    Raises:
        InvalidValueError: If it is no log.
        FileError: If the file cannot be written; what was there before is untouched.
    """
    write_text(file_path(file), dump_log(log))


def dump_log(log: WinchLog) -> str:
    """A log as CSV text, in SI units, with the sensors in comments.

    Args:
        log: The log.

    Raises:
        InvalidValueError: If it is no log.
    """
    columns = dict(log_columns(instance(log, WinchLog, "log")))
    lines = [*comments_of_sensors(log.sensors), ",".join(columns)]
    rows = np.column_stack(list(columns.values())).tolist()
    lines += [",".join("" if v != v else repr(v).removesuffix(".0") for v in row) for row in rows]
    return "\n".join(lines) + "\n"

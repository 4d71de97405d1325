"""Logs of winches in CSV: one row per pose. Comments above the header give the standard deviations of the sensors."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import nullcontext
from difflib import get_close_matches
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np

from sagline.calibration.log import Sensors, WinchLog
from sagline.core.arguments import file_path, instance, optional
from sagline.core.arrays import Array, locked
from sagline.core.errors import FileError, did_you_mean
from sagline.core.fields import units
from sagline.files import table as tables
from sagline.files.log_columns import ARRAYS, ColumnEntry, log_rows
from sagline.files.path_file import EULER, QUATERNION
from sagline.files.reading import read_text, value_errors
from sagline.files.table import CsvRow, CsvTable, line_error
from sagline.files.writing import write_text
from sagline.files.yaml_text import YAML_LIMIT, PoseEntry, parse_mapping, schema_of, validate
from sagline.robot.pose import Pose

DEVIATIONS: Final = units(Sensors)
_KEYS: Final = (*DEVIATIONS, "frame", "target")
_COMMENT = re.compile(r"\s*#\s*([A-Za-z_ ]+?)\s*:(.*)")
_NEAR: Final = 0.7  # a word that is this similar to a key is a misspelt key; "name" and "frame" are less similar
XYZ: Final = ("x", "y", "z")
COMMANDED: Final = "_commanded"
_MOST: Final = 1000  # largest number of cables
_OF_CABLE: Final = {
    "count": "",
    "length": "m",
    "load_cell": "N",
    "swivel": "rad",
}  # columns that exist once per cable, and their units
MODES: Final = 6  # largest number of columns of natural frequencies
_BESIDE: Final = ("load_cell", "swivel")  # columns of cables beside counts or lengths
_NUMBERED = re.compile(rf"(count|length|load_cell|swivel)_([0-9]{{1,{len(str(_MOST))}}})")
_POSE_COLUMNS: Final = (*XYZ, *EULER, *QUATERNION)
_MODES: Final = tuple(f"frequency_{k}" for k in range(MODES))
_MAPPED: Final = ("time", *_OF_CABLE, "position", "quaternion", "cable", "pose")  # other keys of a map of columns
USUAL: Final = {
    "tension": "5 N",
    "position": "1 mm",
    "rotation": "1 mrad",
    "swivel": "5 mrad",
    "frequency": "0.02 Hz",
}  # standard deviations of sensors


class _Sensors(schema_of(DEVIATIONS)):  # type: ignore[misc]
    """Keys of the comments above the columns."""

    frame: PoseEntry | None = None
    target: Annotated[Any, "m"] = None

    def sensors(self, path: Path) -> Sensors:
        """Sensors that the keys describe; the path of the file is used in messages."""
        with value_errors(path):
            values: dict[str, Any] = {key: self.si(key) for key in self.units() if getattr(self, key) is not None}
            if self.frame is not None:
                values["frame"] = self.frame.pose("frame")
            return Sensors(**values)


class _LogMap(_Sensors):
    """Keys of a map of columns."""

    columns: dict[str, ColumnEntry]


def _sensors_of_comments(comments: Iterable[str], path: Path) -> Sensors:
    """Sensors from the comments above the header."""
    said = [_key_line(line.rstrip("\r")) for line in comments]
    return validate(parse_mapping("\n".join(said), path), _Sensors, path).sensors(path) if any(said) else Sensors()


def _key_line(line: str) -> str:
    """YAML line of a comment if its first word is or resembles a sensor key; otherwise an empty line."""
    found = _COMMENT.fullmatch(line)
    if found is None:
        return ""
    key = found[1]
    meant = "deviation" in key or bool(get_close_matches(key.lower(), _KEYS, n=1, cutoff=_NEAR))
    return f"{key}:{found[2]}" if meant else ""


def _comments_of_sensors(sensors: Sensors) -> Iterator[str]:
    """Comments that describe sensors; `_sensors_of_comments` restores the same sensors."""
    for name, unit in DEVIATIONS.items():
        value: Array | None = getattr(sensors, name)
        if value is not None:
            numbers = [f"{x!r} {unit}" if np.isfinite(x) else "inf" for x in np.atleast_1d(value).tolist()]
            listed = f"[{', '.join(numbers)}]" if value.ndim else numbers[0]
            yield f"# {name}: {listed}"
    position, quaternion = sensors.frame.position.tolist(), sensors.frame.quaternion.tolist()
    if position != [0.0, 0.0, 0.0] or quaternion != [0.0, 0.0, 0.0, 1.0]:
        yield f"# frame: {{position: {position}, quaternion: {quaternion}}}"
    if sensors.target.any():
        yield f"# target: {sensors.target.tolist()}"


def _read(path: Path, rows: Iterator[CsvRow]) -> tuple[CsvTable, int]:
    """Read the table and the number of its cables."""
    header = next(rows, (0, []))
    names = [tables.column_of_cable(cell.partition("[")[0].strip()) for cell in header[1]]
    found = [_NUMBERED.fullmatch(name) for name in names]
    lengths = [match for match in found if match and match[1] in ("count", "length")]
    cables = max((min(int(match[2]), _MOST - 1) + 1 for match in lengths), default=1)
    optional_units = {f"{kind}_{k}": _OF_CABLE[kind] for k in range(cables) for kind in _BESIDE}
    optional_units |= {f"frequency_{k}": "Hz" for k in range(MODES)}
    optional_units |= dict.fromkeys(XYZ, "m") | dict.fromkeys(EULER, "rad") | dict.fromkeys(QUATERNION, "")
    readings = {f"{kind}_{k}": _OF_CABLE[kind] for kind in ("count", "length") for k in range(cables)}
    commanded = {f"{name}{COMMANDED}": optional_units[name] for name in _POSE_COLUMNS}
    units = {"time": "s", **readings, **optional_units, **commanded}
    whole = chain((header,), rows) if names else rows
    table = CsvTable(path, whole, units, gaps=frozenset((*readings, *optional_units)))
    kinds = [kind for kind in ("count", "length") if table.columns.keys() & set(tables.names_of_cables(kind, cables))]
    if len(kinds) != 1:
        what = "columns of counts and of lengths" if kinds else "neither columns count_0, ... nor length_0, ..."
        raise line_error(path, table.header, f"{what}; allowed: one of the two")
    if missing := [name for name in tables.names_of_cables(kinds[0], cables) if name not in table.columns]:
        shown = ", ".join(missing[:3]) + (", ..." if len(missing) > 3 else "")
        raise line_error(path, table.header, f"missing column {shown}; the last is {kinds[0]}_{cables - 1}")
    table.check_rows()
    return table, cables


def _fields(table: CsvTable, cables: int) -> dict[str, Any]:
    return {
        "counts": _stack_columns(table, tables.names_of_cables("count", cables)),
        "unstrained_length": _stack_columns(table, tables.names_of_cables("length", cables)),
        "load_cells": _stack_columns(table, tables.names_of_cables("load_cell", cables), all_of_them=False),
        "swivel": _stack_columns(table, tables.names_of_cables("swivel", cables), all_of_them=False),
        "frequency": _frequencies(table),
        "position": _stack_columns(table, XYZ, all_of_them=False),
        "rotation": _rotation(table, ""),
        "time": table.columns.get("time"),
        "commanded": _commanded(table),
    }


def _stack_columns(table: CsvTable, names: Iterable[str], *, all_of_them: bool = True) -> Array | None:
    """Matrix of the columns `names`, with NaN for a missing column. None if all columns are missing."""
    names = list(names)
    found = [name for name in names if name in table.columns]
    if not found:
        return None
    if all_of_them:
        table.check_columns(names, f" beside {', '.join(found)}")
    none = np.full(len(table.lines), np.nan)
    return locked(np.stack([table.columns.get(name, none) for name in names], axis=-1))


def _frequencies(table: CsvTable) -> Array | None:
    """Columns of natural frequencies, from the first to the last one of the table."""
    given = [k for k in range(MODES) if f"frequency_{k}" in table.columns]
    return _stack_columns(table, [f"frequency_{k}" for k in range(max(given, default=-1) + 1)], all_of_them=False)


def _is_without_yaw(table: CsvTable) -> bool:
    """True if the measured rotations are roll and pitch only, as those of an inclinometer."""
    return EULER[0] not in table.columns and all(name in table.columns for name in EULER[1:])


def _rotation(table: CsvTable, suffix: str) -> Array | None:
    """Rotations as unit quaternions; a row of NaN where the rotation is not measured."""
    euler = EULER[1:] if not suffix and _is_without_yaw(table) else EULER
    angles = _stack_columns(table, [name + suffix for name in euler])
    quaternion = _stack_columns(table, [name + suffix for name in QUATERNION])
    if angles is not None and quaternion is not None:
        way = f"columns alpha{suffix} beside qx{suffix}; allowed: one way"
        raise line_error(table.path, table.header, way)
    given = angles if angles is not None else quaternion
    if given is None:
        return None
    missing = np.isnan(given)
    known = ~missing.all(axis=1)
    names = ", ".join(name + suffix for name in (euler if quaternion is None else QUATERNION))
    part = np.asarray(known & missing.any(axis=1))
    table.refuse(part, f"one of {names}", np.full(len(given), np.nan), "", "all of them, or blanks in all")
    if quaternion is not None:
        return table.normalized(quaternion, names)
    found = np.full((len(given), 4), np.nan)
    yaw = [0.0] * (len(EULER) - len(euler))
    found[known] = Pose.from_euler(np.zeros(3), *yaw, *given[known].T).quaternion
    return found


def _commanded(table: CsvTable) -> Pose | None:
    position = _stack_columns(table, [name + COMMANDED for name in XYZ])
    rotation = _rotation(table, COMMANDED)
    if position is None:
        if rotation is not None:
            raise line_error(table.path, table.header, f"missing column x{COMMANDED} beside commanded rotations")
        return None
    if rotation is None:
        return Pose(position)
    return Pose.from_quaternion(position, rotation)


def load_log(
    file: os.PathLike[str] | str, sensors: Sensors | None = None, columns: os.PathLike[str] | str | None = None
) -> WinchLog:
    """Read a log: readings of encoders, load cells and, optionally, a measuring system, with the robot at rest.

    The CSV file has a header with the names of the columns, in any order, and one row per pose:

        # length_deviation: 0.5 mm
        # tension_deviation: 5 N
        # position_deviation: [1 mm, 1 mm, 2 mm]
        time [s],count_0,count_1,count_2,load_cell_0 [kN],load_cell_1 [kN],load_cell_2 [kN],x [mm],y [mm],z [mm]
        0,320530,312004,299911,0.41,0.52,0.39,1012.5,998.1,2003.0
        30,318112,311870,301442,0.44,0.50,0.41,,,

    - `count_0`, `count_1`, ...: encoder counts; or `length_0`, ...: lengths off the drums, in the controller's own
    values. `C0` and `L0` are other names of `count_0` and `length_0`.
    - `load_cell_0`, ...: tensions at the frame ends; cables without a load cell have no column.
    - `swivel_0`, ...: swivel angles of the pulleys; their zeros are unknown.
    - `frequency_0`, ...: lowest natural frequencies of the platform at this pose, ascending.
    - `x`, `y`, `z` (or some of them): position of the target in the axes of the measuring system.
    - `qx`, `qy`, `qz`, `qw`, or `alpha`, `beta`, `gamma` (about z, then the new y, then the new x): rotation of the
      platform in these axes. `beta` and `gamma` without `alpha` are pitch and roll, as an inclinometer measures them;
      they refer to the vertical, and the standard deviation of the yaw is then infinite.
    - `x_commanded`, `y_commanded`, `z_commanded`, and optionally `qx_commanded`, ... or `alpha_commanded`, ...: the
      commanded pose; without a rotation the platform is level.
    - `time`: time of the row.

    Columns are separated by commas, semicolons or tabs. With semicolons or tabs, numbers may have a decimal comma.
    Units are in brackets; the defaults are s, m, N and rad. A cell is blank if the value was not measured. Times and
    commanded poses must not be blank. Comments above the header give the standard deviations of the sensors (one
    number, or one per cable or axis), the pose of the measuring system, `# frame: {position: [1, 0, 0.5], euler:
    {alpha: 90 deg}}`, and the target, `# target: [0, 0, 0.1]`. The keys are fields of `Sensors`.
    The length of a quaternion may differ from 1 by 1e-3, because decimals are rounded; quaternions are normalized.

    The arrays of an `.npz` or `.mat` file have the same names; `length`, `count`, `load_cell`, `position` and
    `quaternion` are matrices with one row per pose. A map of columns, a YAML file, reads files with other names:

        columns:
          time: {name: t, unit: ms}
          length: {name: "enc{}", unit: mm, scale: -1, cables: [3, 1, 2]}  # columns enc3, enc1 and enc2
          load_cell_0: force
          position: {name: mocap, unit: mm}  # matrix with the columns x, y, z
        tension_deviation: 5 N

    `scale` is the factor of the values in the file, and `cables` are the numbers of the robot's cables in the file. In
    a table with one row per cable, the keys `cable` and `pose` (or `time`) are the columns with these numbers. The map
    can contain the keys of the comments. Other columns are not read.

    Args:
        file: The file.
        sensors: Sensors that replace the sensors in the file.
        columns: YAML file with a map of columns; None for a file with the names above.

    Returns:
        The log; its source is the name of the file.

    Raises:
        FileError: If the file cannot be read. If a column, comment or number is wrong, or the deviation of a sensor is
            missing; the message names the line or the key.
        InvalidValueError: If `sensors` is not a `Sensors` object, or has another number of cables.

    Examples:
        >>> import sagline as sl
        >>> log = sl.WinchLog(counts=[[320530, 312004], [318112, 311870]])
        >>> log.save("two.csv")
        >>> print(sl.load_log("two.csv"))
        2 rows of 2 cables: counts; two.csv
    """
    optional(sensors, Sensors, "sensors")
    return read_log(file, sensors, columns, {})


def read_log(
    file: os.PathLike[str] | str,
    sensors: Sensors | None,
    columns: os.PathLike[str] | str | None,
    deviations: Mapping[str, float],
) -> WinchLog:
    """Read a log; `deviations` replace standard deviations of `sensors` or of the sensors in the file."""
    path = file_path(file)
    chosen, said = None, None
    if columns is not None:
        chosen, said = _map_of_columns(file_path(columns, "columns"))
    converted = chosen is not None or path.suffix.lower() in ARRAYS
    comments, rows = log_rows(path, chosen) if converted else tables.commented_rows(path)
    commented = _sensors_of_comments(comments, path)
    given = sensors or said or commented
    given = given.replace(**deviations) if deviations else given
    table, cables = _read(path, rows)
    fields = _fields(table, cables)
    for key in USUAL:
        name = "load_cells" if key == "tension" else key
        if fields[name] is not None and getattr(given, f"{key}_deviation") is None:
            wish = f"# {key}_deviation: {USUAL[key]}"
            step = f"Write a comment above the columns, for instance '{wish}', or give sensors (--{key}-deviation)."
            reason = f"does not give the {key}_deviation of a sensor with readings"
            raise FileError(path, reason, step, item=f"{key}_deviation")
    if _is_without_yaw(table):
        given = given.replace(rotation_deviation=given.rotation_deviation * np.array([1.0, 1.0, np.inf]))
    with value_errors(path) if sensors is None else nullcontext():  # `sensors` may also cause an error
        return WinchLog(**fields, sensors=given, source=str(path))


def _map_of_columns(path: Path) -> tuple[dict[str, ColumnEntry], Sensors | None]:
    """Map of columns in a YAML file, and the sensors; None without a key of the sensors."""
    entry = validate(parse_mapping(read_text(path, YAML_LIMIT), path), _LogMap, path)
    for key in entry.columns:
        known = key in (*_MAPPED, *_MODES) or key.removesuffix(COMMANDED) in _POSE_COLUMNS
        if not (known or _NUMBERED.fullmatch(key)):
            allowed = (*_MAPPED, *_POSE_COLUMNS)
            step = did_you_mean(key, allowed, "Remove it.")
            reason = f"columns.{key} is an unknown key; allowed: {', '.join(allowed)}"
            raise FileError(path, reason, step, item=f"columns.{key}")
    return entry.columns, entry.sensors(path) if entry.model_fields_set - {"columns"} else None


def save(log: WinchLog, file: os.PathLike[str] | str) -> None:
    """Write a log to a CSV file atomically; `load_log` restores all numbers exactly."""
    write_text(file_path(file), _dump_log(log))


def _dump_log(log: WinchLog) -> str:
    """CSV text of a log, in SI units, with the sensors in comments."""
    table = instance(log, WinchLog, "log").table()
    lines = [*_comments_of_sensors(log.sensors), ",".join(table.head)]
    rows = np.column_stack(list(table.columns.values())).tolist()
    lines += [",".join("" if v != v else repr(v).removesuffix(".0") for v in row) for row in rows]
    return "\n".join(lines) + "\n"

"""Path files: waypoints or calibration poses in YAML, samples of time and pose in CSV, or programs in G-code."""

from __future__ import annotations

import os
from importlib.metadata import version
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np

from sagline.calibration.observations import counts_at
from sagline.core.arguments import file_path
from sagline.core.arrays import FARTHEST, Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.fields import units
from sagline.files.gcode_file import SUFFIXES, load_gcode
from sagline.files.reading import read_text, value_errors
from sagline.files.table import TABLE_LIMIT, CsvTable, csv_rows, line_error
from sagline.files.writing import write_text
from sagline.files.yaml_text import YAML_LIMIT, PoseEntry, YamlEntry, dump_mapping, parse_mapping, validate
from sagline.motion.path import Path, path_from_samples
from sagline.motion.rest_to_rest import quintic_path, septic_path
from sagline.robot.drum import Drums, has_drum_data
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from sagline.calibration.planning import CalibrationPoses
    from sagline.robot.pose import Pose

PLACE = ("time", "x", "y", "z")
EULER = ("alpha", "beta", "gamma")
QUATERNION = ("qx", "qy", "qz", "qw")
UNITS = dict(zip(PLACE + EULER + QUATERNION, ("s", "m", "m", "m", "rad", "rad", "rad", "", "", "", ""), strict=True))
_LEAST_STEP = 1e-12  # shortest time step [s]; over a shorter step, the velocity from a difference would be too inexact

PROFILES = {"quintic": quintic_path, "septic": septic_path}


def _path_from_table(path: FilePath, text: str) -> Path:
    table = CsvTable(path, csv_rows(path, text), UNITS)
    _check_columns(table)
    time, *place = (table.columns[name] for name in PLACE)
    late = np.diff(time, prepend=-np.inf) < _LEAST_STEP
    table.refuse(late, "time", time, "s", "a time after the time of the previous row")
    if time.size < 2:
        step = "Add the samples of the path."
        raise FileError.of(path, InvalidValueError("number of samples", time.size, "at least two", step))
    for name in PLACE[1:]:
        values = table.columns[name]
        allowed = f"up to {FARTHEST:g} m; if it is in mm, name the column {name} [mm]"
        table.refuse(np.abs(values) > FARTHEST, name, values, "m", allowed)
    position = np.stack(place, axis=-1)
    if "alpha" in table.columns:
        return path_from_samples(time, Pose.from_euler(position, *(table.columns[name] for name in EULER)))
    if "qx" not in table.columns:
        return path_from_samples(time, Pose(position))
    quaternion = np.stack([table.columns[name] for name in QUATERNION], axis=-1)
    return path_from_samples(time, Pose.from_quaternion(position, table.normalized(quaternion, "qx, qy, qz, qw")))


def _check_columns(table: CsvTable) -> None:
    """Refuse a table if position columns are missing, or if its orientation is incomplete or given in two forms."""
    orientation = table.columns.keys() & set(EULER + QUATERNION)
    wanted = PLACE + next((way for way in (EULER, QUATERNION) if orientation & set(way)), ())
    table.check_columns(wanted, f"; found: {', '.join(table.columns)}")
    if surplus := table.columns.keys() - set(wanted):
        reason = f"columns {', '.join(sorted(surplus))} beside {', '.join(EULER)}; allowed: one way"
        raise line_error(table.path, table.header, reason)


def load_path(file: str | os.PathLike[str]) -> Path:
    """Read a path from a file of waypoints (.yaml, .yml) or of sampled poses (.csv), or from a program in G-code.

    A YAML file contains waypoints. Between two waypoints, the platform moves from rest to rest (see `quintic_path`). A
    quantity is a number in SI (lengths in m, angles in rad) or a text with its unit:

        rate: 100                             # samples per second, 100 if left out
        profile: septic                       # continuous jerk (see `septic_path`); quintic if left out
        durations: [5 s, 8 s]                 # or one for all; or limits instead:
        # speed: 1.5 m/s                      # and acceleration, angular_speed, angular_acceleration
        waypoints:
          - {position: [0, 0, 1.5]}
          - {position: [2 m, 1500 mm, 1.5], euler: {alpha: 20 deg}}        # alpha about z, beta about y, gamma about x
          - {position: [2, 1, 1.5], quaternion: [0, 0, 0.6, 0.8]}          # x, y, z, w

    Files of `CalibrationPoses.save` have this format; each waypoint also has tensions and lengths.

    A CSV file has a header and one row for each sample. The header is `time,x,y,z`, then `alpha,beta,gamma` or
    `qx,qy,qz,qw`, or nothing for a constant orientation. Units are in brackets, `time [s],x [mm],...,alpha [deg]`; the
    defaults are s, m and rad. A spline through the samples gives velocity and acceleration (see `path_from_samples`).

    The length of a quaternion may differ from 1 by 1e-3, because decimals are rounded; quaternions are normalized.

    A program in G-code (.ngc, .nc, .tap, .gcode, .gco) is read with the default settings of `load_gcode`.

    Args:
        file: The file; its suffix selects the format.

    Returns:
        The path.

    Raises:
        FileError: If the file cannot be read, or is not a path; the message names the line or the key.

    Examples:
        >>> import sagline as sl
        >>> path = sl.load_path("own_path.yaml")  # doctest: +SKIP
    """
    path = file_path(file)
    yaml, table = (_path_from_yaml, YAML_LIMIT), (_path_from_table, TABLE_LIMIT)
    readers = {".yaml": yaml, ".yml": yaml, ".csv": table}
    if path.suffix.lower() in SUFFIXES:
        return load_gcode(path)
    if path.suffix.lower() not in readers:
        step = "Give waypoints as .yaml, time and pose as .csv, or G-code as .ngc."
        allowed = ", ".join((*readers, *SUFFIXES))
        raise FileError.of(path, InvalidValueError("the suffix", path.suffix or "missing", allowed, step))
    reader, limit = readers[path.suffix.lower()]
    text = read_text(path, limit)
    with value_errors(path):
        return reader(path, text)


class _Waypoint(PoseEntry):
    """Waypoint: a pose. Tensions and lengths from `CalibrationPoses.save` are allowed, but a path does not use them."""

    frame_end_tension: Any = None
    unstrained_length: Any = None
    counts: Any = None


class _Waypoints(YamlEntry):
    rate: Annotated[Any, "1/s"] = 100.0
    durations: Annotated[Any, "s"] = None
    speed: Annotated[Any, "m/s"] = None
    acceleration: Annotated[Any, "m/s^2"] = None
    angular_speed: Annotated[Any, "rad/s"] = None
    angular_acceleration: Annotated[Any, "rad/s^2"] = None
    profile: Literal["quintic", "septic"] = "quintic"
    waypoints: list[_Waypoint]
    calibration: dict[str, Any] | None = None  # data of a file of calibration poses


def _path_from_yaml(path: FilePath, text: str) -> Path:
    entry = validate(parse_mapping(text, path), _Waypoints, path)
    timing = entry.given()
    return PROFILES[entry.profile]([w.pose(f"waypoints[{k}]") for k, w in enumerate(entry.waypoints)], **timing)


HEAD: Final = """\
# Poses to calibrate {robot} by, in an order that is short to drive. It is a path from rest to rest as well: load_path
# reads it, and `sagline track` plans it. Each pose contains the tensions to read there: frame_end_tension [N],
# reached by unstrained_length [m], all cable off the drums{counts}.
"""
SPEED: Final = 0.2  # largest speed between two poses [m/s]
ANGULAR_SPEED: Final = 0.1  # largest angular speed between two poses [rad/s]
DWELL: Final = 2.0  # shortest time from one pose, or one set of tensions at a pose, to the next [s]
RATE: Final = 10.0  # sample rate of the path [1/s]
_PEAK: Final = 15.0 / 8.0  # peak speed of a quintic segment divided by its mean speed
_DECIMALS: Final = {"position": 4, "quaternion": 6, "frame_end_tension": 1, "unstrained_length": 5, "counts": 0}
_DIGITS: Final = 4  # significant digits of an expected error


def save(plan: CalibrationPoses, file: os.PathLike[str] | str) -> None:
    """Write the poses of `plan`, their tensions and lengths, and the expected errors to a YAML file atomically."""
    rows = {
        "position": plan.poses.position,
        "quaternion": plan.poses.quaternion,
        "frame_end_tension": plan.frame_end_tension,
        "unstrained_length": plan.unstrained_length,
    }
    if has_drum_data(plan.robot):
        rows["counts"] = counts_at(Drums(plan.robot), plan.unstrained_length)
    poses = [
        {name: _round(row, _DECIMALS[name]) for name, row in zip(rows, each, strict=True)}
        for each in zip(*rows.values(), strict=True)
    ]
    data: dict[str, Any] = {"rate": RATE}
    if len(plan.poses) > 1:
        data["durations"] = _durations(plan.poses)
    data |= {"calibration": _about(plan), "waypoints": poses}
    head = HEAD.format(robot=plan.robot.name, counts=", at these counts" if "counts" in rows else "")
    write_text(file_path(file), head + dump_mapping(data))


def _durations(poses: Pose) -> list[float]:
    """Duration of each motion [s]: at least DWELL, and long enough for the allowed speeds."""
    way = np.linalg.norm(np.diff(poses.position, axis=0), axis=1)
    turn = (poses.rotation[1:] * poses.rotation[:-1].inv()).magnitude()
    times = np.maximum(_PEAK * np.maximum(way / SPEED, turn / ANGULAR_SPEED), DWELL)
    return _round(np.ceil(10.0 * times) / 10.0, 1)


def _about(plan: CalibrationPoses) -> dict[str, Any]:
    numbers = plan.parameters
    given = {name: getattr(plan.sensors, name) for name in units(type(plan.sensors))}
    errors = {
        f"{label} [{unit}]" if unit else label: float(f"{error:.{_DIGITS}g}") if np.isfinite(error) else None
        for label, unit, error in zip(numbers.labels, numbers.units, plan.expected_error, strict=True)
    }
    return {
        "robot": plan.robot.name,
        "source": f"sagline {version('sagline')}",
        "sensors": {name: value.tolist() for name, value in given.items() if value is not None},
        "most_helpful": plan.most_helpful,
        "expected_error": errors,
    }


def _round(row: Array, decimals: int) -> list[Any]:
    rounded: list[float] = (np.round(row, decimals) + 0.0).tolist()
    return rounded if decimals else [int(number) for number in rounded]

"""Path files: waypoints in YAML, or samples of time and pose in CSV."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import Any, Literal

import numpy as np

from sagline.core.arguments import file_path
from sagline.core.arrays import FARTHEST
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.pose_text import QUATERNION_TOLERANCE, PoseEntry, pose_of_entry
from sagline.files.quantity import in_si
from sagline.files.reading import read_text
from sagline.files.table import TABLE_LIMIT, CsvTable, line_error
from sagline.files.yaml_text import YAML_LIMIT, YamlEntry, parse_mapping, validate
from sagline.motion.path import Path
from sagline.motion.rest_to_rest import quintic_path, septic_path
from sagline.motion.sampled import path_from_samples
from sagline.robot.pose import Pose

PLACE = ("time", "x", "y", "z")
EULER = ("alpha", "beta", "gamma")
QUATERNION = ("qx", "qy", "qz", "qw")
UNITS = dict(zip(PLACE + EULER + QUATERNION, ("s", "m", "m", "m", "rad", "rad", "rad", "", "", "", ""), strict=True))
_LEAST_STEP = 1e-12  # shortest time step [s]; differences over shorter steps are too inexact for a velocity
TIMING_UNITS = {
    "rate": "1/s",
    "durations": "s",
    "speed": "m/s",
    "acceleration": "m/s^2",
    "angular_speed": "rad/s",
    "angular_acceleration": "rad/s^2",
}
PROFILES = {"quintic": quintic_path, "septic": septic_path}


def _path_from_table(path: FilePath, text: str) -> Path:
    """Read the path of a CSV text."""
    table = CsvTable.read(path, text, UNITS)
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
        return path_from_samples(time, Pose.from_euler(position, 0.0, 0.0, 0.0))
    quaternion = np.stack([table.columns[name] for name in QUATERNION], axis=-1)
    length = np.linalg.norm(quaternion, axis=1)
    wrong = np.abs(length - 1.0) > QUATERNION_TOLERANCE
    table.refuse(wrong, "the length of qx, qy, qz, qw", length, "", f"1 to {QUATERNION_TOLERANCE:g}")
    return path_from_samples(time, Pose.from_quaternion(position, quaternion / length[:, np.newaxis]))


def _check_columns(table: CsvTable) -> None:
    """Refuse a table without position columns, with an incomplete orientation, or with two forms of orientation."""
    orientation = table.columns.keys() & set(EULER + QUATERNION)
    wanted = PLACE + next((way for way in (EULER, QUATERNION) if orientation & set(way)), ())
    table.check_columns(wanted, f"; found: {', '.join(table.columns)}")
    if surplus := table.columns.keys() - set(wanted):
        raise line_error(
            table.path,
            table.header,
            f"columns {', '.join(sorted(surplus))} beside {', '.join(EULER)}; allowed: one way",
        )


def load_path(file: str | os.PathLike[str]) -> Path:
    """Read a path from a file of waypoints (.yaml, .yml) or of sampled poses (.csv).

    A YAML file contains waypoints. The platform moves from rest to rest between them (see `quintic_path`). A quantity
    is a number in SI (lengths in m, angles in rad) or a text with its unit:

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

    Quaternions in both kinds of files have length 1 within 1e-3 (rounding of printed decimals), and are normalized.

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
    if path.suffix.lower() not in readers:
        step = "Give waypoints as .yaml, or time and pose as .csv."
        raise FileError.of(path, InvalidValueError("the suffix", path.suffix or "missing", ", ".join(readers), step))
    reader, limit = readers[path.suffix.lower()]
    text = read_text(path, limit)
    try:
        return reader(path, text)
    except InvalidValueError as error:
        raise FileError.of(path, error) from None


class _Waypoint(PoseEntry):
    """Waypoint: a pose, and the tensions and lengths of `CalibrationPoses.save`, which a path does not use."""

    frame_end_tension: Any = None
    unstrained_length: Any = None
    counts: Any = None


class _Waypoints(YamlEntry):
    rate: Any = 100.0
    durations: Any = None
    speed: Any = None
    acceleration: Any = None
    angular_speed: Any = None
    angular_acceleration: Any = None
    profile: Literal["quintic", "septic"] = "quintic"
    waypoints: list[_Waypoint]
    calibration: dict[str, Any] | None = None  # content of a file of calibration poses


def _path_from_yaml(path: FilePath, text: str) -> Path:
    entry = validate(parse_mapping(text, path), _Waypoints, path)
    timing: dict[str, Any] = {
        name: in_si(getattr(entry, name), unit, name)
        for name, unit in TIMING_UNITS.items()
        if name in entry.model_fields_set
    }
    return PROFILES[entry.profile](
        [pose_of_entry(w, f"waypoints[{k}]") for k, w in enumerate(entry.waypoints)], **timing
    )

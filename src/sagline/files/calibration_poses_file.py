"""Files of calibration poses: a path with a stop at each pose, and tensions and lengths for each stop."""

from __future__ import annotations

import os
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.calibration.observations import counts_at, has_drum_data
from sagline.core.arguments import file_path
from sagline.core.arrays import Array
from sagline.files.writing import write_text
from sagline.files.yaml_text import dump_mapping
from sagline.robot.drum import drums_of

if TYPE_CHECKING:
    from sagline.calibration.planning import CalibrationPoses
    from sagline.robot.pose import Pose

HEAD: Final = """\
# Poses to calibrate {robot} by, in an order that is short to drive. It is a path from rest to rest as well: load_path
# reads it, and `sagline track` plans it. Each pose contains the tensions to read there: frame_end_tension [N],
# reached by unstrained_length [m], all cable off the drums{counts}.
"""
SPEED: Final = 0.2  # largest speed between two poses [m/s]
ANGULAR_SPEED: Final = 0.1  # largest angular speed between two poses [rad/s]
DWELL: Final = 2.0  # shortest time from one pose, or one set of tensions at a pose, to the next [s]
RATE: Final = 10.0  # sample rate of the path [1/s]
_PEAK: Final = 15.0 / 8.0  # ratio of peak speed to mean speed of a quintic segment
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
        rows["counts"] = counts_at(drums_of(plan.robot), plan.unstrained_length)
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
    """Duration of each motion [s]: at least DWELL, and sufficient for any machine."""
    way = np.linalg.norm(np.diff(poses.position, axis=0), axis=1)
    turn = (poses.rotation[1:] * poses.rotation[:-1].inv()).magnitude()
    times = np.maximum(_PEAK * np.maximum(way / SPEED, turn / ANGULAR_SPEED), DWELL)
    return _round(np.ceil(10.0 * times) / 10.0, 1)


def _about(plan: CalibrationPoses) -> dict[str, Any]:
    """Header entry of the file: robot, version of sagline, and purpose of the poses."""
    numbers = plan.parameters
    names = ("length_deviation", "tension_deviation", "position_deviation", "rotation_deviation")
    given = {name: getattr(plan.sensors, name) for name in names}
    errors = {
        f"{label} [{unit}]" if unit else label: _plain(error)
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


def _plain(error: float) -> float | None:
    """Expected error, rounded to few digits; None if it is unknown."""
    return float(f"{error:.{_DIGITS}g}") if np.isfinite(error) else None

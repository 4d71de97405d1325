"""The sensors of a calibration: how far each is to be trusted, and where a measuring system stands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, checked, exactly
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

LENGTH_DEVIATION = 5e-4  # m, of a length off a drum that nobody measured: rope on a grooved drum


@dataclass(frozen=True, slots=True, eq=False)
class Sensors(Result):
    """What measures a robot: standard deviations, and where its measuring system stands.

    Attributes:
        length_deviation: Standard deviation of a length off a drum, by counts or given [m], > 0, shape () or (m,).
        tension_deviation: Of a load cell's reading [N], > 0, shape () or (m,); None where there are no load cells.
        position_deviation: Of a coordinate of a measured position [m], > 0, shape () or (3,), along the measuring
            system's axes; None where positions are not measured.
        rotation_deviation: Of a measured rotation about each axis [rad], > 0, shape () or (3,); None where rotations
            are not measured.
        frame: Pose of the measuring system in the world: a point that it reads as p is at frame.position +
            frame.matrix p.
        target: The point of the platform whose position is measured, platform frame [m], shape (3,).
    """

    length_deviation: Array
    tension_deviation: Array | None
    position_deviation: Array | None
    rotation_deviation: Array | None
    frame: Pose
    target: Array

    def __init__(
        self,
        length_deviation: ArrayLike = LENGTH_DEVIATION,
        tension_deviation: ArrayLike | None = None,
        position_deviation: ArrayLike | None = None,
        rotation_deviation: ArrayLike | None = None,
        *,
        frame: Pose | None = None,
        target: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Check every field once.

        Args:
            length_deviation: As the attributes.
            tension_deviation: See the attributes.
            position_deviation: See the attributes.
            rotation_deviation: See the attributes.
            frame: See the attributes; None for the world's own axes.
            target: See the attributes.

        Raises:
            InvalidValueError: If a deviation is not positive, or something is of the wrong kind or shape.

        Examples:
            >>> import sagline as sl
            >>> sensors = sl.Sensors(length_deviation=5e-4, tension_deviation=5.0)
            >>> print(sensors.tension_deviation, sensors.position_deviation)
            5.0 None
        """
        values: dict[str, Any] = {
            "length_deviation": _given(length_deviation, "length_deviation", "m", None),
            "tension_deviation": _deviation(tension_deviation, "tension_deviation", "N", None),
            "position_deviation": _deviation(position_deviation, "position_deviation", "m", 3),
            "rotation_deviation": _deviation(rotation_deviation, "rotation_deviation", "rad", 3),
            "frame": _single(Pose(np.zeros(3), np.eye(3)) if frame is None else instance(frame, Pose, "frame")),
            "target": exactly(target, "target", "m", (3,)),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def replace(self, **changes: Any) -> Sensors:
        """Sensors with some fields changed, checked like new ones.

        Args:
            changes: Fields and their new values.

        Raises:
            InvalidValueError: If there is no such field, or a value is none the constructor accepts.
        """
        for field in changes:
            choice(field, "field", Sensors.__slots__)
        return replace(self, **changes)


def reading_deviations(sensors: Sensors, cables: int) -> Array:
    """Standard deviations of all that may be read at a pose.

    Args:
        sensors: The sensors.
        cables: Number of cables m.

    Returns:
        Of lengths [m], load cells [N], position [m] and rotation [rad], shape (2 m + 6,); infinite for no sensor.
    """
    parts = (
        (sensors.length_deviation, cables),
        (sensors.tension_deviation, cables),
        (sensors.position_deviation, 3),
        (sensors.rotation_deviation, 3),
    )
    return np.concatenate([np.broadcast_to(np.inf if part is None else part, (size,)) for part, size in parts])


def load_cells_of(robot: Robot) -> tuple[Array | float, Array | float]:
    """Gain of a robot's load cells and their bias [N], (m,) or a number; those of ideal ones without winches."""
    return (1.0, 0.0) if robot.winches is None else (robot.winches.load_cell_gain, robot.winches.load_cell_bias)


def _deviation(value: ArrayLike | None, item: str, unit: str, count: int | None) -> Array | None:
    return None if value is None else _given(value, item, unit, count)


def _given(value: ArrayLike, item: str, unit: str, count: int | None) -> Array:
    """A deviation for all, or one each of so many; None: of the cables."""
    array = checked(value, item, unit, above=0.0)
    if array.ndim > 1 or (array.ndim == 1 and count not in (None, array.size)) or array.size == 0:
        allowed = f"shape () or ({'m' if count is None else count},)"
        raise InvalidValueError(item, f"of shape {array.shape}", allowed, "Give one number, or one each.")
    return array


def _single(pose: Pose) -> Pose:
    if pose.shape:
        raise InvalidValueError("frame", f"a batch of {len(pose)}", "a single pose", "Take one of them: frame[0].")
    return pose

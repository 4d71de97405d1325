"""The sensors of a calibration: how far each is to be trusted, and where a measuring system stands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import choice, instance, optional, text
from sagline.core.arrays import Array, Flags, Indices, checked, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.core.indices import part_of
from sagline.core.results import Result, Saved
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.unit import unit

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


_BY_ROW = ("counts", "unstrained_length", "load_cells", "position", "rotation", "time", "commanded")
_UNIT = 1e-6  # by how much the length of a quaternion may be off: one printed with seven digits is taken


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WinchLog(Result, Saved):
    """Readings of a robot that stood still at N poses. NaN stands where a reading is missing.

    Attributes:
        counts: Of the encoders, shape (N, m), or None; either these or lengths are there.
        unstrained_length: Lengths off the drums as the machine believes them [m], shape (N, m), or None.
        load_cells: What the load cells at the frame ends read [N], shape (N, m), NaN for none; or None.
        position: Position of the target in the measuring system's axes [m], shape (N, 3), each coordinate NaN where
            nobody measured it; or None.
        rotation: Of the platform in those axes as unit quaternions, scalar last, shape (N, 4), rows of NaN where nobody
            measured it; or None.
        time: [s], shape (N,), in any order; or None.
        commanded: Poses that were commanded, roughly where the platform stood, N of them; or None.
        sensors: How far the readings are to be trusted.
        source: Where they were read.
    """

    counts: Array | None
    unstrained_length: Array | None
    load_cells: Array | None
    position: Array | None
    rotation: Array | None
    time: Array | None
    commanded: Pose | None
    sensors: Sensors
    source: str

    def __init__(
        self,
        counts: ArrayLike | None = None,
        unstrained_length: ArrayLike | None = None,
        load_cells: ArrayLike | None = None,
        position: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
        time: ArrayLike | None = None,
        commanded: Pose | None = None,
        sensors: Sensors | None = None,
        source: str = "",
    ) -> None:
        """Check every field once, and that they fit together.

        Args:
            counts: As the attributes; a row without a count of every cable is left out of a calibration.
            unstrained_length: See the attributes.
            load_cells: See the attributes; what they read may be negative.
            position: See the attributes.
            rotation: See the attributes.
            time: See the attributes.
            commanded: See the attributes.
            sensors: With a deviation of all that is read; None for `Sensors()`, of lengths alone.
            source: See the attributes.

        Raises:
            InvalidValueError: If both or none of counts and lengths are given, a field is of the wrong kind or shape or
                has numbers that no sensor reads, or the sensors do not say how far a reading is to be trusted.

        Examples:
            >>> import numpy as np
            >>> import sagline as sl
            >>> sensors = sl.Sensors(tension_deviation=5.0)
            >>> lengths = [[3.1, 3.2, 3.3], [3.2, 3.1, 3.4]]
            >>> cells = [[70.0, 80.0, np.nan], [72.0, 79.0, np.nan]]
            >>> log = sl.WinchLog(
            ...     unstrained_length=lengths, load_cells=cells, sensors=sensors
            ... )
            >>> print(log)
            2 rows of 3 cables: lengths, 4 readings of load cells
            >>> len(log.rows(slice(0, 1)))
            1
        """
        name, unit_, given = _lengths_or_counts(counts, unstrained_length)
        read = _table(given, name, unit_, None, None)
        n, m = read.shape
        values: dict[str, Any] = {
            "counts": None,
            "unstrained_length": None,
            name: read,
            "load_cells": None if load_cells is None else _table(load_cells, "load_cells", "N", n, m),
            "position": None if position is None else _table(position, "position", "m", n, 3),
            "rotation": None if rotation is None else _quaternions(_table(rotation, "rotation", "", n, 4)),
            "time": None if time is None else _times(time, n),
            "commanded": _poses(optional(commanded, Pose, "commanded"), n),
            "sensors": Sensors() if sensors is None else instance(sensors, Sensors, "sensors"),
            "source": text(source, "source"),
        }
        for attribute, value in values.items():
            object.__setattr__(self, attribute, value)
        _check_sensors(self, m)

    @property
    def readings(self) -> Array:
        """The counts, or the lengths [m], shape (N, m)."""
        given = self.counts if self.counts is not None else self.unstrained_length
        assert given is not None  # the constructor saw to it
        return given

    def __len__(self) -> int:
        """Number of rows N."""
        return len(self.readings)

    def rows(self, which: Flags | Indices | slice) -> WinchLog:
        """The log of some of the rows.

        Args:
            which: Flags (N,), numbers of rows, or a slice.

        Raises:
            NoSuchEntryError: If it names no rows; it is an IndexError too.
        """
        part = part_of(which, (len(self),), "single row")
        part = np.array([part]) if isinstance(part, int) else part
        parts: dict[str, Any] = {name: values[part] for name in _BY_ROW if (values := getattr(self, name)) is not None}
        for values in parts.values():
            if isinstance(values, np.ndarray):
                locked(values)  # ours: no need for another copy
        return replace(self, **parts)

    def replace(self, **changes: Any) -> WinchLog:
        """A log with some fields changed, checked like a new one.

        Args:
            changes: Fields and their new values.

        Raises:
            InvalidValueError: If there is no such field, or a value is none the constructor accepts.
        """
        for name in changes:
            choice(name, "field", WinchLog.__slots__)
        return replace(self, **changes)

    def __str__(self) -> str:
        """How many rows of what."""
        n, m = self.readings.shape
        parts = ["counts" if self.counts is not None else "lengths"]
        for values, one, many in (
            (self.load_cells, "reading of load cells", "readings of load cells"),
            (self.position, "measured coordinate", "measured coordinates"),
            (None if self.rotation is None else self.rotation[:, 0], "measured rotation", "measured rotations"),
        ):
            if values is not None:
                count = np.count_nonzero(~np.isnan(values))
                parts.append(f"{count} {one if count == 1 else many}")
        parts += ["times"] * (self.time is not None) + ["commanded poses"] * (self.commanded is not None)
        source = f"; {self.source}" if self.source else ""
        return f"{n} row{'s'[: n != 1]} of {m} cable{'s'[: m != 1]}: {', '.join(parts)}{source}"


def _lengths_or_counts(counts: ArrayLike | None, lengths: ArrayLike | None) -> tuple[str, str, ArrayLike]:
    """Name, unit and values of the one that is given."""
    if (counts is None) == (lengths is None):
        value = "neither given" if counts is None else "both given"
        step = "Give what the drives report: counts, or lengths that they computed from them."
        raise InvalidValueError("counts or unstrained_length", value, "one of the two", step)
    return ("counts", "", counts) if counts is not None else ("unstrained_length", "m", lengths)  # type: ignore[return-value]


def _table(value: ArrayLike, item: str, unit: str, rows: int | None, columns: int | None) -> Array:
    """Readings, NaN where there is none."""
    low = 0.0 if item == "unstrained_length" else -np.inf
    array = checked(value, item, unit, low=low, missing=True)
    fits = array.ndim == 2 and rows in (None, array.shape[0]) and columns in (None, array.shape[1])
    if not fits or array.shape[1] == 0:
        n, m = ("N" if rows is None else rows), ("m" if columns is None else columns)
        step = "Give a row for each pose, and in it a column for each cable."
        if columns in (3, 4) and item in ("position", "rotation"):
            step = "Give a row for each row of the log, NaN where nothing was measured."
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape ({n}, {m})", step)
    return array


def _quaternions(given: Array) -> Array:
    """Unit quaternions, with rows of NaN."""
    missing = np.isnan(given)
    whole = ~missing.any(axis=1)
    length = np.linalg.norm(given, axis=1)
    if (wrong := missing.any(axis=1) & ~missing.all(axis=1)).any():
        k = int(np.argmax(wrong))
        raise InvalidValueError(f"rotation[{k}]", "NaN in part", "four numbers, or NaN four times", "Correct it.")
    if (wrong := whole & ~(np.abs(length - 1.0) <= _UNIT)).any():
        k = int(np.argmax(wrong))
        step = "Give unit quaternions, scalar last."
        raise InvalidValueError(f"rotation[{k}]: length", f"{length[k]:.9g}", "1 to 1e-6", step)
    found = np.full(given.shape, np.nan)
    found[whole] = unit(given[whole])
    return locked(found)


def _times(value: ArrayLike, rows: int) -> Array:
    time = checked(value, "time", "s")
    if time.shape != (rows,):
        raise InvalidValueError("time", f"of shape {time.shape}", f"shape ({rows},)", "Give one a row.")
    return time


def _poses(pose: Pose | None, rows: int) -> Pose | None:
    if pose is not None and pose.shape != (rows,):
        value = f"a batch of {len(pose)}" if pose.shape else "a single pose"
        raise InvalidValueError("commanded", value, f"a batch of {rows}", "Give one a row of the log.")
    return pose


def _check_sensors(log: WinchLog, cables: int) -> None:
    """Refuse readings that nobody says how far to trust, and deviations of other cables."""
    pairs = (
        ("length_deviation", log.readings, cables),
        ("tension_deviation", log.load_cells, cables),
        ("position_deviation", log.position, 3),
        ("rotation_deviation", log.rotation, 3),
    )
    names = {"tension_deviation": "load_cells", "position_deviation": "position", "rotation_deviation": "rotation"}
    for name, read, size in pairs:
        deviation = getattr(log.sensors, name)
        item = f"sensors: {name}"
        if read is not None and deviation is None:
            step = f"Give sensors=Sensors({name}=...), or leave {names[name]} out."
            raise InvalidValueError(item, "None", f"the standard deviation of what {names[name]} has", step)
        if deviation is not None and deviation.shape not in ((), (size,)):
            step = "Give one for all, or one each."
            raise InvalidValueError(item, f"of shape {deviation.shape}", f"shape () or ({size},)", step)

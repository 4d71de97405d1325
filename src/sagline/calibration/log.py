"""Logs of a robot's own readings, with one row per pose at rest, and standard deviations of the sensors."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from attrs import evolve, field, fields, frozen
from numpy.typing import ArrayLike

from sagline.calibration import rest
from sagline.core.arguments import choice, instance, optional, part_of, text
from sagline.core.arrays import Array, Flags, Indices, checked, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, if_known, reduced, rule
from sagline.core.results import Columns, Result, Saved, Tabular, set_fields
from sagline.robot.pose import Pose, PoseLike, single_pose, unit
from sagline.robot.robot import Robot

LENGTH_DEVIATION = 5e-4  # [m], typical error of the length of a fiber rope on a grooved drum


def _world_if_none(frame: PoseLike | None) -> PoseLike:
    return Pose(np.zeros(3), np.eye(3)) if frame is None else frame


def _default_if_none(sensors: Sensors | None) -> Sensors:
    return Sensors() if sensors is None else sensors


class _Replaceable(Result):
    """Base class of input types: `replace` changes fields, and unpickling calls the constructor."""

    __slots__ = ()

    def replace(self, **changes: Any) -> Self:
        """Copy with some fields changed; the constructor checks the copy.

        Args:
            changes: Fields and their new values.

        Raises:
            InvalidValueError: If a field does not exist, or the constructor rejects a value.
        """
        for name in changes:
            choice(name, "field", self.__slots__)
        return evolve(self, **changes)  # type: ignore[misc]

    __reduce__ = reduced


@frozen(eq=False, weakref_slot=False)
class Sensors(_Replaceable):
    """Accuracy of a robot's sensors, and the pose of its measuring system.

    Attributes:
        length_deviation: Standard deviation of the lengths off the drums [m], > 0, shape () or (m,).
        tension_deviation: Standard deviation of a load cell [N], > 0, shape () or (m,); None without load cells.
        position_deviation: Standard deviation of each coordinate of a measured position [m], > 0, shape () or (3,),
            along the axes of the measuring system; None if positions are not measured.
        rotation_deviation: Standard deviation of measured rotations about each axis [rad], > 0, shape () or (3,); None
            if rotations are not measured. If the third value is infinite, the yaw is not measured, as with an
            inclinometer: roll and pitch refer to the vertical and the axes of the world, not to `frame`, and the yaw of
            the rotations in a log has no effect.
        swivel_deviation: Standard deviation of the measured swivel angle of a pulley [rad], > 0, shape () or (m,); None
            without such sensors.
        frequency_deviation: Standard deviation of a measured natural frequency [Hz], > 0, shape () or (K,); None if
            frequencies are not measured.
        frame: Pose of the measuring system in the world; None for the axes of the world. If p are the measured
            coordinates of a point, its world coordinates are frame.position + frame.matrix p.
        target: The measured point of the platform, in the platform frame [m], shape (3,).

    Raises:
        InvalidValueError: If a standard deviation is not positive, or a value has the wrong type or shape.

    Examples:
        >>> import sagline as sl
        >>> sensors = sl.Sensors(length_deviation=5e-4, tension_deviation=5.0)
        >>> print(sensors.tension_deviation, sensors.position_deviation)
        5.0 None
    """

    length_deviation: Array = field(default=LENGTH_DEVIATION, converter=given, metadata=rule("m", above=0.0))
    tension_deviation: Array | None = field(default=None, converter=if_known, metadata=rule("N", above=0.0))
    position_deviation: Array | None = field(default=None, converter=if_known, metadata=rule("m", above=0.0))
    rotation_deviation: Array | None = field(
        default=None, converter=if_known, metadata=rule("rad", above=0.0, infinite=True)
    )
    swivel_deviation: Array | None = field(
        default=None, kw_only=True, converter=if_known, metadata=rule("rad", above=0.0)
    )
    frequency_deviation: Array | None = field(
        default=None, kw_only=True, converter=if_known, metadata=rule("Hz", above=0.0)
    )
    frame: Pose = field(default=None, kw_only=True, converter=_world_if_none)
    target: Array = field(default=(0.0, 0.0, 0.0), kw_only=True, converter=given)

    def __attrs_post_init__(self) -> None:
        """Check every field once."""
        for about in fields(Sensors)[:6]:
            if (value := getattr(self, about.name)) is not None or about.default is not None:
                own = checked(value, about.name, **about.metadata)
                axes = 3 if about.name in ("position_deviation", "rotation_deviation") else None
                if own.ndim > 1 or (own.ndim == 1 and axes not in (None, own.size)) or own.size == 0:
                    allowed, step = f"shape () or ({axes or 'm'},)", "Give one number, or one number per entry."
                    raise InvalidValueError(about.name, f"of shape {own.shape}", allowed, step)
                if about.name == "rotation_deviation" and not np.isfinite(own if own.ndim == 0 else own[:2]).all():
                    step = "Give None if rotations are not measured; only the third value may be infinite."
                    raise InvalidValueError(about.name, "infinite", "finite about x and y", step)
                set_fields(self, **{about.name: own})
        set_fields(self, frame=single_pose(self.frame, "frame"), target=exactly(self.target, "target", "m", (3,)))


def measures_yaw(sensors: Sensors) -> bool:
    """True if rotations are measured about all three axes."""
    return sensors.rotation_deviation is not None and bool(np.isfinite(sensors.rotation_deviation).all())


def reading_deviations(sensors: Sensors, cables: int, frequencies: int = 0) -> Array:
    """Standard deviations of lengths, load cells, position and rotation, (2 m + 6,); infinite for a missing sensor."""
    # With swivel angles, their deviations (m,) follow, then those of the measured natural frequencies.
    parts = [
        (sensors.length_deviation, cables),
        (sensors.tension_deviation, cables),
        (sensors.position_deviation, 3),
        (sensors.rotation_deviation, 3),
    ]
    parts += [] if sensors.swivel_deviation is None else [(sensors.swivel_deviation, cables)]
    parts += [(sensors.frequency_deviation, frequencies)] if frequencies else []
    return np.concatenate([np.broadcast_to(np.inf if part is None else part, (size,)) for part, size in parts])


def count_of_frequencies(sensors: Sensors, cables: int, width: int) -> int:
    """Number of natural frequencies K among `width` columns of lengths and readings."""
    return width - 2 * cables - 6 - (0 if sensors.swivel_deviation is None else cables)


def load_cells_of(robot: Robot) -> tuple[Array | float, Array | float]:
    """Gain and bias [N] of a robot's load cells, (m,) or numbers; gain 1 and bias 0 for a robot without winches."""
    return (1.0, 0.0) if robot.winches is None else (robot.winches.load_cell_gain, robot.winches.load_cell_bias)


# readings that a log may have beside the counts or lengths, and their standard deviations
READINGS = {
    "load_cells": "tension_deviation",
    "position": "position_deviation",
    "rotation": "rotation_deviation",
    "swivel": "swivel_deviation",
    "frequency": "frequency_deviation",
}
_BY_ROW = ("counts", "unstrained_length", *READINGS, "time", "commanded")
_UNIT = 1e-6  # allowed error of a quaternion's norm; quaternions that were printed with seven digits are accepted


@frozen(eq=False, repr=False, weakref_slot=False)
class WinchLog(_Replaceable, Saved, Tabular):
    """Readings of a robot at rest at N poses; NaN where a reading is missing.

    Attributes:
        counts: Encoder counts, shape (N, m); None if lengths are given. A calibration omits rows with a missing count.
        unstrained_length: Reported lengths off the drums [m], shape (N, m); None if `counts` are given. Relative
            lengths with unknown zeros may be negative.
        load_cells: Readings of the load cells at the frame ends [N], may be negative, shape (N, m), NaN if missing; or
            None.
        position: Position of the target in the axes of the measuring system [m], shape (N, 3), NaN for an unmeasured
            coordinate; or None.
        rotation: Rotation from the platform frame to the axes of the measuring system, as unit quaternions, scalar
            last, shape (N, 4), rows of NaN if not measured; or None.
        time: Time of each row [s], shape (N,), in any order; or None.
        commanded: N commanded poses, near the actual poses; or None.
        sensors: Standard deviations of all readings; None for `Sensors()`, which contains only lengths.
        swivel: Measured swivel angles of the pulleys [rad], relative to unknown zeros, shape (N, m), NaN if missing; or
            None. The angle is that of the pulley about its swivel axis: 0 toward x, or upward for an axis within 45
            degrees of x.
        frequency: Lowest natural frequencies of the platform [Hz], ascending, shape (N, K), NaN if missing; or None.
        source: Text that states the origin of the readings, such as a file name.

    Raises:
        InvalidValueError: If `counts` and `unstrained_length` are both given or both missing; if a field has a wrong
            type, shape or value; if `sensors` has no standard deviation for a reading.

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

    _columns: ClassVar[Columns] = (
        "time",
        "count_#=counts",
        "length_#=unstrained_length",
        "load_cell_#=load_cells",
        "@=position",
        "q@=rotation",
        "@_commanded=commanded.position",
        "q@_commanded=commanded.quaternion",
        "swivel_#=swivel",
        "frequency_#=frequency",
    )

    counts: Array | None = field(default=None, converter=if_known)
    unstrained_length: Array | None = field(default=None, converter=if_known)
    load_cells: Array | None = field(default=None, converter=if_known)
    position: Array | None = field(default=None, converter=if_known)
    rotation: Array | None = field(default=None, converter=if_known)
    time: Array | None = field(default=None, converter=if_known)
    commanded: Pose | None = None
    sensors: Sensors = field(default=None, converter=_default_if_none)
    source: str = ""
    swivel: Array | None = field(default=None, kw_only=True, converter=if_known)
    frequency: Array | None = field(default=None, kw_only=True, converter=if_known)

    def __attrs_post_init__(self) -> None:
        """Check every field once, and check that the fields are consistent."""
        name, unit_, values = _lengths_or_counts(self.counts, self.unstrained_length)
        read = _table(values, name, unit_, None, None)
        n, m = read.shape
        set_fields(self, **{name: read})
        columns_of = (("load_cells", "N", m), ("position", "m", 3), ("rotation", "", 4), ("swivel", "rad", m))
        for name, unit_, columns in columns_of:
            if (value := getattr(self, name)) is not None:
                table = _table(value, name, unit_, n, columns)
                set_fields(self, **{name: _quaternions(table) if name == "rotation" else table})
        if self.frequency is not None:
            set_fields(self, frequency=_ascending(_table(self.frequency, "frequency", "Hz", n, None)))
        if self.time is not None:
            time = checked(self.time, "time", "s")
            if time.shape != (n,):
                raise InvalidValueError("time", f"of shape {time.shape}", f"shape ({n},)", "Give one per row.")
            set_fields(self, time=time)
        if (pose := optional(self.commanded, Pose, "commanded")) is not None and pose.shape != (n,):
            value = f"a batch of {len(pose)}" if pose.shape else "a single pose"
            raise InvalidValueError("commanded", value, f"a batch of {n}", "Give one per row of the log.")
        instance(self.sensors, Sensors, "sensors")
        set_fields(self, source=text(self.source, "source"))
        _check_sensors(self, m)

    @property
    def readings(self) -> Array:
        """The counts, or the lengths [m], shape (N, m)."""
        given = self.counts if self.counts is not None else self.unstrained_length
        assert given is not None  # checked by the constructor
        return given

    def __len__(self) -> int:
        """Number of rows N."""
        return len(self.readings)

    def rows(self, which: Flags | Indices | slice) -> WinchLog:
        """Log with a selection of the rows.

        Args:
            which: Flags (N,), row indices, or a slice.

        Raises:
            NoSuchEntryError: If a row does not exist; the error is also an IndexError.
        """
        part = part_of(which, (len(self),), "single row")
        part = np.array([part]) if isinstance(part, int) else part
        parts: dict[str, Any] = {name: values[part] for name in _BY_ROW if (values := getattr(self, name)) is not None}
        for values in parts.values():
            if isinstance(values, np.ndarray):
                locked(values)  # a new array: no copy needed
        return evolve(self, **parts)

    def at_rest(self, duration: float = 1.0) -> WinchLog:
        """Log with one row for each rest of the robot: the mean readings of the rest.

        A rest is a part in which no reading leaves a band of 8 standard deviations. The means of both halves differ by
        at most half a standard deviation, apart from noise. The band of counts is a thousandth of their range. The
        means are over the middle 80 % of a rest.

        Args:
            duration: Least duration of a rest [s], > 0.

        Returns:
            The log; `time` is the middle of each rest.

        Raises:
            InvalidValueError: If the log has no times, if they do not increase, or if the robot is never at rest.

        Examples:
            >>> import numpy as np
            >>> import sagline as sl
            >>> time = np.arange(0.0, 6.0, 0.1)
            >>> length = 2.0 + 0.5 * np.clip(time - 2.0, 0.0, 2.0)
            >>> log = sl.WinchLog(unstrained_length=length[:, None], time=time)
            >>> print(log.at_rest().unstrained_length.round(3).tolist())
            [[2.0], [3.0]]
        """
        deviations = {"unstrained_length": "length_deviation", **READINGS}
        del deviations["frequency"]
        readings = {name: (getattr(self, name), getattr(self.sensors, own)) for name, own in deviations.items()}
        parts = rest.rests_of(self.time, self.counts, readings, number(duration, "duration", "s", above=0.0))
        arrays = {name: values for name in _BY_ROW if isinstance(values := getattr(self, name), np.ndarray)}
        means: dict[str, Any] = {**rest.means_of(arrays, parts)}
        return evolve(self.rows(np.array([(part.start + part.stop) // 2 for part in parts])), **means)

    def __str__(self) -> str:
        """Text with the number of rows and the kinds of readings."""
        n, m = self.readings.shape
        parts = ["counts" if self.counts is not None else "lengths"]
        turned = "rotation" if measures_yaw(self.sensors) else "inclination"
        for values, one, many in (
            (self.load_cells, "reading of load cells", "readings of load cells"),
            (self.position, "measured coordinate", "measured coordinates"),
            (None if self.rotation is None else self.rotation[:, 0], f"measured {turned}", f"measured {turned}s"),
            (self.swivel, "swivel angle", "swivel angles"),
            (self.frequency, "natural frequency", "natural frequencies"),
        ):
            if values is not None:
                count = np.count_nonzero(~np.isnan(values))
                parts.append(f"{count} {one if count == 1 else many}")
        parts += ["times"] * (self.time is not None) + ["commanded poses"] * (self.commanded is not None)
        source = f"; {self.source}" if self.source else ""
        return f"{n} row{'s'[: n != 1]} of {m} cable{'s'[: m != 1]}: {', '.join(parts)}{source}"


def _lengths_or_counts(counts: ArrayLike | None, lengths: ArrayLike | None) -> tuple[str, str, ArrayLike]:
    """Name, unit and values of the field that is given: counts or lengths."""
    if (counts is None) == (lengths is None):
        value = "neither given" if counts is None else "both given"
        step = "Give the counts, or the lengths that the drives computed from them."
        raise InvalidValueError("counts or unstrained_length", value, "one of the two", step)
    return ("counts", "", counts) if counts is not None else ("unstrained_length", "m", lengths)  # type: ignore[return-value]


def _table(value: ArrayLike, item: str, unit: str, rows: int | None, columns: int | None) -> Array:
    """Checked array of readings; NaN for a missing reading."""
    array = checked(value, item, unit, missing=True)
    fits = array.ndim == 2 and rows in (None, array.shape[0]) and columns in (None, array.shape[1])
    if not fits or array.shape[1] == 0:
        n, m = ("N" if rows is None else rows), ("m" if columns is None else columns)
        step = "Give one row per pose and one column per cable."
        if columns in (3, 4) and item in ("position", "rotation"):
            step = "Give one row per row of the log, NaN for a missing measurement."
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape ({n}, {m})", step)
    return array


def _quaternions(given: Array) -> Array:
    """Checked unit quaternions (N, 4); rows of NaN are allowed."""
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


def _ascending(frequency: Array) -> Array:
    """Checked frequencies (N, K): positive, and ascending in each row apart from missing values."""
    before = np.fmax.accumulate(np.where(np.isnan(frequency), 0.0, frequency), axis=1)
    before = np.hstack((np.zeros((len(frequency), 1)), before[:, :-1]))
    for row, k in np.argwhere(frequency <= before)[:1].tolist():
        value, step = f"{frequency[row, k]:.6g} Hz", "Order the frequencies of each row; leave a missing one blank."
        raise InvalidValueError(f"frequency[{row}, {k}]", value, f"> {before[row, k]:.6g} Hz, the one before it", step)
    return frequency


def _check_sensors(log: WinchLog, cables: int) -> None:
    """Reject readings without a standard deviation, and standard deviations for a wrong number of cables."""
    sizes = (cables, cables, 3, 3, cables, 0 if log.frequency is None else log.frequency.shape[1])
    for (read, name), size in zip({"readings": "length_deviation", **READINGS}.items(), sizes, strict=True):
        deviation, item = getattr(log.sensors, name), f"sensors: {name}"
        if getattr(log, read) is not None and deviation is None:
            step = f"Give sensors=Sensors({name}=...), or leave {read} out."
            raise InvalidValueError(item, "None", f"the standard deviation of {read}", step)
        if deviation is not None and deviation.shape not in ((), (size,)):
            step = "Give one value for all, or one value per entry."
            raise InvalidValueError(item, f"of shape {deviation.shape}", f"shape () or ({size},)", step)

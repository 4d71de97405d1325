"""Rows of a log at which the robot is at rest, and means of rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError

_BAND: Final = 8.0  # width of the band of a reading at rest [standard deviations]
_TREND: Final = 0.5  # largest difference of both halves of a rest [standard deviations], in addition to the noise
_COUNTS: Final = 1e-3  # width of the band of counts, relative to their range in the log
_CUT: Final = 10  # one row of this number of rows is omitted at both ends of a rest, because motion fades there


Readings = Mapping[str, tuple[Array | None, Array | None]]  # tables (N, columns) or None, and standard deviations


def rests_of(time: Array | None, counts: Array | None, readings: Readings, duration: float) -> list[slice]:
    """Rows of each rest of at least `duration` [s]. The criterion is described in `WinchLog.at_rest`."""
    if time is None or (np.diff(time) <= 0.0).any():
        value = "missing" if time is None else "not increasing"
        raise InvalidValueError("time", value, "a later time in each row", "Log the time of each row.")
    given = [
        (_rotation_vectors(read) if name == "rotation" else read) / deviation
        for name, (read, deviation) in readings.items()
        if read is not None and deviation is not None
    ]
    if counts is not None:
        given.append(counts / np.maximum(_COUNTS / _BAND * np.ptp(counts, axis=0), 1.0))
    parts = list(_rests(np.hstack(given), time, duration))
    if not parts:
        step = "Stop longer at each pose, give larger deviations, or a shorter duration."
        raise InvalidValueError("log", f"without a rest of {duration:g} s", "at least one", step)
    return parts


def means_of(tables: Mapping[str, Array], parts: Sequence[slice]) -> dict[str, Array]:
    """Means of the rows of each part of all tables (N, ...); the table "rotation" contains quaternions."""
    return {
        name: np.array([(_mean_rotation if name == "rotation" else _mean_of_rows)(table[part]) for part in parts])
        for name, table in tables.items()
    }


def _rotation_vectors(quaternions: Array) -> Array:
    """Rotation vectors (N, 3) [rad] of quaternions (N, 4); NaN for a missing rotation."""
    missing = np.isnan(quaternions[:, :1])
    turns = Rotation.from_quat(np.where(missing, [0.0, 0.0, 0.0, 1.0], quaternions)).as_rotvec()
    return np.where(missing, np.nan, turns)


def _rests(values: Array, time: Array, duration: float) -> Iterator[slice]:
    """Rows of each rest; values: (N, columns) in standard deviations."""
    begin, count = 0, len(time)
    while begin < count:
        low, high, end = values[begin], values[begin], begin + 1
        while end < count:
            low, high = np.fmin(low, values[end]), np.fmax(high, values[end])
            if (high - low > _BAND).any():
                break
            end += 1
        cut = (end - begin) // _CUT
        part = slice(begin + cut, end - cut)
        half = (part.start + part.stop) // 2
        trend = np.abs(_mean_of_rows(values[part.start : half]) - _mean_of_rows(values[half : part.stop]))
        long = time[end - 1] - time[begin] >= duration
        # noise gives the difference of the means a standard deviation of the square root of 4/n
        if long and not (trend > _TREND + 3.0 * np.sqrt(4.0 / (part.stop - part.start))).any():
            yield part
            begin = end
        else:
            begin = half if long else begin + 1


def _mean_of_rows(values: Array) -> Array:
    """Mean of the rows; NaN for a column without a reading."""
    known = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(known, values, 0.0).sum(axis=0) / known.sum(axis=0))


def _mean_rotation(quaternions: Array) -> Array:
    """Mean of unit quaternions (n, 4); NaN if all are missing."""
    known = quaternions[~np.isnan(quaternions[:, 0])]
    return np.asarray(Rotation.from_quat(known).mean().as_quat() if len(known) else np.full(4, np.nan))

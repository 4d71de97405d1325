"""What is given to a simulation in time: tables, and the cubics between their rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.dynamics.tables_in_time import CourseArrays
from sagline.motion.path import checked_time

TableInTime = ArrayLike | tuple[ArrayLike, ArrayLike]  # one row, or times and as many rows


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """n numbers in time: a cubic between two instants, by values and rates at both; held before and after.

    Attributes:
        time: Instants [s], shape (K,), increasing.
        value: Shape (K, n).
        begin: Rates where each interval begins, shape (K - 1, n).
        end: Rates where each ends, shape (K - 1, n).
    """

    time: Array
    value: Array
    begin: Array
    end: Array

    @classmethod
    def still(cls, value: Array) -> Course:
        """Numbers (n,) that do not change."""
        none = np.empty((0, value.size))
        return cls(np.zeros(1), np.array(value[None]), none, none)

    @classmethod
    def straight(cls, time: Array, value: Array) -> Course:
        """Straight lines between rows (K, n)."""
        slope = np.diff(value, axis=0) / np.diff(time)[:, None]
        return cls(time, value, slope, slope)

    @classmethod
    def smooth(cls, time: Array, value: Array, rate: Array) -> Course:
        """Cubics through rows (K, n) whose rates are known."""
        return cls(time, value, np.ascontiguousarray(rate[:-1]), np.ascontiguousarray(rate[1:]))

    @property
    def arrays(self) -> CourseArrays:
        """As kernels take it: read-only, C-contiguous."""
        time, value, begin, end = (
            locked(np.ascontiguousarray(array, dtype=np.float64).view())
            for array in (self.time, self.value, self.begin, self.end)
        )
        return time, value, begin, end

    def part(self, columns: Any) -> Course:
        """Some of the numbers."""
        return Course(self.time, self.value[:, columns], self.begin[:, columns], self.end[:, columns])

    def beside(self, other: Course) -> Course:
        """These numbers, then those of another course of the same instants."""
        pairs = ((self.value, other.value), (self.begin, other.begin), (self.end, other.end))
        return Course(self.time, *(np.concatenate(pair, axis=1) for pair in pairs))

    def at(self, time: float) -> tuple[Array, Array]:
        """Values and rates (n,) at a time; where the rate jumps, the later one."""
        if len(self.time) == 1 or time < self.time[0] or time >= self.time[-1]:
            return self.value[0 if time < self.time[0] else -1], np.zeros(self.value.shape[1])
        k = int(np.searchsorted(self.time, time, side="right")) - 1
        whole = self.time[k + 1] - self.time[k]
        x = (time - self.time[k]) / whole
        slope = (self.value[k + 1] - self.value[k]) / whole
        begin, end = self.begin[k] - slope, self.end[k] - slope
        bend = (1.0 - x) * begin - x * end
        value = (1.0 - x) * self.value[k] + x * self.value[k + 1] + whole * x * (1.0 - x) * bend
        return value, slope + (1.0 - 2.0 * x) * bend - x * (1.0 - x) * (begin + end)

    def with_instant(self, time: float) -> Course:
        """The same course with one more instant."""
        if time in self.time:
            return self
        k = int(np.searchsorted(self.time, time))
        value, rate = self.at(time)
        before = rate if 0 < k < len(self.time) else np.zeros_like(rate)
        outside = k in (0, len(self.time))
        times, values = np.insert(self.time, k, time), np.insert(self.value, k, value, axis=0)
        if outside:
            place = 0 if k == 0 else len(self.begin)
            return Course(
                times, values, np.insert(self.begin, place, before, axis=0), np.insert(self.end, place, before, axis=0)
            )
        begin, end = np.insert(self.begin, k, rate, axis=0), np.insert(self.end, k - 1, rate, axis=0)
        return Course(times, values, begin, end)

    def brought_to_rest(self, time: float, duration: float, columns: Any) -> Course:
        """A course of which some columns come to rest from a time on, their rates falling evenly in a duration [s]."""
        course = self.with_instant(time).with_instant(time + duration)
        (start, rate), stop = course.at(time), time + duration
        later = np.flatnonzero(course.time >= time)
        passed = np.minimum(course.time[later] - time, duration)[:, None]
        value, begin, end = course.value.copy(), course.begin.copy(), course.end.copy()
        whole = (start + rate * passed * (1.0 - 0.5 * passed / duration))[:, columns]
        left = (rate * (1.0 - passed / duration))[:, columns]
        value[np.ix_(later, columns)] = whole
        inner = later[later < len(begin)]
        begin[np.ix_(inner, columns)] = left[: len(inner)]
        end[np.ix_(later[1:] - 1, columns)] = left[1:]
        assert stop in course.time
        return Course(course.time, value, begin, end)


def table_in_time(given: Any, item: str, unit: str, columns: int, begin: float) -> Course:
    """Rows in time as a caller gives them: one row that holds all the time, or times and rows, straight in between.

    Args:
        given: Shape (n,); or a pair of times [s] (K,) and rows (K, n).
        item: The name a message uses.
        unit: Of the rows, for the message.
        columns: n.
        begin: The first time that is simulated [s].

    Returns:
        Course.

    Raises:
        InvalidValueError: If it is neither, or the table begins later.
    """
    if not (isinstance(given, tuple | list) and len(given) == 2):
        return Course.still(exactly(given, item, unit, (columns,)))
    try:
        time = checked_time(given[0])
    except InvalidValueError as error:
        raise InvalidValueError(f"{item}: {error.item}", error.value, error.allowed, error.next_step) from None
    rows = checked(given[1], item, unit, shape=(None, columns))
    if rows.shape != (time.size, columns):
        allowed, step = f"shape ({time.size}, {columns})", "Give one row a time, or one row alone."
        raise InvalidValueError(item, f"of shape {rows.shape}", allowed, step)
    if time[0] > begin:
        allowed = f"a time <= {begin:g} s, the start"
        raise InvalidValueError(f"{item}: time[0]", f"{time[0]:g} s", allowed, "Begin the table where the run begins.")
    return Course.straight(time, rows) if time.size > 1 else Course.still(rows[0])

"""Time tables: rows of numbers at instants, and cubics between them."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, glue

MOMENT = 1e-6  # of a step: instants that are nearer are the same

TimeTableArrays = tuple[Array, Array, Array, Array]  # a Course as it comes from Python


class TimeTable(NamedTuple):
    """n numbers in time: a cubic on every interval, by its values and rates at both ends; held before and after.

    Attributes:
        time: Instants [s], (K,), increasing.
        value: There, (K, n).
        begin: Rates where each interval begins, (K - 1, n).
        end: Rates where each ends, (K - 1, n).
    """

    time: Array
    value: Array
    begin: Array
    end: Array


@formula
def interpolate_table(course: TimeTable, at: int, now: float, shift: float, value: Array, rate: Array) -> int:
    """Fill values and rates (n,) at a time, from a course whose interval at or before it is known; returns that now.

    shift: a moment by which the interval is looked for earlier or later: at an instant of the course that before it is
    taken where it is negative, that after it where it is positive.
    """
    times, last, moment = course.time, course.time.shape[0] - 1, now + shift
    while at < last - 1 and moment >= times[at + 1]:
        at += 1
    if last == 0 or moment < times[0] or moment >= times[last]:
        row = last if moment >= times[last] else 0
        for k in range(value.shape[0]):
            value[k] = course.value[row, k]
            rate[k] = 0.0
        return at
    whole = times[at + 1] - times[at]
    x = (now - times[at]) / whole
    left = 1.0 - x
    for k in range(value.shape[0]):
        low, high = course.value[at, k], course.value[at + 1, k]
        slope = (high - low) / whole
        begin, end = course.begin[at, k] - slope, course.end[at, k] - slope
        bend = left * begin - x * end
        value[k] = (left * low + x * high) + whole * x * left * bend
        rate[k] = slope + (left - x) * bend - x * left * (begin + end)
    return at


@glue
def interval_ends(course: TimeTable, at: int, moment: float) -> bool:
    """True if the current interval ends by a moment and another follows."""
    return at < course.time.shape[0] - 1 and moment >= course.time[at + 1]

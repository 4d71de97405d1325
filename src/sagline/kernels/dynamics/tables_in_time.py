"""What is given in time: rows of numbers at instants, and cubics between them."""

from __future__ import annotations

from typing import NamedTuple

from sagline.arrays import Array
from sagline.kernels.jit import formula

CourseArrays = tuple[Array, Array, Array, Array]  # a Course as it comes from Python


class Course(NamedTuple):
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
def follow(course: Course, at: int, now: float, value: Array, rate: Array) -> int:
    """Fill values and rates (n,) at a time, from a course whose interval at or before it is known; returns that now."""
    times, last = course.time, course.time.shape[0] - 1
    while at < last - 1 and now >= times[at + 1]:
        at += 1
    if last == 0 or now <= times[0] or now > times[last]:
        row = last if now > times[last] else 0
        for k in range(value.shape[0]):
            value[k] = course.value[row, k]
            rate[k] = course.begin[0, k] if last > 0 and now == times[0] else 0.0
        return at
    whole = times[at + 1] - times[at]
    x = (now - times[at]) / whole
    left = 1.0 - x
    for k in range(value.shape[0]):
        low, high = course.value[at, k], course.value[at + 1, k]
        begin, end, slope = course.begin[at, k], course.end[at, k], (high - low) / whole
        bend = left * (begin - slope) - x * (end - slope)
        value[k] = (left * low + x * high) + whole * x * left * bend
        rate[k] = slope + (left - x) * bend - x * left * ((begin - slope) + (end - slope))
    return at

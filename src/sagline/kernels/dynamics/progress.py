"""Simulations over time: time tables, counters, records, notes of events, and the tasks of one control period."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import LARGEST, Array, Indices
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.drum import turns_of_lengths
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import Drives
from sagline.kernels.jit import entry, formula, glue, kernel

MOMENT = 1e-6  # two instants count as equal up to this difference, relative to a step

CubicTableArrays = tuple[Array, Array, Array, Array]  # a Course as passed from Python


class CubicTable(NamedTuple):
    """Piecewise cubic time table of n numbers from values and rates; constant before its start and after its end."""

    time: Array  # instants [s], (K,), increasing
    value: Array  # values at these instants, (K, n)
    begin: Array  # rates at the start of each interval, (K - 1, n)
    end: Array  # rates at the end of each interval, (K - 1, n)


@formula
def interpolate_table(course: CubicTable, at: int, now: float, shift: float, value: Array, rate: Array) -> int:
    """Fill values and rates (n,) of `course` at the time `now`. Returns the interval, searched from `at` on."""
    # `shift`: small time offset. At an instant of the table, a negative shift selects the interval that ends there, and
    # a positive shift selects the interval that starts there.
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
def interval_ends(course: CubicTable, at: int, moment: float) -> bool:
    """True if the current interval `at` ends at or before `moment`, and another interval follows."""
    return at < course.time.shape[0] - 1 and moment >= course.time[at + 1]


# of lengths, wrenches, wind velocity, and positions of moving anchors (without columns for fixed anchors)
Courses = tuple[CubicTableArrays, CubicTableArrays, CubicTableArrays, CubicTableArrays]
Kept = tuple[Array, Array, Array, Array, Array, Indices, Array]  # state, rows, drives, layers, audit, counters


@glue
def time_tables(courses: Courses) -> tuple[CubicTable, CubicTable, CubicTable, CubicTable]:
    """Time tables of lengths, wrenches, wind velocity and anchors."""
    return CubicTable(*courses[0]), CubicTable(*courses[1]), CubicTable(*courses[2]), CubicTable(*courses[3])


# counters of a run, which each call updates; RENEWED: 1 for new set points, 2 if the wrench has changed too
STEPS, LENGTH_AT, WRENCH_AT, WIND_AT, NOTES, RECORDS, READY, FAILED, RENEWED, ANCHOR_AT = range(10)
COUNTERS = 10
# columns of the notes: event, time and cable; largest tensions before and after the event; state of the cable or drive
NOTE_TIME, NOTE_KIND, NOTE_CABLE, NOTE_BEFORE, NOTE_AFTER, NOTE_STATE = range(6)
NOTE_COLUMNS = 6
NOTE_SLACK, NOTE_SATURATED = 0.0, 1.0
# columns of the energies of a record
KINETIC, POTENTIAL, SUPPLIED, LOST = range(4)
ENERGY_COLUMNS = 4

ROUNDING = 1e-9  # tolerance of the energy, relative to the sum of its parts (for chains, relative to the weights)


@kernel
def note_events(
    drives: Drives, rows: Array, cables: Array, at: Indices, now: float, weight_of: float, notes: Array
) -> None:
    """Update the largest tensions. Record each new event: a cable becomes slack, or a drive reaches its limit."""
    largest = 0.0
    for i in range(rows.shape[1]):
        tension = drives.now[d.AT_FRAME, i]
        drives.now[d.PEAK, i] = max(drives.now[d.PEAK, i], tension)
        largest = max(largest, tension)
        slack = not rows[g.TENSION, i] > 0.5 * cables[i, tables.DENSITY] * weight_of * rows[g.CHORD, i]
        known = drives.now[d.SLACK, i]
        drives.now[d.SLACK, i] = (d.NEW + d.YES if known == d.NO else known) if slack else d.NO
    if at[NOTES] > 0:
        row = at[NOTES] - 1
        notes[row, NOTE_AFTER] = max(notes[row, NOTE_AFTER], largest)
    for i in range(rows.shape[1]):
        for kind in range(2):
            flag = d.SATURATED if kind == NOTE_SATURATED else d.SLACK
            if drives.now[flag, i] >= d.NEW:
                drives.now[flag, i] -= d.NEW
                if at[NOTES] < notes.shape[0]:
                    row = at[NOTES]
                    notes[row, NOTE_TIME], notes[row, NOTE_KIND], notes[row, NOTE_CABLE] = now, kind, i
                    notes[row, NOTE_BEFORE], notes[row, NOTE_AFTER] = drives.now[d.PEAK, i], largest
                    notes[row, NOTE_STATE] = drives.now[flag, i]
                    at[NOTES] += 1


@glue
def has_room(at: Indices, notes: Array, cables: int) -> bool:
    """True if `notes` has free rows for all events that one step can cause."""
    return at[NOTES] + 2 * cables <= notes.shape[0]


@entry
def begin_period(
    given: tuple[Array, Array, Array],
    least: Array,
    stretch: Array,
    lengths: Array,
    course: tuple[Array, Array, Array, Array],
    load: Array,
    at: Indices,
    with_tension: bool,
    with_wrench: bool,
    end: float,
) -> bool:
    """Extend the time table linearly to new set points. If a set point is invalid, change nothing and return False."""
    # given: Unstrained lengths (m,); for drums also expected tensions (m,); wrench (6,).
    # least: Lower bounds of the lengths, (m,).
    # stretch: Factors from unstrained lengths to lengths of the time table, (m,).
    # lengths: Unstrained lengths at the end of the last period and at the end of this period, (2, m).
    # course: The time table, see `Course`, with two instants.
    # load: Wrench on the platform, (6,).
    # at: Counters of the run, see `progress`.
    # with_tension: True if tensions are given; otherwise the present tensions are kept.
    # with_wrench: True if a wrench is given; otherwise the present wrench is kept.
    # end: End of the period [s].
    time, value, begins, ends = course
    asked, expected, wrench = given
    m = lengths.shape[1]
    for i in range(m):
        if not least[i] < asked[i] <= LARGEST:
            return False
    for i in range(expected.shape[0]):
        if with_tension and not abs(expected[i]) <= LARGEST:
            return False
    for k in range(6):
        if with_wrench and not abs(wrench[k]) <= LARGEST:
            return False
    time[0], time[1] = time[1], end
    whole = time[1] - time[0]
    for i in range(m):
        lengths[0, i], lengths[1, i] = lengths[1, i], asked[i]
        value[0, i], value[1, i] = value[1, i], asked[i] * stretch[i]
        begins[0, i] = (lengths[1, i] - lengths[0, i]) / whole * stretch[i]
        ends[0, i] = begins[0, i]
    for i in range(expected.shape[0]):
        column = m + i
        value[0, column] = value[1, column]
        if with_tension:
            value[1, column] = expected[i]
        begins[0, column] = (value[1, column] - value[0, column]) / whole
        ends[0, column] = begins[0, column]
    at[LENGTH_AT], at[RENEWED], at[NOTES] = 0, 1, 0
    if with_wrench:
        for k in range(6):
            if load[k] != wrench[k]:
                at[RENEWED] = 2
            load[k] = wrench[k]
    return True


@entry
def read_cells(tension: Array, cells: Array, noise: Array, reading: Array) -> None:
    """Fill the readings of load cells, (m,): tensions with gain, bias and noise, clipped to the range of each cell."""
    # tension: Filtered tensions [N], (m,).
    # cells: Gain, bias, standard deviation and range, (4, m).
    # noise: Noise of standard deviation 1, (m,).
    # reading: Filled.
    for i in range(tension.shape[0]):
        reading[i] = min(cells[0, i] * tension[i] + cells[1, i] + cells[2, i] * noise[i], cells[3, i])


@entry
def read_encoders(
    drums: tuple[Array, Array], wound: Array, stretch: Array, zero: Array, rate: Array, room: Array, counts: Array
) -> None:
    """Fill the whole counts of encoders, (m,)."""
    # drums: Table and starts of layers, as in `turns_of_lengths`.
    # wound: Lengths off the drums [m], (m,).
    # stretch: Factors from lengths off the drums to lengths along the path of winding, (m,).
    # zero: Counts at zero turns, (m,).
    # rate: Counts per turn paid out, (m,).
    # room: Work array, (3, 1, m).
    # counts: Filled.
    path, turns, travel = room[0], room[1], room[2]
    for i in range(wound.shape[0]):
        path[0, i] = wound[i] * stretch[i]
    turns_of_lengths(drums[0], drums[1], path, turns, travel)
    for i in range(wound.shape[0]):
        counts[i] = round(zero[i] - turns[0, i] * rate[i])

"""Tasks before and after the steps of a control period: set points and sensor readings."""

from __future__ import annotations

from sagline.core.arrays import LARGEST, Array, Indices
from sagline.kernels.cable.drum import turns_of_lengths
from sagline.kernels.dynamics.progress import LENGTH_AT, NOTES, RENEWED
from sagline.kernels.jit import entry


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
    """Extend the time table linearly to new set points. If a set point is invalid, change nothing and return False.

    Args:
        given: Unstrained lengths (m,); for drums also expected tensions (m,); wrench (6,).
        least: Lower bounds of the lengths, (m,).
        stretch: Factors from unstrained lengths to lengths of the time table, (m,).
        lengths: Unstrained lengths at the end of the last period and at the end of this period, (2, m).
        course: The time table, see `Course`, with two instants.
        load: Wrench on the platform, (6,).
        at: Counters of the run, see `progress`.
        with_tension: True if tensions are given; otherwise the present tensions are kept.
        with_wrench: True if a wrench is given; otherwise the present wrench is kept.
        end: End of the period [s].
    """
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
    if with_wrench:
        for k in range(6):
            load[k] = wrench[k]
    at[LENGTH_AT], at[RENEWED], at[NOTES] = 0, 1, 0
    return True


@entry
def read_cells(tension: Array, cells: Array, noise: Array, reading: Array) -> None:
    """Fill the readings of load cells, (m,): tensions with gain, bias and noise, limited to the range of the cells.

    Args:
        tension: Filtered tensions [N], (m,).
        cells: Gain, bias, standard deviation and range, (4, m).
        noise: Noise of standard deviation 1, (m,).
        reading: Filled.
    """
    for i in range(tension.shape[0]):
        reading[i] = min(cells[0, i] * tension[i] + cells[1, i] + cells[2, i] * noise[i], cells[3, i])


@entry
def read_encoders(
    drums: tuple[Array, Array], wound: Array, stretch: Array, zero: Array, rate: Array, room: Array, counts: Array
) -> None:
    """Fill the whole counts of encoders, (m,).

    Args:
        drums: Table and starts of layers, as in `turns_of_lengths`.
        wound: Lengths off the drums [m], (m,).
        stretch: Factors from lengths off the drums to lengths along the path of winding, (m,).
        zero: Counts at zero turns, (m,).
        rate: Counts per turn paid out, (m,).
        room: Work array, (3, 1, m).
        counts: Filled.
    """
    path, turns, travel = room[0], room[1], room[2]
    for i in range(wound.shape[0]):
        path[0, i] = wound[i] * stretch[i]
    turns_of_lengths(drums[0], drums[1], path, turns, travel)
    for i in range(wound.shape[0]):
        counts[i] = round(zero[i] - turns[0, i] * rate[i])

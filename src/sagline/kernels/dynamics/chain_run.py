"""A run of a platform on chains: all that its steps work on, and what it is given in time."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import Drives, keep_set_points
from sagline.kernels.dynamics.progress import LENGTH_AT, WIND_AT, WRENCH_AT
from sagline.kernels.dynamics.tables_in_time import TimeTable, TimeTableArrays, interpolate_table
from sagline.kernels.jit import glue, kernel

ROOM = 21

Numbers = tuple[float, float, float]  # step [s], gravity [m/s^2], share of a new reading in a load cell's filtered one
Rules = tuple[int, int, int]  # kind of winches, remembered, loops' stride
Body = tuple[Array, Array, Array, Array]  # cables, inertia, what of a wrench moves the body, where the given one acts
Courses = tuple[TimeTableArrays, TimeTableArrays, TimeTableArrays]  # of lengths, wrenches, the wind
Kept = tuple[Array, Array, Array, Array, Array, Indices, Array]  # state, rows, drives' now, layers, audit, counters
ChainArrays = tuple[Array, Array, Array, Array, Indices]
Records = tuple[Array, Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes, points


class _Chains(NamedTuple):
    """The chains of m cables, with room for P nodes each.

    Attributes:
        table: What they are, (m, CHAIN_COLUMNS).
        place: Of the nodes [m], (m, 3, P).
        speed: Of the nodes [m/s], (m, 3, P).
        pulls: Forces by length of the elements [N/m], (m, P).
        counts: Free nodes, (m,).
    """

    table: Array
    place: Array
    speed: Array
    pulls: Array
    counts: Indices


class ChainRun(NamedTuple):
    """State and arrays of a run, as in `chains.run_chains`."""

    chains: _Chains
    step: float
    gravity: float
    cables: Array
    inertia: Array
    free: Array
    handle: Array
    drives: Drives
    lengths: TimeTable
    wrenches: TimeTable
    winds: TimeTable
    state: Array
    rows: Array
    at: Indices
    targets: Array
    target_rates: Array
    force: Array
    given: Array
    wind: Array
    spare: Array


@glue
def chain_run_of(
    rules: Rules, numbers: Numbers, body: Body, data: Array, courses: Courses, kept: Kept, chain_arrays: ChainArrays
) -> ChainRun:
    """State and arrays of a run from the arguments of `chains.run_chains`."""
    kind, remembered, _stride = rules
    step, gravity, _filtering = numbers
    state, rows, now, layers, audit, at, room = kept
    wide = courses[0][1].shape[1]
    return ChainRun(
        _Chains(*chain_arrays),
        step,
        gravity,
        body[0],
        body[1],
        body[2],
        body[3],
        Drives(kind, remembered > 0, data, now, layers, audit),
        TimeTable(*courses[0]),
        TimeTable(*courses[1]),
        TimeTable(*courses[2]),
        state,
        rows,
        at,
        room[ROOM : ROOM + wide],
        room[ROOM + wide : ROOM + 2 * wide],
        room[0:6],
        room[6:12],
        room[12:15],
        room[15:21],
    )


@glue
def _fill_last_elements(run: ChainRun) -> None:
    """Fill what is left of every length for the element at the frame, and the rates."""
    for i in range(run.chains.counts.shape[0]):
        row = run.chains.table[i]
        row[c.REST] = run.rows[t.LENGTH, i] - row[c.BEHIND] - run.chains.counts[i] * row[c.ELEMENT]
        row[c.RATE] = run.drives.now[d.RATE, i]


@kernel
def follow_time_tables(run: ChainRun, now: float, shift: float) -> None:
    """Fill what is asked of the winches at a time, and what is given of wrench and wind."""
    at = run.at
    at[LENGTH_AT] = interpolate_table(run.lengths, at[LENGTH_AT], now, shift, run.targets, run.target_rates)
    at[WRENCH_AT] = interpolate_table(run.wrenches, at[WRENCH_AT], now, 0.0, run.given, run.spare)
    at[WIND_AT] = interpolate_table(run.winds, at[WIND_AT], now, 0.0, run.wind, run.spare)
    keep_set_points(run.drives, run.rows, run.targets, run.target_rates)
    _fill_last_elements(run)

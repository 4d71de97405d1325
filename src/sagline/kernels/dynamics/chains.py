"""The platform on cables with mass, in time: chains in the place of exact catenaries, one force a step.

The symplectic splitting of `sagline.kernels.dynamics.splitting`, with the chains' nodes in its kicks and drifts;
winches, courses and audit are the same. docs/model.md, section 11.
"""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.chain_forces import fill_platform_force, kick_chains, power_of_given_wrench
from sagline.kernels.dynamics.chain_records import change_node_count, record_chain_step
from sagline.kernels.dynamics.chain_run import (
    Body,
    ChainArrays,
    ChainRun,
    Courses,
    Kept,
    Numbers,
    Records,
    Rules,
    chain_run_of,
    follow_time_tables,
)
from sagline.kernels.dynamics.drives import (
    add_winch_energy,
    close_loops,
    filter_tensions,
    kick_winches,
    store_step_start,
    turn_winches,
)
from sagline.kernels.dynamics.progress import FAILED, LENGTH_AT, READY, STEPS, has_room, note_events
from sagline.kernels.dynamics.rigid_body import drift_body, free_turn, kick_body
from sagline.kernels.dynamics.tables_in_time import MOMENT, interval_ends
from sagline.kernels.jit import entry, glue


@glue
def _split_step(run: ChainRun, now: float) -> None:
    """One step from a time on; forces at hand before and after are those of the state."""
    h, half, drives, rows, chains = run.step, 0.5 * run.step, run.drives, run.rows, run.chains
    drives.audit[d.SUPPLIED] += half * power_of_given_wrench(run)
    kick_body(run.state, run.inertia, run.force, half)
    kick_chains(run, half, True)
    kick_winches(drives, rows, run.targets, half, True)
    store_step_start(drives, rows)
    drift_body(run.state, h)
    free_turn(run.state, run.inertia, h)
    turn_winches(drives, run.cables, rows, run.gravity, h)
    follow_time_tables(run, now + h, -MOMENT * h)
    for i in range(rows.shape[1]):
        row = chains.table[i]
        before = row[c.REST] + (drives.now[d.BEFORE, i] - rows[t.LENGTH, i])
        c.drift_nodes(chains.place[i], chains.speed[i], chains.counts[i], row, before, h)
    drives.audit[d.LOST] += h * fill_platform_force(run)
    add_winch_energy(drives, run.cables, rows, h)
    kick_body(run.state, run.inertia, run.force, half)
    kick_chains(run, half, False)
    kick_winches(drives, rows, run.targets, half, False)
    drives.audit[d.SUPPLIED] += half * power_of_given_wrench(run)


@glue
def _change_node_counts(run: ChainRun) -> None:
    """Give chains one node more or less whose element at the frame has become too long or too short."""
    for i in range(run.chains.counts.shape[0]):
        rest, element = run.chains.table[i, c.REST], run.chains.table[i, c.ELEMENT]
        if not c.LEAST * element < rest < c.MOST * element:
            change_node_count(run, i)


@entry
def run_chains(
    rules: Rules,
    numbers: Numbers,
    body: Body,
    data: Array,
    courses: Courses,
    kept: Kept,
    chain_arrays: ChainArrays,
    stock: Array,
    records: Records,
    steps: int,
    every: int,
) -> None:
    """Go on for some steps; a run that is ready goes on where the last call ended, bit by bit the same.

    Args:
        rules: See `Rules`; the loops of drums are closed every so many steps.
        numbers: See `Numbers`.
        body: Rows of the cable_table, anchors in the platform's principal axes from its center of mass, which holds
            what it carries of the chains; inertia; a projection (6, 6) onto its free motions; and in these axes the
            place that the given wrench is about, (3,).
        data: Of the drives, (DATA_ROWS, m).
        courses: Of lengths, of wrenches and of the wind's velocity, as in `motion.run`.
        kept: As there, with one counter more, and ROOM numbers to work in, with
            two for every number of the course of lengths.
        chain_arrays: `Chains`, in and out.
        stock: Energies of the start that could become motion, (2,), in and out; NaN at first.
        records: Filled as in `motion.run`; and points of the cables (R, m, points, 3) at equal material steps from the
            exit on.
        steps: How many steps to take, fewer where there is no room left for the notes of another. With 0 the state at
            hand is recorded.
        every: After how many steps one is recorded, the start first.
    """
    kind, _remembered, stride = rules
    step, gravity, filtering = numbers
    run = chain_run_of(rules, numbers, body, data, courses, kept, chain_arrays)
    drives, rows, at, audit = run.drives, run.rows, run.at, kept[4]
    if at[READY] == 0:
        at[READY] = 1
        begin = audit[d.BEGIN] + at[STEPS] * step
        follow_time_tables(run, begin, MOMENT * step)
        fill_platform_force(run)
        note_events(drives, rows, run.cables, at, begin, gravity, records[4])
        record_chain_step(run, records, stock)
    elif steps == 0:
        record_chain_step(run, records, stock)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[STEPS] * step
        if interval_ends(run.lengths, at[LENGTH_AT], time + MOMENT * step):
            follow_time_tables(run, time, MOMENT * step)  # rates may jump here
            fill_platform_force(run)
        if kind == d.DRUMS and at[STEPS] % stride == 0:
            close_loops(drives, run.targets, run.target_rates, stride * step)
        _split_step(run, time)
        at[STEPS] += 1
        filter_tensions(drives, filtering)
        _change_node_counts(run)
        note_events(drives, rows, run.cables, at, audit[d.BEGIN] + at[STEPS] * step, gravity, records[4])
        if at[STEPS] % every == 0:
            record_chain_step(run, records, stock)
        if at[FAILED] > 0 or not has_room(at, records[4], rows.shape[1]):
            break

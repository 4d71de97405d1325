"""Motion of the platform on cables with mass, modeled as chains; the forces are evaluated once per step.

The integrator is the symplectic splitting of `sagline.kernels.dynamics.motion`. Its kicks and drifts also move the
nodes of the chains. Winches, time tables and audit are as in that module. docs/model.md, section 11.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import progress
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
    fill_platform_force,
    follow_time_tables,
    kick_chains,
    power_of_given_wrench,
)
from sagline.kernels.dynamics.drives import (
    add_winch_energy,
    close_loops,
    filter_tensions,
    kick_winches,
    store_step_start,
    turn_winches,
)
from sagline.kernels.dynamics.rigid_body import (
    CENTER,
    MASS,
    MOMENTUM,
    drift_body,
    free_turn,
    kick_body,
    kinetic_energy,
    spin,
)
from sagline.kernels.jit import entry, glue, kernel

ENDED = progress.COUNTERS  # additional counter of cables with mass; FAILED: index of the cable that ended the run
DONE, LONG, SHORT, GROWN = range(4)
FEWEST = 2  # smallest number of free nodes of a chain
# largest energy error, relative to the energy that can become motion; phase errors cause smaller energy errors
GROWTH = 0.5


@glue
def _energy_of(run: ChainRun, i: int) -> tuple[float, float]:
    """Energy of chain `i` with its half element at the exit, and energy of this half element [J]."""
    chains, n, row = run.chains, run.chains.counts[i], run.chains.table[i]
    strain, raised = c.potential(chains.place[i], n, row)
    entering = c.kinetic_at_exit(chains.speed[i], n, row)
    return strain + raised + c.kinetic(chains.speed[i], n, row) + entering, entering


@kernel
def change_node_count(run: ChainRun, i: int) -> None:
    """Add or remove one node of chain `i` at the frame, and add the energy change to the audit."""
    chains, audit = run.chains, run.drives.audit
    row, place, speed, n = chains.table[i], chains.place[i], chains.speed[i], chains.counts[i]
    more = 1 if row[c.REST] > row[c.ELEMENT] else -1
    if n + more < FEWEST or n + more + 2 > place.shape[1]:
        run.at[progress.FAILED], run.at[ENDED] = i + 1, (SHORT if more < 0 else LONG)
        return
    before, entering_before = _energy_of(run, i)
    if more > 0:
        c.insert_node(place, speed, n, row)
    else:
        c.merge_nodes(place, speed, n, row)
    chains.counts[i] = n + more
    row[c.REST] -= more * row[c.ELEMENT]
    after, entering = _energy_of(run, i)
    audit[d.LOST] += before - after
    audit[d.SUPPLIED] -= entering - entering_before  # the winch supplies the energy of the half element at the exit
    c.fill_element_forces(place, speed, n + more, row, chains.pulls[i])
    run.drives.now[d.WHOLE, i] = c.whole_force(place, speed, n + more, row, chains.pulls[i])


@kernel
def _sample_points(place: Array, count: int, row: Array, points: Array) -> None:
    """Fill points (points, 3) of a chain at equal material steps, starting at the exit point."""
    element, rest = row[c.ELEMENT], row[c.REST]
    length = rest + count * element
    for p in range(points.shape[0]):
        way = length * p / (points.shape[0] - 1) - rest  # length from the node next to the frame
        passed = int(min(max(way / element, 0.0), count - 1.0)) if way > 0.0 else -1
        share = way / element - passed if way > 0.0 else 1.0 + way / rest
        for k in range(3):
            start = place[k, count - passed]
            points[p, k] = start + share * (place[k, count - passed - 1] - start)


@kernel
def record_chain_step(run: ChainRun, records: Records, stock: Array) -> None:
    """Record a step, and check that the energy does not increase by more than the supplied energy."""
    states, tensions, lengths, energies, _notes, points = records
    state, drives, chains, at, r = run.state, run.drives, run.chains, run.at, run.at[progress.RECORDS]
    audit = drives.audit
    kinetic, strain = kinetic_energy(state, run.inertia), 0.0
    raised = run.inertia[MASS] * run.gravity * state[CENTER + 2]
    size, wildest, blamed = abs(raised), -1.0, 0
    for i in range(chains.counts.shape[0]):
        n, row = chains.counts[i], chains.table[i]
        stretched, height = c.potential(chains.place[i], n, row)
        swinging = c.kinetic(chains.speed[i], n, row)
        kinetic, strain, size = kinetic + swinging, strain + stretched, size + abs(height)
        raised += height - 0.5 * row[c.DENSITY] * row[c.ELEMENT] * run.gravity * row[c.EXIT_Z]
        if not swinging <= wildest:
            wildest, blamed = swinging, i
        if drives.kind == d.DRUMS:
            kinetic += 0.5 * drives.data[d.INERTIA, i] * drives.now[d.SPEED, i] * drives.now[d.SPEED, i]
    potential = strain + raised + audit[d.ON_DRUMS]
    if at[progress.READY] < 2:
        at[progress.READY] = 2
        audit[d.START] = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST]
    if math.isnan(stock[0]):
        stock[0], stock[1] = kinetic + strain, raised
    invented = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST] - audit[d.START]
    convertible = stock[0] + max(stock[1] - raised, 0.0) + abs(audit[d.SUPPLIED])
    if not invented <= GROWTH * convertible + progress.ROUNDING * size:
        at[progress.FAILED], at[ENDED] = blamed + 1, GROWN
    if r < states.shape[0]:
        turning = spin(state, run.inertia)
        for k in range(MOMENTUM):
            states[r, k] = state[k]
        for k in range(3):
            states[r, MOMENTUM + k] = turning[k]
        energies[r, progress.KINETIC], energies[r, progress.POTENTIAL] = kinetic, potential
        energies[r, progress.SUPPLIED], energies[r, progress.LOST] = audit[d.SUPPLIED], audit[d.LOST]
        for i in range(chains.counts.shape[0]):
            tensions[r, i], lengths[r, i] = drives.now[d.AT_FRAME, i], run.rows[g.LENGTH, i]
            _sample_points(chains.place[i], chains.counts[i], chains.table[i], points[r, i])
        at[progress.RECORDS] += 1


@glue
def _split_step(run: ChainRun, now: float) -> None:
    """One step that starts at `now`. The stored forces belong to the state before the step, then to the new state."""
    h, half, drives, rows, chains = run.step, 0.5 * run.step, run.drives, run.rows, run.chains
    drives.audit[d.SUPPLIED] += half * power_of_given_wrench(run)
    kick_body(run.state, run.inertia, run.force, half)
    kick_chains(run, half, True)
    kick_winches(drives, rows, run.targets, half, True)
    store_step_start(drives, rows)
    drift_body(run.state, h)
    free_turn(run.state, run.inertia, h)
    turn_winches(drives, run.cables, rows, run.gravity, h)
    follow_time_tables(run, now + h, -progress.MOMENT * h)
    for i in range(rows.shape[1]):
        row = chains.table[i]
        before = row[c.REST] + (drives.now[d.BEFORE, i] - rows[g.LENGTH, i])
        c.drift_nodes(chains.place[i], chains.speed[i], chains.counts[i], row, before, h)
    drives.audit[d.LOST] += h * fill_platform_force(run)
    add_winch_energy(drives, run.cables, rows, h)
    kick_body(run.state, run.inertia, run.force, half)
    kick_chains(run, half, False)
    kick_winches(drives, rows, run.targets, half, False)
    drives.audit[d.SUPPLIED] += half * power_of_given_wrench(run)


@glue
def _change_node_counts(run: ChainRun) -> None:
    """Add or remove a node of each chain whose element at the frame is too long or too short."""
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
    """Integrate `steps` steps. Several calls give bitwise the same result as one call with all steps.

    Args:
        rules: See `Rules`; `stride` is the number of steps per control period of drums.
        numbers: See `Numbers`.
        body: Rows of the cable_table, with platform anchors in principal axes relative to the center of mass (including
            the mass of the chains at node 0); row of inertia; projection (6, 6) onto the free motions; and reference
            point of the given wrench in these axes, (3,).
        data: Data of the drives, (DATA_ROWS, m).
        courses: Time tables of lengths, wrenches and wind velocity; see `motion.run_massless`.
        kept: Same as in `motion.run_massless`, but with one more counter. The length of the work array is ROOM plus two
            times the number of columns of the table of lengths.
        chain_arrays: `Chains`, with the state before the steps; overwritten with the state after them.
        stock: Initial energies that can become motion, (2,); NaN before the first call, which fills them.
        records: Filled as in `motion.run_massless`; also filled with points of the cables (R, m, points, 3) at equal
            material steps, starting at the exit point.
        steps: Largest number of steps. The run ends earlier if the records are full. With 0, only the present state is
            recorded.
        every: Number of steps between records; the first record is the initial state.
    """
    kind, _remembered, stride = rules
    step, gravity, filtering = numbers
    run = chain_run_of(rules, numbers, body, data, courses, kept, chain_arrays)
    drives, rows, at, audit = run.drives, run.rows, run.at, kept[4]
    if at[progress.READY] == 0:
        at[progress.READY] = 1
        begin = audit[d.BEGIN] + at[progress.STEPS] * step
        follow_time_tables(run, begin, progress.MOMENT * step)
        fill_platform_force(run)
        progress.note_events(drives, rows, run.cables, at, begin, gravity, records[4])
        record_chain_step(run, records, stock)
    elif steps == 0:
        record_chain_step(run, records, stock)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[progress.STEPS] * step
        if progress.interval_ends(run.lengths, at[progress.LENGTH_AT], time + progress.MOMENT * step):
            follow_time_tables(run, time, progress.MOMENT * step)  # rates may jump here
            fill_platform_force(run)
        if kind == d.DRUMS and at[progress.STEPS] % stride == 0:
            close_loops(drives, run.targets, run.target_rates, stride * step)
        _split_step(run, time)
        at[progress.STEPS] += 1
        filter_tensions(drives, filtering)
        _change_node_counts(run)
        progress.note_events(
            drives, rows, run.cables, at, audit[d.BEGIN] + at[progress.STEPS] * step, gravity, records[4]
        )
        if at[progress.STEPS] % every == 0:
            record_chain_step(run, records, stock)
        if at[progress.FAILED] > 0 or not progress.has_room(at, records[4], rows.shape[1]):
            break

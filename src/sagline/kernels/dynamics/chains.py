"""Motion of the platform on cables with mass, modeled as chains; the forces are evaluated once per step.

The integrator is the symplectic splitting of `sagline.kernels.dynamics.motion`. Kicks and drifts also move the nodes of
the chains. Winches, time tables and energy audit are the same as in `motion`. docs/model.md, section 11.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.factors import copy
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import progress, rigid_body
from sagline.kernels.dynamics.progress import Courses, Kept
from sagline.kernels.jit import entry, glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import turned

ROOM = 21

Numbers = tuple[float, float, float]  # step [s], gravity [m/s^2], weight of a new reading in a load cell's filter
Rules = tuple[int, int, int]  # kind of winches, remembered, steps per control period
Body = tuple[Array, Array, Array, Array]  # cables, inertia, projection onto free motions, point of the given wrench
ChainArrays = tuple[Array, Array, Array, Array, Indices]
Records = tuple[Array, Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes, points


class _ChainRun(NamedTuple):
    """State and arrays of a run with m cables or pieces of broken cables, and with memory for P nodes each."""

    table: Array  # parameters of the chains, (m, CHAIN_COLUMNS)
    place: Array  # positions of the nodes [m], (m, 3, P)
    speed: Array  # velocities of the nodes [m/s], (m, 3, P)
    pulls: Array  # element forces divided by element lengths [N/m], and work, (m, 4 P)
    counts: Indices  # numbers of free nodes, (m,)
    step: float
    gravity: float
    cables: Array
    inertia: Array
    free: Array
    handle: Array
    drives: d.Drives
    lengths: progress.CubicTable
    wrenches: progress.CubicTable
    winds: progress.CubicTable
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
def _chain_run_of(
    rules: Rules, numbers: Numbers, body: Body, data: Array, courses: Courses, kept: Kept, chain_arrays: ChainArrays
) -> _ChainRun:
    """State and arrays of a run from the arguments of `chains.run_chains`."""
    kind, remembered, _stride = rules
    step, gravity, _filtering = numbers
    state, rows, now, layers, audit, at, room = kept
    width = courses[0][1].shape[1]
    memory = Memory(room, at)
    small, memory = block(memory, 3, 6)
    wind, memory = vector(memory, 3)
    targets, memory = vector(memory, width)
    target_rates, memory = vector(memory, width)
    lengths, wrenches, winds, _anchors = progress.time_tables(courses)
    drives = d.Drives(kind, remembered > 0, data, now, layers, audit)
    table, place, speed, pulls, counts = chain_arrays
    return _ChainRun(
        table, place, speed, pulls, counts, step, gravity, body[0], body[1], body[2], body[3],
        drives, lengths, wrenches, winds, state, rows, at, targets, target_rates, small[0], small[1], wind, small[2],
    )  # fmt: skip


@glue
def _fill_last_elements(run: _ChainRun) -> None:
    """Fill the remaining length of the element at the frame, and its rate, for every cable."""
    for i in range(run.counts.shape[0]):
        row = run.table[i]
        if row[c.FREE_END] > 0.0:
            continue
        row[c.REST] = run.rows[g.LENGTH, i] - row[c.BEHIND] - run.counts[i] * row[c.ELEMENT]
        row[c.RATE] = run.drives.now[d.RATE, i]


@kernel
def _follow_time_tables(run: _ChainRun, now: float, shift: float) -> None:
    """Fill the set points of the winches, and the given wrench and wind, at the time `now`."""
    at = run.at
    at[progress.LENGTH_AT] = progress.interpolate_table(
        run.lengths, at[progress.LENGTH_AT], now, shift, run.targets, run.target_rates
    )
    at[progress.WRENCH_AT] = progress.interpolate_table(
        run.wrenches, at[progress.WRENCH_AT], now, 0.0, run.given, run.spare
    )
    at[progress.WIND_AT] = progress.interpolate_table(run.winds, at[progress.WIND_AT], now, 0.0, run.wind, run.spare)
    d.keep_set_points(run.drives, run.rows, run.targets, run.target_rates)
    _fill_last_elements(run)


@glue
def _fill_frame_tensions(run: _ChainRun, i: int) -> None:
    """Fill the tensions of chain `i` at its frame end; they are zero if this end is free."""
    now, n, row = run.drives.now, run.counts[i], run.table[i]
    tension, whole, lifted = 0.0, 0.0, 0.0
    if row[c.FREE_END] == 0.0:
        tension = c.tension_at_exit(run.place[i], n, row, run.pulls[i])
        whole = c.whole_force(run.place[i], run.speed[i], n, row, run.pulls[i])
        lifted = row[c.DENSITY] * run.gravity * run.drives.data[d.BEHIND_RISE, i]
    now[d.AT_FRAME, i], now[d.WHOLE, i] = tension, whole
    now[d.AT_DRUM, i] = d.tension_at_drum(whole, lifted, row[c.STIFFNESS])
    mean, share = c.mean_tension(run.pulls[i], n, row), row[c.SMOOTH] if run.at[progress.READY] == 2 else 1.0
    run.rows[g.TENSION, i] = share * mean + (1.0 - share) * (run.rows[g.TENSION, i] if share < 1.0 else 0.0)


@kernel
def _fill_platform_force(run: _ChainRun) -> float:
    """Fill the force on the platform and the tensions at the winches. Returns the power lost [W]."""
    state = run.state
    ends = run.cables[:, tables.PLATFORM_X : tables.PLATFORM_Z + 1]
    center, velocity = state[rigid_body.CENTER :], state[rigid_body.VELOCITY :]
    lost = 0.0
    wx, wy, wz = rigid_body.spin(state, run.inertia)
    hx, hy, hz = turned(state, run.handle[0], run.handle[1], run.handle[2])
    gx, gy, gz = run.given[0], run.given[1], run.given[2]
    fx, fy, fz = gx, gy, gz - run.inertia[rigid_body.MASS] * run.gravity
    mx, my, mz = run.given[3] + hy * gz - hz * gy, run.given[4] + hz * gx - hx * gz, run.given[5] + hx * gy - hy * gx
    for i in range(run.counts.shape[0]):
        n, row, place, speed = run.counts[i], run.table[i], run.place[i], run.speed[i]
        x, y, z = turned(state, ends[i, 0], ends[i, 1], ends[i, 2])
        if row[c.FREE_START] == 0.0:
            place[0, 0], place[1, 0], place[2, 0] = center[0] + x, center[1] + y, center[2] + z
            speed[0, 0] = velocity[0] + (wy * z - wz * y)
            speed[1, 0] = velocity[1] + (wz * x - wx * z)
            speed[2, 0] = velocity[2] + (wx * y - wy * x)
        c.fill_frame_node_velocity(place, speed, n, row)
        lost += c.fill_element_forces(place, speed, n, row, run.pulls[i])
        _fill_frame_tensions(run, i)
        if row[c.FREE_START] > 0.0:
            continue
        air = 0.5 * row[c.DENSITY] * row[c.ELEMENT] * row[c.AIR_RATE]
        px = run.pulls[i, 0] * (place[0, 1] - place[0, 0]) - air * speed[0, 0]
        py = run.pulls[i, 0] * (place[1, 1] - place[1, 0]) - air * speed[1, 0]
        pz = run.pulls[i, 0] * (place[2, 1] - place[2, 0]) - air * speed[2, 0]
        lost += air * (speed[0, 0] ** 2 + speed[1, 0] ** 2 + speed[2, 0] ** 2)
        if run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0:
            bx, by, bz = c.wind_on_element(place, 0, 1, 0.5 * row[c.ELEMENT] * row[c.WIND], run.wind)
            px, py, pz = px + bx, py + by, pz + bz
            lost -= bx * speed[0, 0] + by * speed[1, 0] + bz * speed[2, 0]
        fx, fy, fz = fx + px, fy + py, fz + pz
        mx, my, mz = mx + (y * pz - z * py), my + (z * px - x * pz), mz + (x * py - y * px)
    for k in range(6):
        free = run.free[k]
        run.force[k] = free[0] * fx + free[1] * fy + free[2] * fz + free[3] * mx + free[4] * my + free[5] * mz
    return lost


@glue
def _power_of_given_wrench(run: _ChainRun) -> float:
    """Power of the given wrench at the present velocities [W]."""
    wx, wy, wz = rigid_body.spin(run.state, run.inertia)
    hx, hy, hz = turned(run.state, run.handle[0], run.handle[1], run.handle[2])
    there = run.state[rigid_body.VELOCITY] + (wy * hz - wz * hy)
    beside = run.state[rigid_body.VELOCITY + 1] + (wz * hx - wx * hz)
    above = run.state[rigid_body.VELOCITY + 2] + (wx * hy - wy * hx)
    turning = run.given[3] * wx + run.given[4] * wy + run.given[5] * wz
    return run.given[0] * there + run.given[1] * beside + run.given[2] * above + turning


@kernel
def _kick_chains(run: _ChainRun, h: float, begins: bool) -> None:
    """Update the nodes' velocities by forces, air and wind during `h`. At the start of a step, forces come last."""
    audit = run.drives.audit
    blows = run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0
    for i in range(run.counts.shape[0]):
        n, row, place, speed = run.counts[i], run.table[i], run.place[i], run.speed[i]
        if not begins:
            c.kick_nodes(place, speed, n, row, run.pulls[i], h)
        audit[d.LOST] += c.slow_by_air(speed, n, row, h)
        if blows:
            audit[d.SUPPLIED] += c.add_wind_on_nodes(place, speed, n, row, run.wind, h)
        if begins:
            c.kick_nodes(place, speed, n, row, run.pulls[i], h)


ENDED = progress.COUNTERS  # additional counter for cables with mass: index of the cable that ended the run
DONE, LONG, SHORT, GROWN = range(4)
FEWEST = 2  # smallest number of free nodes of a chain
# largest energy error, relative to the energy that can be converted to motion; errors of the phase alone cause smaller
# energy errors
GROWTH = 0.5


@glue
def _energy_of(run: _ChainRun, i: int) -> tuple[float, float]:
    """Energy of chain `i` with its half element at the exit, and energy of this half element [J]."""
    n, row = run.counts[i], run.table[i]
    strain, raised = c.potential(run.place[i], n, row)
    entering = c.kinetic_at_exit(run.speed[i], n, row)
    return strain + raised + c.kinetic(run.speed[i], n, row) + entering, entering


@kernel
def _change_node_count(run: _ChainRun, i: int) -> None:
    """Add or remove one node of chain `i` at the frame, and add the change of energy to the energy audit."""
    audit = run.drives.audit
    row, place, speed, n = run.table[i], run.place[i], run.speed[i], run.counts[i]
    more = 1 if row[c.REST] > row[c.ELEMENT] else -1
    if n + more < FEWEST or n + more + 2 > place.shape[1]:
        run.at[progress.FAILED], run.at[ENDED] = i + 1, (SHORT if more < 0 else LONG)
        return
    before, entering_before = _energy_of(run, i)
    if more > 0:
        c.insert_node(place, speed, n, row)
    else:
        c.merge_nodes(place, speed, n, row)
    run.counts[i] = n + more
    row[c.REST] -= more * row[c.ELEMENT]
    after, entering = _energy_of(run, i)
    audit[d.LOST] += before - after
    audit[d.SUPPLIED] -= entering - entering_before  # the winch supplies the energy of the half element at the exit
    c.fill_element_forces(place, speed, n + more, row, run.pulls[i])
    run.drives.now[d.WHOLE, i] = c.whole_force(place, speed, n + more, row, run.pulls[i])


@kernel
def _sample_points(place: Array, count: int, row: Array, points: Array) -> None:
    """Fill the points of a chain in `points` (points, 3) of its cable, at equal steps, starting at the frame end."""
    element, rest, first, number = row[c.ELEMENT], row[c.REST], int(row[c.FIRST]), int(row[c.POINTS])
    length = rest + count * element
    for p in range(number):
        way = length * p / (number - 1) - rest  # length from the node next to the frame
        passed = int(min(max(way / element, 0.0), count - 1.0)) if way > 0.0 else -1
        share = way / element - passed if way > 0.0 else 1.0 + way / rest
        for k in range(3):
            start = place[k, count - passed]
            points[first + p, k] = start + share * (place[k, count - passed - 1] - start)


@kernel
def _record_chain_step(run: _ChainRun, records: Records, stock: Array) -> None:
    """Record a step, and check that the energy does not increase by more than the supplied energy."""
    states, tensions, lengths, energies, _notes, points = records
    state, drives, at, r = run.state, run.drives, run.at, run.at[progress.RECORDS]
    audit = drives.audit
    kinetic, strain = rigid_body.kinetic_energy(state, run.inertia), 0.0
    raised = run.inertia[rigid_body.MASS] * run.gravity * state[rigid_body.CENTER + 2]
    size, wildest, blamed = abs(raised), -1.0, 0
    for i in range(run.counts.shape[0]):
        n, row = run.counts[i], run.table[i]
        stretched, height = c.potential(run.place[i], n, row)
        swinging = c.kinetic(run.speed[i], n, row)
        kinetic, strain, size = kinetic + swinging, strain + stretched, size + abs(height)
        raised += height
        if row[c.FREE_START] == 0.0:
            raised -= 0.5 * row[c.DENSITY] * row[c.ELEMENT] * run.gravity * row[c.EXIT_Z]
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
        turning = rigid_body.spin(state, run.inertia)
        copy(state[: rigid_body.MOMENTUM], states[r])
        for k in range(3):
            states[r, rigid_body.MOMENTUM + k] = turning[k]
        energies[r, progress.KINETIC], energies[r, progress.POTENTIAL] = kinetic, potential
        energies[r, progress.SUPPLIED], energies[r, progress.LOST] = audit[d.SUPPLIED], audit[d.LOST]
        for i in range(run.counts.shape[0]):
            tensions[r, i], lengths[r, i] = drives.now[d.AT_FRAME, i], run.rows[g.LENGTH, i]
            _sample_points(run.place[i], run.counts[i], run.table[i], points[r, int(run.table[i, c.CABLE])])
        at[progress.RECORDS] += 1


@glue
def _split_step(run: _ChainRun, now: float) -> None:
    """Take one step from the time `now`. The stored forces belong to the start of the step, afterwards to its end."""
    h, half, drives, rows = run.step, 0.5 * run.step, run.drives, run.rows
    drives.audit[d.SUPPLIED] += half * _power_of_given_wrench(run)
    rigid_body.kick_body(run.state, run.inertia, run.force, half)
    _kick_chains(run, half, True)
    d.kick_winches(drives, rows, run.targets, half, True)
    d.store_step_start(drives, rows)
    rigid_body.drift_body(run.state, h)
    rigid_body.free_turn(run.state, run.inertia, h)
    d.turn_winches(drives, run.cables, rows, run.gravity, h)
    _follow_time_tables(run, now + h, -progress.MOMENT * h)
    for i in range(rows.shape[1]):
        row = run.table[i]
        paid_out = 0.0 if row[c.FREE_END] > 0.0 else rows[g.LENGTH, i] - drives.now[d.BEFORE, i]
        before = row[c.REST] - paid_out
        c.drift_nodes(run.place[i], run.speed[i], run.counts[i], row, before, h)
    drives.audit[d.LOST] += h * _fill_platform_force(run)
    d.add_winch_energy(drives, run.cables, rows, h)
    rigid_body.kick_body(run.state, run.inertia, run.force, half)
    _kick_chains(run, half, False)
    d.kick_winches(drives, rows, run.targets, half, False)
    drives.audit[d.SUPPLIED] += half * _power_of_given_wrench(run)


@glue
def _change_node_counts(run: _ChainRun) -> None:
    """Add or remove a node of each chain whose element at the frame is too long or too short."""
    for i in range(run.counts.shape[0]):
        rest, element = run.table[i, c.REST], run.table[i, c.ELEMENT]
        if run.table[i, c.FREE_END] == 0.0 and not c.LEAST * element < rest < c.MOST * element:
            _change_node_count(run, i)


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
    """Integrate `steps` steps. Several calls give bitwise the same result as one call with all steps."""
    # rules: See `Rules`; `stride` is the number of steps per control period of drums.
    # numbers: See `Numbers`.
    # body: Rows of the cable_table, with platform anchors in principal axes relative to the center of mass (including
    #   the mass of the chains at node 0); row of inertia; projection (6, 6) onto the free motions; and reference point
    #   of the given wrench in these axes, (3,).
    # data: Data of the drives, (DATA_ROWS, m).
    # courses: Time tables of lengths, wrenches and wind velocity; see `motion.run_massless`.
    # kept: Same as in `motion.run_massless`, but with one more counter. The work array has ROOM entries plus two
    #   entries per column of the table of lengths.
    # chain_arrays: `Chains`, with the state before the steps; overwritten with the state after them.
    # stock: Initial energies that can be converted to motion, (2,). NaN before the first call.
    # records: Filled as in `motion.run_massless`; also filled with points of the cables (R, m, points, 3) at equal
    #   material steps, starting at the frame end. Points between the pieces of a broken cable are not filled.
    # steps: Largest number of steps. The run ends earlier if the records are full. With 0, only the present state is
    #   recorded.
    # every: Number of steps between records; the first record is the initial state.
    kind, _remembered, stride = rules
    step, gravity, filtering = numbers
    run = _chain_run_of(rules, numbers, body, data, courses, kept, chain_arrays)
    drives, rows, at, audit = run.drives, run.rows, run.at, kept[4]
    if at[progress.READY] == 0:
        at[progress.READY] = 1
        begin = audit[d.BEGIN] + at[progress.STEPS] * step
        _follow_time_tables(run, begin, progress.MOMENT * step)
        _fill_platform_force(run)
        progress.note_events(drives, rows, run.cables, at, begin, gravity, records[4])
        _record_chain_step(run, records, stock)
    elif steps == 0:
        _record_chain_step(run, records, stock)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[progress.STEPS] * step
        if progress.interval_ends(run.lengths, at[progress.LENGTH_AT], time + progress.MOMENT * step):
            _follow_time_tables(run, time, progress.MOMENT * step)  # the rates may jump at this instant
            _fill_platform_force(run)
        if kind == d.DRUMS and at[progress.STEPS] % stride == 0:
            d.close_loops(drives, run.targets, run.target_rates, stride * step)
        _split_step(run, time)
        at[progress.STEPS] += 1
        d.filter_tensions(drives, filtering)
        _change_node_counts(run)
        progress.note_events(
            drives, rows, run.cables, at, audit[d.BEGIN] + at[progress.STEPS] * step, gravity, records[4]
        )
        if at[progress.STEPS] % every == 0:
            _record_chain_step(run, records, stock)
        if at[progress.FAILED] > 0 or not progress.has_room(at, records[4], rows.shape[1]):
            break

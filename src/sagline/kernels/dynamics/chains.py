"""The platform on cables with mass, in time: chains in the place of exact catenaries, one force a step.

The symplectic splitting of `sagline.kernels.dynamics.motion`, with the chains' nodes in its kicks and drifts; winches,
courses and audit are the same. docs/model.md, section 11.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import Drives, close_loops, kick_drums, kick_lagging, slip, turn_drums
from sagline.kernels.dynamics.motion import (
    COUNTERS,
    FAILED,
    GIVEN,
    KINETIC,
    LENGTH_AT,
    MOMENT,
    NOTES,
    POTENTIAL,
    READY,
    RECORDS,
    STEPS,
    TAKEN,
    WIND_AT,
    WRENCH_AT,
    Kept,
    note,
)
from sagline.kernels.dynamics.rigid_body import (
    CENTER,
    MASS,
    MOMENTUM,
    VELOCITY,
    drift,
    free_turn,
    kick,
    kinetic_energy,
    spin,
)
from sagline.kernels.dynamics.tables_in_time import Course, CourseArrays, follow
from sagline.kernels.forward.platform import turned
from sagline.kernels.jit import entry, glue, kernel

ENDED = COUNTERS  # one counter more than a run without cable mass has: how it ended, FAILED being the cable to blame
DONE, LONG, SHORT, GROWN = range(4)
FEWEST = 2  # free nodes of a chain
GROWTH = 0.5  # of what could have become motion: more than phases that err can invent
ROUNDING = 1e-9  # of the weights' energies
ROOM = 21

Numbers = tuple[float, float, float]  # step [s], gravity [m/s^2], share of a new reading in a load cell's filtered one
Rules = tuple[int, int, int]  # kind of winches, remembered, loops' stride
Body = tuple[Array, Array, Array, Array]  # cables, inertia, what of a wrench moves the body, where the given one acts
ChainArrays = tuple[Array, Array, Array, Array, Indices]
Records = tuple[Array, Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes, points


class Chains(NamedTuple):
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


class Swing(NamedTuple):
    """What a run works on; arrays as in `swing`."""

    chains: Chains
    step: float
    gravity: float
    cables: Array
    inertia: Array
    free: Array
    handle: Array
    drives: Drives
    lengths: Course
    wrenches: Course
    winds: Course
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
def take_lengths(run: Swing) -> None:
    """Fill what is left of every length for the element at the frame, and the rates."""
    for i in range(run.chains.counts.shape[0]):
        row = run.chains.table[i]
        row[c.REST] = run.rows[t.LENGTH, i] - row[c.BEHIND] - run.chains.counts[i] * row[c.ELEMENT]
        row[c.RATE] = run.drives.now[d.RATE, i]


@kernel
def follow_courses(run: Swing, now: float, shift: float) -> None:
    """Fill what is asked of the winches at a time, and what is given of wrench and wind."""
    at, drives = run.at, run.drives
    at[LENGTH_AT] = follow(run.lengths, at[LENGTH_AT], now, shift, run.targets, run.target_rates)
    at[WRENCH_AT] = follow(run.wrenches, at[WRENCH_AT], now, 0.0, run.given, run.spare)
    at[WIND_AT] = follow(run.winds, at[WIND_AT], now, 0.0, run.wind, run.spare)
    if drives.kind == d.IDEAL:
        for i in range(run.rows.shape[1]):
            held = drives.now[d.HELD, i] > 0.0
            drives.now[d.RATE, i] = 0.0 if held else run.target_rates[i]
            if not held:
                run.rows[t.LENGTH, i] = run.targets[i]
    take_lengths(run)


@kernel
def pull_platform(run: Swing) -> float:
    """Fill what moves the platform and what the winches feel; returns the power that elements and air take [W]."""
    chains, drives, state, rows = run.chains, run.drives, run.state, run.rows
    ends = run.cables[:, tables.PLATFORM_X : tables.PLATFORM_Z + 1]
    lost = 0.0
    wx, wy, wz = spin(state, run.inertia)
    hx, hy, hz = turned(state, run.handle[0], run.handle[1], run.handle[2])
    gx, gy, gz = run.given[0], run.given[1], run.given[2]
    fx, fy, fz = gx, gy, gz - run.inertia[MASS] * run.gravity
    mx, my, mz = run.given[3] + hy * gz - hz * gy, run.given[4] + hz * gx - hx * gz, run.given[5] + hx * gy - hy * gx
    for i in range(chains.counts.shape[0]):
        n, row, place, speed = chains.counts[i], chains.table[i], chains.place[i], chains.speed[i]
        x, y, z = turned(state, ends[i, 0], ends[i, 1], ends[i, 2])
        place[0, 0], place[1, 0], place[2, 0] = state[CENTER] + x, state[CENTER + 1] + y, state[CENTER + 2] + z
        speed[0, 0] = state[VELOCITY] + (wy * z - wz * y)
        speed[1, 0] = state[VELOCITY + 1] + (wz * x - wx * z)
        speed[2, 0] = state[VELOCITY + 2] + (wx * y - wy * x)
        c.enter(place, speed, n, row)
        lost += c.pull(place, speed, n, row, chains.pulls[i])
        air = 0.5 * row[c.DENSITY] * row[c.ELEMENT] * row[c.AIR_RATE]
        px = chains.pulls[i, 0] * (place[0, 1] - place[0, 0]) - air * speed[0, 0]
        py = chains.pulls[i, 0] * (place[1, 1] - place[1, 0]) - air * speed[1, 0]
        pz = chains.pulls[i, 0] * (place[2, 1] - place[2, 0]) - air * speed[2, 0]
        lost += air * (speed[0, 0] ** 2 + speed[1, 0] ** 2 + speed[2, 0] ** 2)
        if run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0:
            bx, by, bz = c.blow_at(place, 0, 1, 0.5 * row[c.ELEMENT] * row[c.WIND], run.wind)
            px, py, pz = px + bx, py + by, pz + bz
            lost -= bx * speed[0, 0] + by * speed[1, 0] + bz * speed[2, 0]
        fx, fy, fz = fx + px, fy + py, fz + pz
        mx, my, mz = mx + (y * pz - z * py), my + (z * px - x * pz), mz + (x * py - y * px)
        tension = c.tension_at_exit(place, n, row, chains.pulls[i])
        whole = c.whole_force(place, speed, n, row, chains.pulls[i])
        fallen = whole - row[c.DENSITY] * run.gravity * drives.data[d.BEHIND_RISE, i]
        drives.now[d.AT_FRAME, i], drives.now[d.WHOLE, i] = tension, whole
        drives.now[d.AT_DRUM, i] = 2.0 * fallen / (1.0 + math.sqrt(max(1.0 + 2.0 * fallen / row[c.STIFFNESS], 0.0)))
        mean, share = c.mean_tension(chains.pulls[i], n, row), row[c.SMOOTH] if run.at[READY] == 2 else 1.0
        rows[t.TENSION, i] = share * mean + (1.0 - share) * (rows[t.TENSION, i] if share < 1.0 else 0.0)
    for k in range(6):
        free = run.free[k]
        run.force[k] = free[0] * fx + free[1] * fy + free[2] * fz + free[3] * mx + free[4] * my + free[5] * mz
    return lost


@glue
def feed(run: Swing) -> float:
    """Power of the given wrench at the present velocities [W]."""
    wx, wy, wz = spin(run.state, run.inertia)
    hx, hy, hz = turned(run.state, run.handle[0], run.handle[1], run.handle[2])
    there = run.state[VELOCITY] + (wy * hz - wz * hy)
    beside = run.state[VELOCITY + 1] + (wz * hx - wx * hz)
    above = run.state[VELOCITY + 2] + (wx * hy - wy * hx)
    turning = run.given[3] * wx + run.given[4] * wy + run.given[5] * wz
    return run.given[0] * there + run.given[1] * beside + run.given[2] * above + turning


@kernel
def kick_chains(run: Swing, h: float, begins: bool) -> None:
    """Change the nodes' velocities by forces, wind and air of a time; in reverse order where a step begins."""
    chains, audit = run.chains, run.drives.audit
    blows = run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0
    for i in range(chains.counts.shape[0]):
        n, row, place, speed = chains.counts[i], chains.table[i], chains.place[i], chains.speed[i]
        if not begins:
            c.kick(place, speed, n, row, chains.pulls[i], h)
        audit[d.LOST] += c.brake(speed, n, row, h)
        if blows:
            audit[d.SUPPLIED] += c.blow(place, speed, n, row, run.wind, h)
        if begins:
            c.kick(place, speed, n, row, chains.pulls[i], h)


@glue
def split_step(run: Swing, now: float) -> None:
    """One step from a time on; forces at hand before and after are those of the state."""
    h, half, drives, rows, chains = run.step, 0.5 * run.step, run.drives, run.rows, run.chains
    drives.audit[d.SUPPLIED] += half * feed(run)
    kick(run.state, run.inertia, run.force, half)
    kick_chains(run, half, True)
    if drives.kind == d.DRUMS:
        kick_drums(drives, half)
    elif drives.kind == d.SECOND_ORDER:
        kick_lagging(drives, rows, run.targets, half, True)
    for i in range(rows.shape[1]):
        drives.now[d.BEFORE, i] = rows[t.LENGTH, i]
        drives.now[d.BEFORE_WHOLE, i] = drives.now[d.WHOLE, i]
        drives.now[d.BEFORE_DRUM, i] = drives.now[d.AT_DRUM, i]
    drift(run.state, h)
    free_turn(run.state, run.inertia, h)
    if drives.kind == d.DRUMS:
        turn_drums(drives, run.cables, rows, run.gravity, h)
    elif drives.kind == d.SECOND_ORDER:
        for i in range(rows.shape[1]):
            rows[t.LENGTH, i] += h * drives.now[d.RATE, i]
    follow_courses(run, now + h, -MOMENT * h)
    for i in range(rows.shape[1]):
        row = chains.table[i]
        before = row[c.REST] + (drives.now[d.BEFORE, i] - rows[t.LENGTH, i])
        c.drift(chains.place[i], chains.speed[i], chains.counts[i], row, before, h)
    drives.audit[d.LOST] += h * pull_platform(run)
    if drives.kind == d.DRUMS:
        slip(drives, run.cables, h)
    else:
        for i in range(rows.shape[1]):
            wound = rows[t.LENGTH, i] - drives.now[d.BEFORE, i]
            drives.audit[d.SUPPLIED] -= 0.5 * (drives.now[d.BEFORE_WHOLE, i] + drives.now[d.WHOLE, i]) * wound
    kick(run.state, run.inertia, run.force, half)
    kick_chains(run, half, False)
    if drives.kind == d.DRUMS:
        kick_drums(drives, half)
    elif drives.kind == d.SECOND_ORDER:
        kick_lagging(drives, rows, run.targets, half, False)
    drives.audit[d.SUPPLIED] += half * feed(run)


@glue
def energy_of(run: Swing, i: int) -> tuple[float, float]:
    """Energy of a chain with that of its half element at the exit, and the latter alone [J]."""
    chains, n, row = run.chains, run.chains.counts[i], run.chains.table[i]
    strain, raised = c.potential(chains.place[i], n, row)
    entering = c.kinetic_at_exit(chains.speed[i], n, row)
    return strain + raised + c.kinetic(chains.speed[i], n, row) + entering, entering


@kernel
def divide_anew(run: Swing, i: int) -> None:
    """Give a chain one node more or less at the frame, and account for the energy that this takes."""
    chains, audit = run.chains, run.drives.audit
    row, place, speed, n = chains.table[i], chains.place[i], chains.speed[i], chains.counts[i]
    more = 1 if row[c.REST] > row[c.ELEMENT] else -1
    if n + more < FEWEST or n + more + 2 > place.shape[1]:
        run.at[FAILED], run.at[ENDED] = i + 1, (SHORT if more < 0 else LONG)
        return
    before, entering_before = energy_of(run, i)
    if more > 0:
        c.give_birth(place, speed, n, row)
    else:
        c.merge(place, speed, n, row)
    chains.counts[i] = n + more
    row[c.REST] -= more * row[c.ELEMENT]
    after, entering = energy_of(run, i)
    audit[d.LOST] += before - after
    audit[d.SUPPLIED] -= entering - entering_before  # that of the half element at the exit is the winch's
    c.pull(place, speed, n + more, row, chains.pulls[i])
    run.drives.now[d.WHOLE, i] = c.whole_force(place, speed, n + more, row, chains.pulls[i])


@kernel
def sample(place: Array, count: int, row: Array, points: Array) -> None:
    """Fill points (points, 3) of a chain at equal material steps, from the exit on."""
    element, rest = row[c.ELEMENT], row[c.REST]
    length = rest + count * element
    for p in range(points.shape[0]):
        way = length * p / (points.shape[0] - 1) - rest  # behind the node next to the frame
        passed = int(min(max(way / element, 0.0), count - 1.0)) if way > 0.0 else -1
        share = way / element - passed if way > 0.0 else 1.0 + way / rest
        for k in range(3):
            start = place[k, count - passed]
            points[p, k] = start + share * (place[k, count - passed - 1] - start)


@kernel
def record(run: Swing, records: Records, stock: Array) -> None:
    """Write down a step, and look whether energy has grown by itself."""
    states, tensions, lengths, energies, _notes, points = records
    state, drives, chains, at, r = run.state, run.drives, run.chains, run.at, run.at[RECORDS]
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
    if at[READY] < 2:
        at[READY] = 2
        audit[d.START] = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST]
    if math.isnan(stock[0]):
        stock[0], stock[1] = kinetic + strain, raised
    invented = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST] - audit[d.START]
    convertible = stock[0] + max(stock[1] - raised, 0.0) + abs(audit[d.SUPPLIED])
    if not invented <= GROWTH * convertible + ROUNDING * size:
        at[FAILED], at[ENDED] = blamed + 1, GROWN
    if r < states.shape[0]:
        turning = spin(state, run.inertia)
        for k in range(MOMENTUM):
            states[r, k] = state[k]
        for k in range(3):
            states[r, MOMENTUM + k] = turning[k]
        energies[r, KINETIC], energies[r, POTENTIAL] = kinetic, potential
        energies[r, GIVEN], energies[r, TAKEN] = audit[d.SUPPLIED], audit[d.LOST]
        for i in range(chains.counts.shape[0]):
            tensions[r, i], lengths[r, i] = drives.now[d.AT_FRAME, i], run.rows[t.LENGTH, i]
            sample(chains.place[i], chains.counts[i], chains.table[i], points[r, i])
        at[RECORDS] += 1


@entry
def swing(
    rules: Rules,
    numbers: Numbers,
    body: Body,
    data: Array,
    courses: tuple[CourseArrays, CourseArrays, CourseArrays],
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
    kind, remembered, stride = rules
    step, gravity, filtering = numbers
    state, rows, now, layers, audit, at, room = kept
    m, wide = rows.shape[1], courses[0][1].shape[1]
    run = Swing(
        Chains(*chain_arrays),
        step,
        gravity,
        body[0],
        body[1],
        body[2],
        body[3],
        Drives(kind, remembered > 0, data, now, layers, audit),
        Course(*courses[0]),
        Course(*courses[1]),
        Course(*courses[2]),
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
    if at[READY] == 0:
        at[READY] = 1
        begin = audit[d.BEGIN] + at[STEPS] * step
        follow_courses(run, begin, MOMENT * step)
        pull_platform(run)
        note(run.drives, rows, body[0], at, begin, gravity, records[4])
        record(run, records, stock)
    elif steps == 0:
        record(run, records, stock)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[STEPS] * step
        if at[LENGTH_AT] < courses[0][0].shape[0] - 1 and time + MOMENT * step >= courses[0][0][at[LENGTH_AT] + 1]:
            follow_courses(run, time, MOMENT * step)  # rates may jump here
            pull_platform(run)
        if kind == d.DRUMS and at[STEPS] % stride == 0:
            close_loops(run.drives, run.targets, run.target_rates, stride * step)
        split_step(run, time)
        at[STEPS] += 1
        for i in range(m):
            now[d.FILTERED, i] += filtering * (now[d.AT_FRAME, i] - now[d.FILTERED, i])
            rest, element = chain_arrays[0][i, c.REST], chain_arrays[0][i, c.ELEMENT]
            if not c.LEAST * element < rest < c.MOST * element:
                divide_anew(run, i)
        note(run.drives, rows, body[0], at, audit[d.BEGIN] + at[STEPS] * step, gravity, records[4])
        if at[STEPS] % every == 0:
            record(run, records, stock)
        if at[FAILED] > 0 or at[NOTES] + 2 * m > records[4].shape[0]:
            break

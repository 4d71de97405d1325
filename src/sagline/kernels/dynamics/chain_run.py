"""Simulation of a platform on chains: arrays, time tables of inputs, and forces and powers of the steps."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import progress
from sagline.kernels.dynamics.drives import Drives, keep_set_points
from sagline.kernels.dynamics.rigid_body import CENTER, MASS, VELOCITY, spin
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import turned

ROOM = 21

Numbers = tuple[float, float, float]  # step [s], gravity [m/s^2], weight of a new reading in a load cell's filter
Rules = tuple[int, int, int]  # kind of winches, remembered, steps per control period
Body = tuple[Array, Array, Array, Array]  # cables, inertia, projection onto free motions, point of the given wrench
Courses = tuple[
    progress.CubicTableArrays, progress.CubicTableArrays, progress.CubicTableArrays
]  # of lengths, wrenches, and wind velocity
Kept = tuple[Array, Array, Array, Array, Array, Indices, Array]  # state, rows, drives, layers, audit, counters
ChainArrays = tuple[Array, Array, Array, Array, Indices]
Records = tuple[Array, Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes, points


class _Chains(NamedTuple):
    """The chains of m cables, with memory for P nodes each."""

    table: Array  # parameters of the chains, (m, CHAIN_COLUMNS)
    place: Array  # positions of the nodes [m], (m, 3, P)
    speed: Array  # velocities of the nodes [m/s], (m, 3, P)
    pulls: Array  # element forces divided by element lengths [N/m], and work, (m, 3 P)
    counts: Indices  # numbers of free nodes, (m,)


class ChainRun(NamedTuple):
    """State and arrays of a run; the fields are the arguments of `chains.run_chains`."""

    chains: _Chains
    step: float
    gravity: float
    cables: Array
    inertia: Array
    free: Array
    handle: Array
    drives: Drives
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
def chain_run_of(
    rules: Rules, numbers: Numbers, body: Body, data: Array, courses: Courses, kept: Kept, chain_arrays: ChainArrays
) -> ChainRun:
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
    lengths, wrenches, winds = (
        progress.CubicTable(*courses[0]),
        progress.CubicTable(*courses[1]),
        progress.CubicTable(*courses[2]),
    )
    drives = Drives(kind, remembered > 0, data, now, layers, audit)
    return ChainRun(
        _Chains(*chain_arrays), step, gravity, body[0], body[1], body[2], body[3], drives, lengths, wrenches, winds,
        state, rows, at, targets, target_rates, small[0], small[1], wind, small[2],
    )  # fmt: skip


@glue
def _fill_last_elements(run: ChainRun) -> None:
    """Fill the remaining length of the element at the frame, and its rate, for every cable."""
    for i in range(run.chains.counts.shape[0]):
        row = run.chains.table[i]
        row[c.REST] = run.rows[g.LENGTH, i] - row[c.BEHIND] - run.chains.counts[i] * row[c.ELEMENT]
        row[c.RATE] = run.drives.now[d.RATE, i]


@kernel
def follow_time_tables(run: ChainRun, now: float, shift: float) -> None:
    """Fill the set points of the winches, and the given wrench and wind, at the time `now`."""
    at = run.at
    at[progress.LENGTH_AT] = progress.interpolate_table(
        run.lengths, at[progress.LENGTH_AT], now, shift, run.targets, run.target_rates
    )
    at[progress.WRENCH_AT] = progress.interpolate_table(
        run.wrenches, at[progress.WRENCH_AT], now, 0.0, run.given, run.spare
    )
    at[progress.WIND_AT] = progress.interpolate_table(run.winds, at[progress.WIND_AT], now, 0.0, run.wind, run.spare)
    keep_set_points(run.drives, run.rows, run.targets, run.target_rates)
    _fill_last_elements(run)


@kernel
def fill_platform_force(run: ChainRun) -> float:
    """Fill the force on the platform and the tensions at the winches. Returns the power lost [W]."""
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
        c.fill_frame_node_velocity(place, speed, n, row)
        lost += c.fill_element_forces(place, speed, n, row, chains.pulls[i])
        air = 0.5 * row[c.DENSITY] * row[c.ELEMENT] * row[c.AIR_RATE]
        px = chains.pulls[i, 0] * (place[0, 1] - place[0, 0]) - air * speed[0, 0]
        py = chains.pulls[i, 0] * (place[1, 1] - place[1, 0]) - air * speed[1, 0]
        pz = chains.pulls[i, 0] * (place[2, 1] - place[2, 0]) - air * speed[2, 0]
        lost += air * (speed[0, 0] ** 2 + speed[1, 0] ** 2 + speed[2, 0] ** 2)
        if run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0:
            bx, by, bz = c.wind_on_element(place, 0, 1, 0.5 * row[c.ELEMENT] * row[c.WIND], run.wind)
            px, py, pz = px + bx, py + by, pz + bz
            lost -= bx * speed[0, 0] + by * speed[1, 0] + bz * speed[2, 0]
        fx, fy, fz = fx + px, fy + py, fz + pz
        mx, my, mz = mx + (y * pz - z * py), my + (z * px - x * pz), mz + (x * py - y * px)
        tension = c.tension_at_exit(place, n, row, chains.pulls[i])
        whole = c.whole_force(place, speed, n, row, chains.pulls[i])
        lifted = row[c.DENSITY] * run.gravity * drives.data[d.BEHIND_RISE, i]
        drives.now[d.AT_FRAME, i], drives.now[d.WHOLE, i] = tension, whole
        drives.now[d.AT_DRUM, i] = d.tension_at_drum(whole, lifted, row[c.STIFFNESS])
        mean, share = c.mean_tension(chains.pulls[i], n, row), row[c.SMOOTH] if run.at[progress.READY] == 2 else 1.0
        rows[g.TENSION, i] = share * mean + (1.0 - share) * (rows[g.TENSION, i] if share < 1.0 else 0.0)
    for k in range(6):
        free = run.free[k]
        run.force[k] = free[0] * fx + free[1] * fy + free[2] * fz + free[3] * mx + free[4] * my + free[5] * mz
    return lost


@glue
def power_of_given_wrench(run: ChainRun) -> float:
    """Power of the given wrench at the present velocities [W]."""
    wx, wy, wz = spin(run.state, run.inertia)
    hx, hy, hz = turned(run.state, run.handle[0], run.handle[1], run.handle[2])
    there = run.state[VELOCITY] + (wy * hz - wz * hy)
    beside = run.state[VELOCITY + 1] + (wz * hx - wx * hz)
    above = run.state[VELOCITY + 2] + (wx * hy - wy * hx)
    turning = run.given[3] * wx + run.given[4] * wy + run.given[5] * wz
    return run.given[0] * there + run.given[1] * beside + run.given[2] * above + turning


@kernel
def kick_chains(run: ChainRun, h: float, begins: bool) -> None:
    """Update the nodes' velocities by forces, air and wind during `h`. At the start of a step, forces come last."""
    chains, audit = run.chains, run.drives.audit
    blows = run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0
    for i in range(chains.counts.shape[0]):
        n, row, place, speed = chains.counts[i], chains.table[i], chains.place[i], chains.speed[i]
        if not begins:
            c.kick_nodes(place, speed, n, row, chains.pulls[i], h)
        audit[d.LOST] += c.slow_by_air(speed, n, row, h)
        if blows:
            audit[d.SUPPLIED] += c.add_wind_on_nodes(place, speed, n, row, run.wind, h)
        if begins:
            c.kick_nodes(place, speed, n, row, chains.pulls[i], h)

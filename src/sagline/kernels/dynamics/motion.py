"""Motion of the platform on massless cables: one compiled loop over the time steps.

There are two integrators. The symplectic splitting (kick, drift, free rotation, kick) has order 2 and one evaluation of
the cables per step, and its energy error does not grow. The classical Runge-Kutta method has order 4 and four
evaluations per step. docs/model.md, section 11.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import copy, norm
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import forces_from_lengths
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import progress, rigid_body
from sagline.kernels.dynamics.chain import wind_across
from sagline.kernels.dynamics.drives import Drives, keep_set_points
from sagline.kernels.dynamics.progress import Courses, Kept
from sagline.kernels.dynamics.rigid_body import STATE_COLUMNS, VELOCITY, power_of, spin
from sagline.kernels.forward.platform import add_force, force_on_end, is_on_platform, platform_energy, unbalance
from sagline.kernels.jit import entry, glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import add_world_force, components_along, fill_motion_of_components

SPLITTING, RUNGE_KUTTA = 0, 1
DAMPED, LOADED, BLOWN, MOVED = 1, 2, 4, 8  # one bit for each kind of damping, load, or motion of anchors

Losses = tuple[float, float]
# code, k_h, k_p, gravity; True for pulleys or dead lengths, else None
ModelTerms = tuple[int, float, float, float, bool | None]
Rules = tuple[int, int, int, int, int]  # integrator, winches, remembered, damping and loads, steps per control period
Numbers = tuple[float, float, float, float]  # step [s], loss_time [s], air damping [N s/m^2], weight of a new reading
Robot = tuple[Array, Array, Array, Array]  # cables, body, inertia, freedom
Records = tuple[Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes


class _MasslessRun(NamedTuple):
    """State and arrays of a run; the fields are the arguments of `run_massless`."""

    model: Model
    work: int
    step: float
    losses: Losses
    cables: Array
    body: Array
    inertia: Array
    freedom: Array
    drives: Drives
    lengths: progress.CubicTable
    wrenches: progress.CubicTable
    winds: progress.CubicTable
    anchors: progress.CubicTable
    state: Array
    rows: Array
    at: Indices
    rotation: Array
    gradient: Array
    given: Array
    damping: Array
    before: Array
    none: Array
    spare: Array
    targets: Array
    target_rates: Array
    base: Array
    first: Array
    total: Array
    lengths_base: Array
    places: Array  # positions of moving anchors, (3 m,)
    speeds: Array  # velocities of the anchors, (3 m,)


@glue
def _massless_run_of(
    model: ModelTerms, rules: Rules, numbers: Numbers, robot: Robot, data: Array, courses: Courses, kept: Kept
) -> _MasslessRun:
    """State and arrays of a run from the arguments of `motion.run_massless`."""
    _integrator, kind, remembered, work, _stride = rules
    step, loss_time, air, _filtering = numbers
    state, rows, now, layers, audit, at, room = kept
    cables, body, inertia, freedom = robot
    memory = Memory(room, at)
    small, memory = block(memory, 6, 6)
    sides, memory = block(memory, 3, STATE_COLUMNS)
    wide, memory = block(memory, 4, rows.shape[1])
    both, memory = block(memory, 2, courses[0][1].shape[1])
    rotation, memory = block(memory, 3, 3)
    anchored, memory = block(memory, 2, 3 * rows.shape[1])
    lengths, wrenches, winds, anchors = progress.time_tables(courses)
    drives = Drives(kind, remembered > 0, data, now, layers, audit)
    return _MasslessRun(
        Model(*model), work, step, (loss_time, air), cables, body, inertia, freedom, drives, lengths, wrenches, winds,
        anchors, state, rows, at, rotation, small[0], small[1], small[2], small[3], small[4], small[5], both[0],
        both[1], sides[0], sides[1], sides[2], wide, anchored[0], anchored[1],
    )  # fmt: skip


@glue
def _cable_gravity(run: _MasslessRun) -> float:
    """Gravity if the cables have weight, else 0 [m/s^2]."""
    return run.model.gravity if run.model.code == codes.CATENARY else 0.0


@kernel
def _add_wind_on_cables(cables: Array, drag: Array, rows: Array, wind: Array, given: Array) -> None:
    """Add half of the wind force on every cable to the wrench `given` (6,). The force is normal to the chord."""
    for i in range(cables.shape[0]):
        x = rows[g.AZIMUTH_X, i] * rows[g.COSINE, i]
        y = rows[g.AZIMUTH_Y, i] * rows[g.COSINE, i]
        z = rows[g.SINE, i]
        along = wind[0] * x + wind[1] * y + wind[2] * z
        fx, fy, fz = wind_across(wind, along, x, y, z, 0.5 * drag[i] * rows[g.CHORD, i])
        add_world_force(rows, i, (fx, fy, fz), given)


@glue
def _project_on_freedom(freedom: Array, wrench: Array, part: Array) -> None:
    """Remove the components of `wrench` along motions that the platform cannot make. `part` is work memory."""
    if freedom.shape[0] < 6:
        components_along(freedom, wrench, part)
        fill_motion_of_components(freedom, part, wrench)


@kernel
def _fill_frame_end_tensions(
    weight_of: float, cables: Array, rows: Array, data: Array, now: Array, behind: bool | None
) -> None:
    """Fill the tensions at frame ends and drums, and H = T + T^2/(2 EA) - w z of every cable."""
    for i in range(cables.shape[0]):
        weight, stiffness = cables[i, tables.DENSITY] * weight_of, cables[i, tables.STIFFNESS]
        if behind is None:
            x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i] - weight * rows[g.LENGTH, i]
            tension, height = math.sqrt(x * x + z * z), 0.0
        else:
            tension, pulley = rows[g.LEAVING, i], pulley_at(cables, i)
            height = pulley.radius * pulley.entry * rows[g.WRAP_SINE, i]
            if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
                outward = (1.0 - rows[g.WRAP_COSINE, i]) * rows[g.CENTER_Z, i]
                height = pulley.radius * (outward + rows[g.WRAP_SINE, i] * rows[g.AXIS_Z, i])
            if is_on_platform(cables, i):  # the height above the drum, which moves with the platform
                height += rows[g.DRUM_RISE, i]
        whole = tension + 0.5 * tension * tension / stiffness - weight * height
        if is_on_platform(cables, i):
            x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
            tension = math.sqrt(x * x + z * z)
        now[d.AT_FRAME, i] = now[d.PULL, i] = tension
        now[d.WHOLE, i] = whole
        now[d.AT_DRUM, i] = d.tension_at_drum(whole, weight * data[d.BEHIND_RISE, i], stiffness)


@kernel
def _damp_cables(
    losses: Losses,
    weight_of: float,
    cables: Array,
    rows: Array,
    turning: Array,
    now: Array,
    wrench: Array,
    behind: bool | None,
) -> float:
    """Fill the damping wrench (6,) of the cables. Returns the power lost."""
    # The strain rate is the same along a whole cable, including the part between exit point and drum. Cable that is
    # paid out lengthens the span by its strained length. The cable stretches or changes its sag at the rate of the
    # chord minus the rate of the strained paid-out length. Only stretching causes damping, with the factor EA/L. The
    # fraction of stretching is the elastic compliance divided by the total compliance: 1 for a taut cable, 0 for a
    # slack cable. The damping of the air is computed as if the cable moved like its chord.
    # losses: loss_time [s], and air damping [N s/m^2]; weight_of: gravity if the cables have weight, else 0 [m/s^2];
    # turning: velocity of the center of mass, and angular velocity, (6,); now: state of the drives with the velocities
    # of the anchors; the damping parts of its tensions, and the power of the anchors, are filled; wrench: filled.
    lost = 0.0
    wrench[:] = 0.0
    vx, vy, vz = turning[0], turning[1], turning[2]
    wx, wy, wz = turning[3], turning[4], turning[5]
    for i in range(cables.shape[0]):
        rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
        ux, uy, uz = vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx
        ax, ay, az = now[d.ANCHOR_X, i], now[d.ANCHOR_Y, i], now[d.ANCHOR_Z, i]
        sign = -1.0 if is_on_platform(cables, i) else 1.0  # the chord points to the platform
        along = sign * rows[g.COSINE, i]
        x, y, z = rows[g.AZIMUTH_X, i] * along, rows[g.AZIMUTH_Y, i] * along, sign * rows[g.SINE, i]
        chord, length = rows[g.CHORD, i], rows[g.LENGTH, i]
        stiffness, tension = cables[i, tables.STIFFNESS], rows[g.TENSION, i]
        weight = cables[i, tables.DENSITY] * weight_of * chord * rows[g.COSINE, i]
        share = 0.0
        if tension > 0.0:
            share = 1.0 / (1.0 + stiffness * weight * weight * chord / (12.0 * length * tension * tension * tension))
        strained = chord / rows[g.LENGTH if behind is None else g.FREE_LENGTH, i]
        away = ax * x + ay * y + az * z
        rate = ux * x + uy * y + uz * z - away - now[d.RATE, i] * strained
        more = max(losses[0] * stiffness / length * share * share * rate, -tension)
        slow = losses[1] * chord / 3.0
        now[d.STRETCHING, i] = more * strained
        now[d.AT_FRAME, i] = max(now[d.PULL, i] + more, 0.0)
        # along the chord, the velocity changes linearly from the anchor to the platform end
        both, anchor = ux * ax + uy * ay + uz * az, ax * ax + ay * ay + az * az
        lost += more * rate + slow * (ux * ux + uy * uy + uz * uz + both + anchor)
        now[d.ANCHOR_LOSS, i] = slow * (anchor + 0.5 * both) - more * away
        fx, fy, fz = slow * (ux + 0.5 * ax), slow * (uy + 0.5 * ay), slow * (uz + 0.5 * az)
        add_world_force(rows, i, (-more * x - fx, -more * y - fy, -more * z - fz), wrench)
    return lost


@kernel
def _move_anchors(run: _MasslessRun, now: float) -> None:
    """Move the anchors to their positions at the time `now`, and fill their velocities."""
    at = run.at
    at[progress.ANCHOR_AT] = progress.interpolate_table(
        run.anchors, at[progress.ANCHOR_AT], now, 0.0, run.places, run.speeds
    )
    for i in range(run.cables.shape[0]):
        for k in range(3):
            run.cables[i, tables.FRAME_X + k] = run.places[3 * i + k]
            run.drives.now[d.ANCHOR_X + k, i] = run.speeds[3 * i + k]


@kernel
def _power_of_anchors(cables: Array, rows: Array, now: Array) -> float:
    """Power of moving anchors on the cables [W], without that of lifting the cables with their anchors."""
    power = 0.0
    for i in range(rows.shape[1]):
        x, y, z = force_on_end(cables, rows, i)
        power += now[d.ANCHOR_LOSS, i] - (x * now[d.ANCHOR_X, i] + y * now[d.ANCHOR_Y, i] + z * now[d.ANCHOR_Z, i])
    return power


@kernel
def _fill_set_points(run: _MasslessRun, now: float, shift: float) -> None:
    """Fill the set points at the time `now`, and the lengths of ideal winches."""
    at = run.at
    at[progress.LENGTH_AT] = progress.interpolate_table(
        run.lengths, at[progress.LENGTH_AT], now, shift, run.targets, run.target_rates
    )
    keep_set_points(run.drives, run.rows, run.targets, run.target_rates)


@kernel
def _fill_forces(run: _MasslessRun, now: float) -> None:
    """Fill platform force (minus the energy gradient), given wrench, and cable tensions at the time `now`."""
    at, drives, rows, state = run.at, run.drives, run.rows, run.state
    _fill_set_points(run, now, -progress.MOMENT * run.step)
    if tables.MOVES and (run.work & MOVED) > 0:
        _move_anchors(run, now)
    if run.work & LOADED:
        at[progress.WRENCH_AT] = progress.interpolate_table(
            run.wrenches, at[progress.WRENCH_AT], now, 0.0, run.given, run.spare
        )
    unbalance(run.model, run.cables, run.body, run.given, state, run.rotation, rows, run.gradient)
    if run.work & BLOWN:
        at[progress.WIND_AT] = progress.interpolate_table(
            run.winds, at[progress.WIND_AT], now, 0.0, run.before[:3], run.spare
        )
        for k in range(6):
            run.gradient[k] += run.given[k]
        _add_wind_on_cables(run.cables, drives.data[d.DRAG], rows, run.before, run.given)
        for k in range(6):
            run.gradient[k] -= run.given[k]
    for k in range(6):
        run.gradient[k] = -run.gradient[k]
    _project_on_freedom(run.freedom, run.gradient, run.spare)
    _fill_frame_end_tensions(_cable_gravity(run), run.cables, rows, drives.data, drives.now, run.model.behind)


@kernel
def _fill_damping(run: _MasslessRun) -> None:
    """Fill the damping wrench at the present velocities, and the powers of damping, given forces and anchors."""
    if run.work:
        spinning = spin(run.state, run.inertia)
        drives, motion = run.drives, run.spare
        for k in range(3):
            motion[k], motion[3 + k] = run.state[VELOCITY + k], spinning[k]
        if run.work & DAMPED:
            drives.audit[d.LOST_POWER] = _damp_cables(
                run.losses, _cable_gravity(run), run.cables, run.rows, motion, drives.now, run.damping, run.model.behind
            )
            _project_on_freedom(run.freedom, run.damping, motion)
        drives.audit[d.GIVEN_POWER] = power_of(run.given, run.state, spinning)
        if tables.MOVES and (run.work & MOVED) > 0:
            drives.audit[d.GIVEN_POWER] += _power_of_anchors(run.cables, run.rows, drives.now)


@glue
def _add_powers(drives: Drives, time: float) -> None:
    """Add the work of the powers during `time` to the audit. Cable damping works on all winches except drums."""
    power = drives.audit[d.GIVEN_POWER]
    if drives.kind != d.DRUMS:
        for i in range(drives.now.shape[1]):
            power -= drives.now[d.STRETCHING, i] * drives.now[d.RATE, i]
    drives.audit[d.SUPPLIED] += time * power
    drives.audit[d.LOST] += time * drives.audit[d.LOST_POWER]


@entry
def cable_loads(
    model: ModelTerms,
    losses: tuple[float, float],
    cables: Array,
    body: Array,
    data: Array,
    state: Array,
    rotation: Array,
    rows: Array,
    now: Array,
    wrenches: Array,
) -> int:
    """Fill tensions at the frame ends and the wrench of all cables. Returns the number of cables without solution."""
    # model: Cable model.
    # losses: loss_time [s] and air damping [N s/m^2].
    # cables: Rows of the cable_table, (m, CABLE_COLUMNS).
    # body: Row of the body_table. Its center of mass is the reference point of wrench and velocity.
    # data: Parameters of the drives, (DATA_ROWS, m); the height of the frame ends above the drums is used.
    # state: Pose row of the platform, velocity of the reference point and angular velocity in world axes, (13,).
    # rotation: Work array (3, 3).
    # rows: Rows of the cables with their lengths, (CABLE_ROWS, m). The solution is near the solution of the last
    #     call if the parameters of that call are in the rows.
    # now: State of the drives with the rates of the lengths, (DRIVE_ROWS, m). The tensions are filled.
    # wrenches: Filled, (2, 6): wrench on the platform about the reference point, and the part of the losses.
    terms = Model(model[0], model[1], model[2], model[3], model[4])
    gravity = terms.gravity if terms.code == codes.CATENARY else 0.0
    wrench, lost = wrenches[0], wrenches[1]
    cable_geometry(cables, body, state, rotation, rows)
    forces_from_lengths(terms, cables, rows, terms.behind)
    _fill_frame_end_tensions(gravity, cables, rows, data, now, terms.behind)
    lost[:] = 0.0
    if losses[0] > 0.0 or losses[1] > 0.0:
        _damp_cables(losses, gravity, cables, rows, state[VELOCITY:], now, lost, terms.behind)
    unsolved = 0
    copy(lost, wrench)
    for i in range(cables.shape[0]):
        add_force(rows, i, -rows[g.HORIZONTAL, i], -rows[g.VERTICAL, i], wrench)
        if rows[g.STATUS, i] not in (codes.CABLE_SOLVED, codes.CABLE_SLACK):
            unsolved += 1
    return unsolved


# largest energy error, relative to the exchanged energy (row MOVED); a larger error means that the step is too long
GROWTH = 0.1


@kernel
def _record_step(run: _MasslessRun, records: Records) -> None:
    """Record a step, and check that the energy does not increase by more than the supplied energy."""
    states, tensions, lengths, energies, _notes = records
    state, drives, rows, at = run.state, run.drives, run.rows, run.at
    audit, row = drives.audit, at[progress.RECORDS]
    stored, size = platform_energy(run.model, run.cables, run.body, run.none, state, run.rotation, rows)
    kinetic, potential = rigid_body.kinetic_energy(state, run.inertia), stored + audit[d.ON_DRUMS]
    for i in range(rows.shape[1]):
        if drives.kind == d.DRUMS:
            kinetic += 0.5 * drives.data[d.INERTIA, i] * drives.now[d.SPEED, i] * drives.now[d.SPEED, i]
    if at[progress.READY] < 2:
        at[progress.READY] = 2
        audit[d.START] = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST]
        audit[d.START_POTENTIAL] = potential
    invented = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST] - audit[d.START]
    moved = kinetic + abs(potential - audit[d.START_POTENTIAL]) + abs(audit[d.SUPPLIED]) + abs(audit[d.LOST])
    audit[d.MOVED] = max(audit[d.MOVED], moved)
    if not abs(invented) <= GROWTH * audit[d.MOVED] + progress.ROUNDING * size:
        at[progress.FAILED] = 1
        for i in range(rows.shape[1]):
            if drives.now[d.AT_FRAME, i] > drives.now[d.AT_FRAME, at[progress.FAILED] - 1]:
                at[progress.FAILED] = i + 1
    if row < states.shape[0]:
        turning = rigid_body.spin(state, run.inertia)
        copy(state[: rigid_body.MOMENTUM], states[row])
        for k in range(3):
            states[row, rigid_body.MOMENTUM + k] = turning[k]
        for i in range(rows.shape[1]):
            tensions[row, i] = drives.now[d.AT_FRAME, i]
            lengths[row, i] = rows[g.LENGTH, i]
        energies[row, progress.KINETIC], energies[row, progress.POTENTIAL] = kinetic, potential
        energies[row, progress.SUPPLIED], energies[row, progress.LOST] = audit[d.SUPPLIED], audit[d.LOST]
        at[progress.RECORDS] += 1


@glue
def _runge_kutta_step(run: _MasslessRun, now: float) -> None:
    """One step of the classical Runge-Kutta method. Forces at the step's end replace forces at the step's start."""
    h, drives, rows, state = run.step, run.drives, run.rows, run.state
    m, lagging = rows.shape[1], drives.kind == d.SECOND_ORDER
    supplied, lost = 0.0, 0.0
    for k in range(rigid_body.STATE_COLUMNS):
        run.base[k] = state[k]
        run.total[k] = 0.0
    for i in range(m):
        run.lengths_base[0, i], run.lengths_base[1, i] = rows[g.LENGTH, i], drives.now[d.RATE, i]
        run.lengths_base[2, i] = run.lengths_base[3, i] = 0.0
    for stage in range(4):
        weight = 1.0 / 3.0 if stage == 1 or stage == 2 else 1.0 / 6.0
        ahead = 0.5 * h if stage < 2 else h
        _fill_damping(run)
        for k in range(6):
            run.before[k] = run.gradient[k] + (run.damping[k] if run.work & DAMPED else 0.0)
        rigid_body.rates_of(state, run.inertia, run.before, run.first)
        supplied += weight * drives.audit[d.GIVEN_POWER]
        lost += weight * drives.audit[d.LOST_POWER]
        for k in range(rigid_body.STATE_COLUMNS):
            run.total[k] += weight * run.first[k]
            state[k] = run.base[k] + (ahead * run.first[k] if stage < 3 else h * run.total[k])
        for i in range(m):
            rate = drives.now[d.RATE, i]
            supplied -= weight * (drives.now[d.WHOLE, i] + drives.now[d.STRETCHING, i]) * rate
            if lagging:
                omega, ratio = drives.data[d.BANDWIDTH, i], drives.data[d.RATIO, i]
                push = omega * omega * (run.targets[i] - rows[g.LENGTH, i]) - 2.0 * ratio * omega * rate
                if drives.now[d.HELD, i] > 0.0:
                    push = rate = 0.0
                run.lengths_base[2, i] += weight * rate
                run.lengths_base[3, i] += weight * push
                length = ahead * rate if stage < 3 else h * run.lengths_base[2, i]
                speed = ahead * push if stage < 3 else h * run.lengths_base[3, i]
                rows[g.LENGTH, i] = run.lengths_base[0, i] + length
                drives.now[d.RATE, i] = run.lengths_base[1, i] + speed
        if stage == 3:
            size = norm(state[rigid_body.TURN : rigid_body.VELOCITY])
            for k in range(rigid_body.TURN, rigid_body.VELOCITY):
                state[k] /= size
        _fill_forces(run, now + ahead)
    drives.audit[d.SUPPLIED] += h * supplied
    drives.audit[d.LOST] += h * lost
    _fill_damping(run)


@glue
def _splitting_step(run: _MasslessRun, now: float) -> None:
    """One step of the splitting from the time `now`. Forces at the step's end replace forces at the step's start."""
    h, half, drives, rows = run.step, 0.5 * run.step, run.drives, run.rows
    _fill_damping(run)
    _add_powers(drives, half)
    rigid_body.kick_body(run.state, run.inertia, run.gradient, half)
    if run.work & DAMPED:
        rigid_body.kick_body(run.state, run.inertia, run.damping, half)
    d.kick_winches(drives, rows, run.targets, half, True)
    d.store_step_start(drives, rows)
    rigid_body.drift_body(run.state, h)
    rigid_body.free_turn(run.state, run.inertia, h)
    d.turn_winches(drives, run.cables, rows, _cable_gravity(run), h)
    _fill_forces(run, now + h)
    d.add_winch_energy(drives, run.cables, rows, h)
    rigid_body.kick_body(run.state, run.inertia, run.gradient, half)
    if run.work & DAMPED:  # adjoint of the first kick, with one correction of the damping
        _fill_damping(run)
        copy(run.damping, run.before)
        rigid_body.kick_body(run.state, run.inertia, run.damping, half)
        _fill_damping(run)
        rigid_body.kick_body(run.state, run.inertia, run.before, -half)
        rigid_body.kick_body(run.state, run.inertia, run.damping, half)
    d.kick_winches(drives, rows, run.targets, half, False)
    _fill_damping(run)
    _add_powers(drives, half)


@glue
def _start_run(run: _MasslessRun, records: Records, room: Array) -> None:
    """Prepare the start of a run, or the continuation of a run after an event."""
    at, now = run.at, run.drives.now
    time = run.drives.audit[d.BEGIN] + at[progress.STEPS] * run.step
    at[progress.READY] = 1
    room[:] = 0.0
    _fill_forces(run, time)
    _fill_set_points(run, time, progress.MOMENT * run.step)
    _fill_damping(run)
    if at[progress.STEPS] == 0:
        copy(now[d.AT_FRAME], now[d.FILTERED])
    progress.note_events(run.drives, run.rows, run.cables, at, time, _cable_gravity(run), records[4])
    _record_step(run, records)


@entry
def run_massless(
    model: ModelTerms,
    rules: Rules,
    numbers: Numbers,
    robot: Robot,
    data: Array,
    courses: Courses,
    kept: Kept,
    records: Records,
    steps: int,
    every: int,
) -> None:
    """Integrate `steps` steps. Several calls give bitwise the same result as one call with all steps."""
    # model: See `ModelTerms`.
    # rules: See `Rules`; `stride` is the number of steps per control period of drums.
    # numbers: See `Numbers`.
    # robot: Rows of the cable_table, with platform anchors in principal axes relative to the center of mass (moving
    #   frame anchors are overwritten); row of the body_table with the center of mass at zero; row of inertia; free
    #   motions (n, 6).
    # data: Data of the drives, (DATA_ROWS, m).
    # courses: Time tables of lengths, wrenches, wind velocity and moving anchors, (K, 3 m). Lengths (K, m) are
    #   unstrained. Lengths for drums are lengths s along the path of winding, followed in each row by expected
    #   tensions, (K, 2 m).
    # kept: State of the run, and work arrays. The state before the steps is overwritten with the state after them.
    # records: Filled with states (angular velocity in place of angular momentum), frame-end tensions, lengths,
    #   energies, notes.
    # steps: Largest number of steps. The run ends earlier if the records are full. With 0, only the initial state is
    #   evaluated.
    # every: Number of steps between records. The first record is the initial state. With 0, only the last step is
    #   recorded.
    integrator, kind, _remembered, _work, stride = rules
    step, filtering = numbers[0], numbers[3]
    moving = _massless_run_of(model, rules, numbers, robot, data, courses, kept)
    drives, rows, at, audit = moving.drives, moving.rows, moving.at, kept[4]
    if at[progress.READY] == 0:
        _start_run(moving, records, kept[6])
    elif steps == 0:
        _record_step(moving, records)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[progress.STEPS] * step
        if (
            progress.interval_ends(moving.lengths, at[progress.LENGTH_AT], time + progress.MOMENT * step)
            or at[progress.RENEWED] > 0
        ):
            if at[progress.RENEWED] > 1:
                _fill_forces(moving, time)  # the wrench jumps at this instant
            at[progress.RENEWED] = 0
            _fill_set_points(moving, time, progress.MOMENT * step)  # the rates may jump at this instant
        if kind == d.DRUMS and at[progress.STEPS] % stride == 0:
            d.close_loops(drives, moving.targets, moving.target_rates, stride * step)
        if integrator == SPLITTING:
            _splitting_step(moving, time)
        else:
            _runge_kutta_step(moving, time)
        at[progress.STEPS] += 1
        d.filter_tensions(drives, filtering)
        progress.note_events(
            drives,
            rows,
            moving.cables,
            at,
            audit[d.BEGIN] + at[progress.STEPS] * step,
            _cable_gravity(moving),
            records[4],
        )
        if every > 0 and at[progress.STEPS] % every == 0:
            _record_step(moving, records)
            if at[progress.FAILED] > 0:
                break
        if every > 0 and not progress.has_room(at, records[4], rows.shape[1]):
            break
    if every == 0 and steps > 0:
        _record_step(moving, records)

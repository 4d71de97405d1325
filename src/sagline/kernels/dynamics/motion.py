"""Motion of the platform on massless cables: one compiled loop over the time steps.

There are two integrators. The symplectic splitting (kick, drift, free rotation, kick) has order 2 and one evaluation of
the cables per step, and its energy error does not grow. The classical Runge-Kutta method has order 4 and four
evaluations per step. docs/model.md, section 11.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import massless, progress, rigid_body
from sagline.kernels.dynamics.progress import Courses, Kept
from sagline.kernels.forward.platform import platform_energy
from sagline.kernels.jit import entry, glue, kernel

# largest energy error, relative to the exchanged energy (row MOVED); a larger error means that the step is too long
GROWTH = 0.1


@kernel
def _record_step(run: massless.MasslessRun, records: massless.Records) -> None:
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
        for k in range(rigid_body.MOMENTUM):
            states[row, rigid_body.CENTER + k] = state[rigid_body.CENTER + k]
        for k in range(3):
            states[row, rigid_body.MOMENTUM + k] = turning[k]
        for i in range(rows.shape[1]):
            tensions[row, i] = drives.now[d.AT_FRAME, i]
            lengths[row, i] = rows[g.LENGTH, i]
        energies[row, progress.KINETIC], energies[row, progress.POTENTIAL] = kinetic, potential
        energies[row, progress.SUPPLIED], energies[row, progress.LOST] = audit[d.SUPPLIED], audit[d.LOST]
        at[progress.RECORDS] += 1


@glue
def _runge_kutta_step(run: massless.MasslessRun, now: float) -> None:
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
        massless.fill_damping(run)
        for k in range(6):
            run.before[k] = run.gradient[k] + (run.damping[k] if run.work & massless.DAMPED else 0.0)
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
            scale = 0.0
            for k in range(4):
                scale += state[rigid_body.TURN + k] * state[rigid_body.TURN + k]
            for k in range(4):
                state[rigid_body.TURN + k] /= math.sqrt(scale)
        massless.fill_forces(run, now + ahead)
    drives.audit[d.SUPPLIED] += h * supplied
    drives.audit[d.LOST] += h * lost
    massless.fill_damping(run)


@glue
def _splitting_step(run: massless.MasslessRun, now: float) -> None:
    """One step of the splitting from the time `now`. Forces at the step's end replace forces at the step's start."""
    h, half, drives, rows = run.step, 0.5 * run.step, run.drives, run.rows
    massless.fill_damping(run)
    massless.add_powers(drives, half)
    rigid_body.kick_body(run.state, run.inertia, run.gradient, half)
    if run.work & massless.DAMPED:
        rigid_body.kick_body(run.state, run.inertia, run.damping, half)
    d.kick_winches(drives, rows, run.targets, half, True)
    d.store_step_start(drives, rows)
    rigid_body.drift_body(run.state, h)
    rigid_body.free_turn(run.state, run.inertia, h)
    d.turn_winches(drives, run.cables, rows, massless.cable_gravity(run), h)
    massless.fill_forces(run, now + h)
    d.add_winch_energy(drives, run.cables, rows, h)
    rigid_body.kick_body(run.state, run.inertia, run.gradient, half)
    if run.work & massless.DAMPED:  # adjoint of the first kick, with one correction of the damping
        massless.fill_damping(run)
        for k in range(6):
            run.before[k] = run.damping[k]
        rigid_body.kick_body(run.state, run.inertia, run.damping, half)
        massless.fill_damping(run)
        rigid_body.kick_body(run.state, run.inertia, run.before, -half)
        rigid_body.kick_body(run.state, run.inertia, run.damping, half)
    d.kick_winches(drives, rows, run.targets, half, False)
    massless.fill_damping(run)
    massless.add_powers(drives, half)


@glue
def _start_run(run: massless.MasslessRun, records: massless.Records, room: Array) -> None:
    """Prepare the start of a run, or the continuation of a run after an event."""
    at, now = run.at, run.drives.now
    time = run.drives.audit[d.BEGIN] + at[progress.STEPS] * run.step
    at[progress.READY] = 1
    room[:] = 0.0
    massless.fill_forces(run, time)
    massless.fill_set_points(run, time, progress.MOMENT * run.step)
    massless.fill_damping(run)
    if at[progress.STEPS] == 0:
        for i in range(now.shape[1]):
            now[d.FILTERED, i] = now[d.AT_FRAME, i]
    progress.note_events(run.drives, run.rows, run.cables, at, time, massless.cable_gravity(run), records[4])
    _record_step(run, records)


@entry
def run_massless(
    model: massless.ModelTerms,
    rules: massless.Rules,
    numbers: massless.Numbers,
    robot: massless.Robot,
    data: Array,
    courses: Courses,
    kept: Kept,
    records: massless.Records,
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
    moving = massless.massless_run_of(model, rules, numbers, robot, data, courses, kept)
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
                massless.fill_forces(moving, time)  # the wrench jumps at this instant
            at[progress.RENEWED] = 0
            massless.fill_set_points(moving, time, progress.MOMENT * step)  # the rates may jump at this instant
        if kind == d.DRUMS and at[progress.STEPS] % stride == 0:
            d.close_loops(drives, moving.targets, moving.target_rates, stride * step)
        if integrator == massless.SPLITTING:
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
            massless.cable_gravity(moving),
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

"""The platform on cables without mass, in time: one loop over steps, with everything inside it.

Two codes: a symplectic splitting (kick, drift, free turn, kick; one evaluation of the cables a step, order 2, its
energy has no trend), and the classical Runge-Kutta method (four evaluations, order 4). docs/model.md, section 11.
"""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import close_loops, filter_tensions
from sagline.kernels.dynamics.forces import fill_damping, fill_forces, fill_set_points
from sagline.kernels.dynamics.massless import (
    SPLITTING,
    Courses,
    Kept,
    MasslessRun,
    ModelTerms,
    Numbers,
    Records,
    Robot,
    Rules,
    cable_gravity,
    massless_run_of,
)
from sagline.kernels.dynamics.progress import FAILED, LENGTH_AT, READY, RENEWED, STEPS, has_room, note_events
from sagline.kernels.dynamics.records import record_step
from sagline.kernels.dynamics.runge_kutta import runge_kutta_step
from sagline.kernels.dynamics.splitting import splitting_step
from sagline.kernels.dynamics.tables_in_time import MOMENT, interval_ends
from sagline.kernels.jit import entry, glue


@glue
def _start_run(run: MasslessRun, records: Records, room: Array) -> None:
    """Look at where a run begins, or goes on after something happened to it."""
    at, now = run.at, run.drives.now
    time = run.drives.audit[d.BEGIN] + at[STEPS] * run.step
    at[READY] = 1
    for k in range(room.shape[0]):
        room[k] = 0.0
    fill_forces(run, time)
    fill_set_points(run, time, MOMENT * run.step)
    fill_damping(run)
    if at[STEPS] == 0:
        for i in range(now.shape[1]):
            now[d.FILTERED, i] = now[d.AT_FRAME, i]
    note_events(run.drives, run.rows, run.cables, at, time, cable_gravity(run), records[4])
    record_step(run, records)


@entry
def run(
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
    """Go on for some steps; a run that is ready goes on where the last call ended, bit by bit the same.

    Args:
        model: See `ModelTerms`.
        rules: See `Rules`; the loops of drums are closed every so many steps.
        numbers: See `Numbers`; the share of a new reading in a load cell's filtered one.
        robot: Rows of the cable_table, anchors in the platform's principal axes from its center of mass; body with
            its center at zero; inertia; and free motions (n, 6).
        data: Of the drives, (DATA_ROWS, m).
        courses: Of lengths, of wrenches and of the wind's velocity. Lengths (K, m) are unstrained, but for drums:
            lengths s along the path of winding, then expected tensions, (K, 2 m).
        kept: What a run is in the midst of, in and out, and room for numbers.
        records: Filled: states with the angular velocity in the momentum's place, tensions at the frame ends, lengths,
            energies, notes.
        steps: How many steps to take, fewer where there is no room left for the notes of another. With 0 the start
            alone is looked at.
        every: After how many steps one is recorded, the start first; 0 for the last one.
    """
    integrator, kind, _remembered, _work, stride = rules
    step, filtering = numbers[0], numbers[3]
    moving = massless_run_of(model, rules, numbers, robot, data, courses, kept)
    drives, rows, at, audit = moving.drives, moving.rows, moving.at, kept[4]
    if at[READY] == 0:
        _start_run(moving, records, kept[6])
    elif steps == 0:
        record_step(moving, records)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[STEPS] * step
        if interval_ends(moving.lengths, at[LENGTH_AT], time + MOMENT * step) or at[RENEWED] > 0:
            at[RENEWED] = 0
            fill_set_points(moving, time, MOMENT * step)  # rates may jump here
        if kind == d.DRUMS and at[STEPS] % stride == 0:
            close_loops(drives, moving.targets, moving.target_rates, stride * step)
        if integrator == SPLITTING:
            splitting_step(moving, time)
        else:
            runge_kutta_step(moving, time)
        at[STEPS] += 1
        filter_tensions(drives, filtering)
        note_events(
            drives, rows, moving.cables, at, audit[d.BEGIN] + at[STEPS] * step, cable_gravity(moving), records[4]
        )
        if every > 0 and at[STEPS] % every == 0:
            record_step(moving, records)
            if at[FAILED] > 0:
                break
        if every > 0 and not has_room(at, records[4], rows.shape[1]):
            break
    if every == 0 and steps > 0:
        record_step(moving, records)

"""The platform on cables without mass, in time: one loop over steps, with everything inside it.

Two codes: a symplectic splitting (kick, drift, free turn, kick; one evaluation of the cables a step, order 2, its
energy has no trend), and the classical Runge-Kutta method (four evaluations, order 4). docs/model.md, section 11.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.balance.freedom import components_along, spread
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable import rows as t
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CATENARY
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import Drives, close_loops, kick_drums, kick_lagging, slip, turn_drums
from sagline.kernels.dynamics.rigid_body import (
    CENTER,
    MOMENTUM,
    STATE_COLUMNS,
    TURN,
    VELOCITY,
    drift,
    free_turn,
    kick,
    kinetic_energy,
    power_of,
    rates_of,
    spin,
)
from sagline.kernels.dynamics.tables_in_time import Course, CourseArrays, follow
from sagline.kernels.forward.platform import platform_energy, unbalance
from sagline.kernels.jit import entry, glue, kernel
from sagline.kernels.memory import block

SPLITTING, RUNGE_KUTTA = 0, 1

# counters that go in and out
STEPS, LENGTH_AT, WRENCH_AT, WIND_AT, NOTES, RECORDS, READY, FAILED, RENEWED = range(9)
COUNTERS = 9
# columns of the notes: what began when, with which cable; largest tensions before and after
NOTE_TIME, NOTE_KIND, NOTE_CABLE, NOTE_BEFORE, NOTE_AFTER = range(5)
NOTE_COLUMNS = 5
NOTE_SLACK, NOTE_SATURATED = 0.0, 1.0
# columns of the energies of a record
KINETIC, POTENTIAL, GIVEN, TAKEN = range(4)
ENERGY_COLUMNS = 4

MOMENT = 1e-6  # of a step: instants that are nearer are the same
GROWN = 0.1  # of all energy that moves: an integrator that invents more has left its limit of stability
ROUNDING = 1e-9  # of the sum of all parts of the energy
LOOP_PERIOD = 1e-3  # s

Losses = tuple[float, float]
Rules = tuple[int, int, int, int, int]  # integrator, kind of winches, remembered, what damps or loads, loops' stride
Numbers = tuple[float, float, float, float]  # step [s], loss_time [s], air damping [N s/m^2], share of a new reading
Robot = tuple[Array, Array, Array, Array]  # cables, body, inertia, freedom
Kept = tuple[Array, Array, Array, Array, Array, Indices, Array]  # state, rows, drives' now, layers, audit, counters
Records = tuple[Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes

DAMPED, LOADED, BLOWN = 1, 2, 4  # bits of what damps or loads


class Plant(NamedTuple):
    """What a run works on; arrays as in `run`."""

    model: Model
    work: int
    step: float
    losses: Losses
    cables: Array
    body: Array
    inertia: Array
    freedom: Array
    drives: Drives
    lengths: Course
    wrenches: Course
    winds: Course
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


@kernel
def blow(cables: Array, drag: Array, rows: Array, wind: Array, given: Array) -> None:
    """Add half of the wind's force on every cable, as it hangs along its chord, to a wrench (6,)."""
    for i in range(cables.shape[0]):
        x = rows[g.AZIMUTH_X, i] * rows[g.COSINE, i]
        y = rows[g.AZIMUTH_Y, i] * rows[g.COSINE, i]
        z = rows[g.SINE, i]
        along = wind[0] * x + wind[1] * y + wind[2] * z
        nx, ny, nz = wind[0] - along * x, wind[1] - along * y, wind[2] - along * z
        size = 0.5 * drag[i] * rows[g.CHORD, i] * math.sqrt(nx * nx + ny * ny + nz * nz)
        add_at_end(rows, i, size * nx, size * ny, size * nz, given)


@kernel
def add_at_end(rows: Array, i: int, x: float, y: float, z: float, wrench: Array) -> None:
    """Add a force at the platform end of a cable to a wrench (6,)."""
    rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
    wrench[0] += x
    wrench[1] += y
    wrench[2] += z
    wrench[3] += ry * z - rz * y
    wrench[4] += rz * x - rx * z
    wrench[5] += rx * y - ry * x


@glue
def keep_free(freedom: Array, wrench: Array, part: Array) -> None:
    """Take from a wrench what the platform's guides carry."""
    if freedom.shape[0] < 6:
        components_along(freedom, wrench, part)
        spread(freedom, part, wrench)


@kernel
def pull_of_frame(weight_of: float, cables: Array, rows: Array, data: Array, now: Array, behind: bool | None) -> None:
    """Fill the tensions at frame ends and drums, and H = T + T^2/(2 EA) - w z, which is one number a cable."""
    for i in range(cables.shape[0]):
        weight, stiffness = cables[i, tables.DENSITY] * weight_of, cables[i, tables.STIFFNESS]
        if behind is None:
            x, z = rows[t.HORIZONTAL, i], rows[t.VERTICAL, i] - weight * rows[t.LENGTH, i]
            tension, height = math.sqrt(x * x + z * z), 0.0
        else:
            tension, pulley = rows[t.LEAVING, i], pulley_at(cables, i)
            height = pulley.radius * pulley.entry * rows[t.WRAP_SINE, i]
        whole = tension + 0.5 * tension * tension / stiffness - weight * height
        fallen = whole - weight * data[d.BEHIND_RISE, i]
        now[d.AT_FRAME, i] = now[d.PULL, i] = tension
        now[d.WHOLE, i] = whole
        now[d.AT_DRUM, i] = 2.0 * fallen / (1.0 + math.sqrt(1.0 + 2.0 * fallen / stiffness))


@kernel
def damp_cables(
    losses: Losses,
    weight_of: float,
    cables: Array,
    rows: Array,
    turning: Array,
    now: Array,
    wrench: Array,
    behind: bool | None,
) -> float:
    """Fill the wrench (6,) of what damps the cables; returns the power that is lost.

    All of a cable stretches alike, what lies behind the free span with it, and what is let out lengthens the span by
    what it is strained: EA/L times the chord's rate less that. Of this the stretch has the share of its compliance, 1
    in a taut cable, 0 in a slack one. A cable moves in the air as its chord does.

    Args:
        losses: loss_time [s], and air damping [N s/m^2].
        weight_of: Gravity where cables weigh, else 0 [m/s^2].
        cables: Rows of the cable_table.
        rows: Of the cables, after `unbalance`.
        turning: Velocity of the center of mass, and angular velocity, (6,).
        now: Of the drives; what damping adds to the tensions is filled.
        wrench: Filled.
        behind: That of the model, by itself.
    """
    lost = 0.0
    for k in range(6):
        wrench[k] = 0.0
    vx, vy, vz = turning[0], turning[1], turning[2]
    wx, wy, wz = turning[3], turning[4], turning[5]
    for i in range(cables.shape[0]):
        rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
        ux, uy, uz = vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx
        x, y = rows[g.AZIMUTH_X, i] * rows[g.COSINE, i], rows[g.AZIMUTH_Y, i] * rows[g.COSINE, i]
        z, chord, length = rows[g.SINE, i], rows[g.CHORD, i], rows[t.LENGTH, i]
        stiffness, tension = cables[i, tables.STIFFNESS], rows[t.TENSION, i]
        weight = cables[i, tables.DENSITY] * weight_of * chord * rows[g.COSINE, i]
        share = 0.0
        if tension > 0.0:
            share = 1.0 / (1.0 + stiffness * weight * weight * chord / (12.0 * length * tension * tension * tension))
        strained = chord / rows[t.LENGTH if behind is None else t.FREE_LENGTH, i]
        rate = ux * x + uy * y + uz * z - now[d.RATE, i] * strained
        more = max(losses[0] * stiffness / length * share * share * rate, -tension)
        slow = losses[1] * chord / 3.0
        now[d.STRETCHING, i] = more * strained
        now[d.AT_FRAME, i] = max(now[d.PULL, i] + more, 0.0)
        lost += more * rate + slow * (ux * ux + uy * uy + uz * uz)
        add_at_end(rows, i, -more * x - slow * ux, -more * y - slow * uy, -more * z - slow * uz, wrench)
    return lost


@kernel
def take_set_points(plant: Plant, now: float, shift: float) -> None:
    """Fill the set points at a time, and the lengths of winches that keep them."""
    at, drives, rows = plant.at, plant.drives, plant.rows
    at[LENGTH_AT] = follow(plant.lengths, at[LENGTH_AT], now, shift, plant.targets, plant.target_rates)
    if drives.kind == d.IDEAL:
        for i in range(rows.shape[1]):
            held = drives.now[d.HELD, i] > 0.0
            drives.now[d.RATE, i] = 0.0 if held else plant.target_rates[i]
            if not held:
                rows[t.LENGTH, i] = plant.targets[i]


@kernel
def evaluate(plant: Plant, now: float) -> None:
    """Fill the force on the platform, -gradient, what is given of it, and the cables' tensions, at a time."""
    at, drives, rows, state = plant.at, plant.drives, plant.rows, plant.state
    weight_of = plant.model.gravity if plant.model.code == CATENARY else 0.0
    take_set_points(plant, now, -MOMENT * plant.step)
    if plant.work & LOADED:
        at[WRENCH_AT] = follow(plant.wrenches, at[WRENCH_AT], now, 0.0, plant.given, plant.spare)
    unbalance(plant.model, plant.cables, plant.body, plant.given, state, plant.rotation, rows, plant.gradient)
    if plant.work & BLOWN:
        at[WIND_AT] = follow(plant.winds, at[WIND_AT], now, 0.0, plant.before[:3], plant.spare)
        for k in range(6):
            plant.gradient[k] += plant.given[k]
        blow(plant.cables, drives.data[d.DRAG], rows, plant.before, plant.given)
        for k in range(6):
            plant.gradient[k] -= plant.given[k]
    for k in range(6):
        plant.gradient[k] = -plant.gradient[k]
    keep_free(plant.freedom, plant.gradient, plant.spare)
    pull_of_frame(weight_of, plant.cables, rows, drives.data, drives.now, plant.model.behind)


@kernel
def damp(plant: Plant) -> None:
    """Fill what damping does at the present velocities, and the powers that damping takes and given forces bring."""
    if plant.work:
        weight_of = plant.model.gravity if plant.model.code == CATENARY else 0.0
        spinning = spin(plant.state, plant.inertia)
        drives, motion = plant.drives, plant.spare
        for k in range(3):
            motion[k], motion[3 + k] = plant.state[VELOCITY + k], spinning[k]
        if plant.work & DAMPED:
            drives.audit[d.LOST_POWER] = damp_cables(
                plant.losses, weight_of, plant.cables, plant.rows, motion, drives.now, plant.damping, plant.model.behind
            )
            keep_free(plant.freedom, plant.damping, motion)
        drives.audit[d.GIVEN_POWER] = power_of(plant.given, plant.state, spinning)


@glue
def take_powers(drives: Drives, time: float) -> None:
    """Add what the powers do in a time to the audit; winches that keep their lengths feel the damping of cables."""
    power = drives.audit[d.GIVEN_POWER]
    if drives.kind != d.DRUMS:
        for i in range(drives.now.shape[1]):
            power -= drives.now[d.STRETCHING, i] * drives.now[d.RATE, i]
    drives.audit[d.SUPPLIED] += time * power
    drives.audit[d.LOST] += time * drives.audit[d.LOST_POWER]


@glue
def split_step(plant: Plant, now: float) -> None:
    """One step of the splitting from a time on; forces at hand before and after are those of the state."""
    h, half, drives, rows = plant.step, 0.5 * plant.step, plant.drives, plant.rows
    damp(plant)
    take_powers(drives, half)
    kick(plant.state, plant.inertia, plant.gradient, half)
    if plant.work & DAMPED:
        kick(plant.state, plant.inertia, plant.damping, half)
    if drives.kind == d.DRUMS:
        kick_drums(drives, half)
    elif drives.kind == d.SECOND_ORDER:
        kick_lagging(drives, rows, plant.targets, half, True)
    for i in range(rows.shape[1]):
        drives.now[d.BEFORE, i] = rows[t.LENGTH, i]
        drives.now[d.BEFORE_WHOLE, i] = drives.now[d.WHOLE, i]
        drives.now[d.BEFORE_DRUM, i] = drives.now[d.AT_DRUM, i]
    drift(plant.state, h)
    free_turn(plant.state, plant.inertia, h)
    if drives.kind == d.DRUMS:
        weight_of = plant.model.gravity if plant.model.code == CATENARY else 0.0
        turn_drums(drives, plant.cables, rows, weight_of, h)
    elif drives.kind == d.SECOND_ORDER:
        for i in range(rows.shape[1]):
            rows[t.LENGTH, i] += h * drives.now[d.RATE, i]
    evaluate(plant, now + h)
    if drives.kind == d.DRUMS:
        slip(drives, plant.cables, h)
    else:
        for i in range(rows.shape[1]):
            wound = rows[t.LENGTH, i] - drives.now[d.BEFORE, i]
            drives.audit[d.SUPPLIED] -= 0.5 * (drives.now[d.BEFORE_WHOLE, i] + drives.now[d.WHOLE, i]) * wound
    kick(plant.state, plant.inertia, plant.gradient, half)
    if plant.work & DAMPED:  # the adjoint of the first kick, by one correction
        damp(plant)
        for k in range(6):
            plant.before[k] = plant.damping[k]
        kick(plant.state, plant.inertia, plant.damping, half)
        damp(plant)
        kick(plant.state, plant.inertia, plant.before, -half)
        kick(plant.state, plant.inertia, plant.damping, half)
    if drives.kind == d.DRUMS:
        kick_drums(drives, half)
    elif drives.kind == d.SECOND_ORDER:
        kick_lagging(drives, rows, plant.targets, half, False)
    damp(plant)
    take_powers(drives, half)


@glue
def runge_kutta_step(plant: Plant, now: float) -> None:
    """One step of the classical Runge-Kutta method; forces at hand before and after are those of the state."""
    h, drives, rows, state = plant.step, plant.drives, plant.rows, plant.state
    m, lagging = rows.shape[1], drives.kind == d.SECOND_ORDER
    supplied, lost = 0.0, 0.0
    for k in range(STATE_COLUMNS):
        plant.base[k] = state[k]
        plant.total[k] = 0.0
    for i in range(m):
        plant.lengths_base[0, i], plant.lengths_base[1, i] = rows[t.LENGTH, i], drives.now[d.RATE, i]
        plant.lengths_base[2, i] = plant.lengths_base[3, i] = 0.0
    for stage in range(4):
        weight = 1.0 / 3.0 if stage == 1 or stage == 2 else 1.0 / 6.0
        ahead = 0.5 * h if stage < 2 else h
        damp(plant)
        for k in range(6):
            plant.before[k] = plant.gradient[k] + (plant.damping[k] if plant.work & DAMPED else 0.0)
        rates_of(state, plant.inertia, plant.before, plant.first)
        supplied += weight * drives.audit[d.GIVEN_POWER]
        lost += weight * drives.audit[d.LOST_POWER]
        for k in range(STATE_COLUMNS):
            plant.total[k] += weight * plant.first[k]
            state[k] = plant.base[k] + (ahead * plant.first[k] if stage < 3 else h * plant.total[k])
        for i in range(m):
            rate = drives.now[d.RATE, i]
            supplied -= weight * (drives.now[d.WHOLE, i] + drives.now[d.STRETCHING, i]) * rate
            if lagging:
                omega, ratio = drives.data[d.BANDWIDTH, i], drives.data[d.RATIO, i]
                push = omega * omega * (plant.targets[i] - rows[t.LENGTH, i]) - 2.0 * ratio * omega * rate
                if drives.now[d.HELD, i] > 0.0:
                    push = rate = 0.0
                plant.lengths_base[2, i] += weight * rate
                plant.lengths_base[3, i] += weight * push
                length = ahead * rate if stage < 3 else h * plant.lengths_base[2, i]
                speed = ahead * push if stage < 3 else h * plant.lengths_base[3, i]
                rows[t.LENGTH, i] = plant.lengths_base[0, i] + length
                drives.now[d.RATE, i] = plant.lengths_base[1, i] + speed
        if stage == 3:
            scale = 0.0
            for k in range(4):
                scale += state[TURN + k] * state[TURN + k]
            for k in range(4):
                state[TURN + k] /= math.sqrt(scale)
        evaluate(plant, now + ahead)
    drives.audit[d.SUPPLIED] += h * supplied
    drives.audit[d.LOST] += h * lost
    damp(plant)


@kernel
def note(drives: Drives, rows: Array, cables: Array, at: Indices, now: float, weight_of: float, notes: Array) -> None:
    """Keep the largest tensions, and note what begins: a cable that no longer pulls, a drive at its limit."""
    largest = 0.0
    for i in range(rows.shape[1]):
        tension = drives.now[d.AT_FRAME, i]
        drives.now[d.PEAK, i] = max(drives.now[d.PEAK, i], tension)
        largest = max(largest, tension)
        slack = not rows[t.TENSION, i] > 0.5 * cables[i, tables.DENSITY] * weight_of * rows[g.CHORD, i]
        known = drives.now[d.SLACK, i]
        drives.now[d.SLACK, i] = (d.NEW if known == d.NO else known) if slack else d.NO
    if at[NOTES] > 0:
        row = at[NOTES] - 1
        notes[row, NOTE_AFTER] = max(notes[row, NOTE_AFTER], largest)
    for i in range(rows.shape[1]):
        for kind in range(2):
            flag = d.SATURATED if kind == NOTE_SATURATED else d.SLACK
            if drives.now[flag, i] == d.NEW:
                drives.now[flag, i] = d.YES
                if at[NOTES] < notes.shape[0]:
                    row = at[NOTES]
                    notes[row, NOTE_TIME], notes[row, NOTE_KIND], notes[row, NOTE_CABLE] = now, kind, i
                    notes[row, NOTE_BEFORE], notes[row, NOTE_AFTER] = drives.now[d.PEAK, i], largest
                    at[NOTES] += 1


@kernel
def record(plant: Plant, records: Records) -> None:
    """Write down a step, and look whether energy has grown by itself."""
    states, tensions, lengths, energies, _notes = records
    state, drives, rows, at = plant.state, plant.drives, plant.rows, plant.at
    audit, row = drives.audit, at[RECORDS]
    stored, size = platform_energy(plant.model, plant.cables, plant.body, plant.none, state, plant.rotation, rows)
    kinetic, potential = kinetic_energy(state, plant.inertia), stored + audit[d.ON_DRUMS]
    for i in range(rows.shape[1]):
        if drives.kind == d.DRUMS:
            kinetic += 0.5 * drives.data[d.INERTIA, i] * drives.now[d.SPEED, i] * drives.now[d.SPEED, i]
    if at[READY] < 2:
        at[READY] = 2
        audit[d.START] = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST]
        audit[d.START_POTENTIAL] = potential
    invented = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST] - audit[d.START]
    moved = kinetic + abs(potential - audit[d.START_POTENTIAL]) + abs(audit[d.SUPPLIED]) + abs(audit[d.LOST])
    audit[d.MOVED] = max(audit[d.MOVED], moved)
    if not invented <= GROWN * audit[d.MOVED] + ROUNDING * size:
        at[FAILED] = 1
        for i in range(rows.shape[1]):
            if drives.now[d.AT_FRAME, i] > drives.now[d.AT_FRAME, at[FAILED] - 1]:
                at[FAILED] = i + 1
    if row < states.shape[0]:
        turning = spin(state, plant.inertia)
        for k in range(MOMENTUM):
            states[row, CENTER + k] = state[CENTER + k]
        for k in range(3):
            states[row, MOMENTUM + k] = turning[k]
        for i in range(rows.shape[1]):
            tensions[row, i] = drives.now[d.AT_FRAME, i]
            lengths[row, i] = rows[t.LENGTH, i]
        energies[row, KINETIC], energies[row, POTENTIAL] = kinetic, potential
        energies[row, GIVEN], energies[row, TAKEN] = audit[d.SUPPLIED], audit[d.LOST]
        at[RECORDS] += 1


@entry
def run(
    model: tuple[int, float, float, float, bool | None],
    rules: Rules,
    numbers: Numbers,
    robot: Robot,
    data: Array,
    courses: tuple[CourseArrays, CourseArrays, CourseArrays],
    kept: Kept,
    records: Records,
    steps: int,
    every: int,
) -> None:
    """Go on for some steps; a run that is ready goes on where the last call ended, bit by bit the same.

    Args:
        model: Cable model with its gravity; whether anything may be behind the cables: True, or None for never.
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
    integrator, kind, remembered, work, stride = rules
    step, loss_time, air, filtering = numbers
    state, rows, now, layers, audit, at, room = kept
    cables, body, inertia, freedom = robot
    m = rows.shape[1]
    small, place = block(room, 0, 6, 6)
    sides, place = block(room, place, 3, STATE_COLUMNS)
    wide, place = block(room, place, 4, m)
    both, place = block(room, place, 2, courses[0][1].shape[1])
    rotation, place = block(room, place, 3, 3)
    drives = Drives(kind, remembered > 0, data, now, layers, audit)
    plant = Plant(
        Model(*model),
        work,
        step,
        (loss_time, air),
        cables,
        body,
        inertia,
        freedom,
        drives,
        Course(*courses[0]),
        Course(*courses[1]),
        Course(*courses[2]),
        state,
        rows,
        at,
        rotation,
        small[0],
        small[1],
        small[2],
        small[3],
        small[4],
        small[5],
        both[0],
        both[1],
        sides[0],
        sides[1],
        sides[2],
        wide,
    )
    weight_of = plant.model.gravity if plant.model.code == CATENARY else 0.0
    if at[READY] == 0:
        at[READY] = 1
        for k in range(room.shape[0]):
            room[k] = 0.0
        evaluate(plant, audit[d.BEGIN] + at[STEPS] * step)
        take_set_points(plant, audit[d.BEGIN] + at[STEPS] * step, MOMENT * step)
        damp(plant)
        if at[STEPS] == 0:
            for i in range(m):
                now[d.FILTERED, i] = now[d.AT_FRAME, i]
        note(drives, rows, cables, at, audit[d.BEGIN] + at[STEPS] * step, weight_of, records[4])
        record(plant, records)
    elif steps == 0:
        record(plant, records)
    for _ in range(steps):
        time = audit[d.BEGIN] + at[STEPS] * step
        ends = at[LENGTH_AT] < courses[0][0].shape[0] - 1 and time + MOMENT * step >= courses[0][0][at[LENGTH_AT] + 1]
        if ends or at[RENEWED] > 0:
            at[RENEWED] = 0
            take_set_points(plant, time, MOMENT * step)  # rates may jump here
        if kind == d.DRUMS and at[STEPS] % stride == 0:
            close_loops(drives, plant.targets, plant.target_rates, stride * step)
        if integrator == SPLITTING:
            split_step(plant, time)
        else:
            runge_kutta_step(plant, time)
        at[STEPS] += 1
        for i in range(m):
            now[d.FILTERED, i] += filtering * (now[d.AT_FRAME, i] - now[d.FILTERED, i])
        note(drives, rows, cables, at, audit[d.BEGIN] + at[STEPS] * step, weight_of, records[4])
        if every > 0 and at[STEPS] % every == 0:
            record(plant, records)
            if at[FAILED] > 0:
                break
        if every > 0 and at[NOTES] + 2 * m > records[4].shape[0]:
            break
    if every == 0 and steps > 0:
        record(plant, records)

"""Drives of winches (ideal, second-order, or drum with motor, control loops and friction), and cable on the drum.

Lengths s are measured along the path of winding, and increase while cable is paid out; docs/model.md, sections 10 and
11.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.jit import formula, glue, kernel

BIN = 0.005  # length of a bin [m]: a piece of the cable on the drum that has a single strain


@kernel
def _wind_in(layer: Array, place: float, step: float, strain: float, stiffness: float) -> float:
    """Wind cable onto a drum. Returns the energy [J] lost by averaging the strain in each bin of cable."""
    # The strained and the unstrained length of the cable in a bin do not change when its strain is averaged.
    # `layer`: strain in each bin of the cable on the drum, (B,); the last bin has no end. `place`: length paid out
    # before this step [m]. `step`: length to wind in [m], > 0. `stiffness`: EA [N].
    lost = 0.0
    first, last = _bin_of(layer, place - step), _bin_of(layer, place)
    for k in range(first, last + 1):
        begin = max(place - step, k * BIN) if k > first else place - step
        middle = min(place, (k + 1) * BIN) if k < last else place
        if k == layer.shape[0] - 1:  # the last bin has no end and keeps its strain
            lost += 0.5 * stiffness * (strain - layer[k]) ** 2 * (middle - begin) / (1.0 + strain)
            continue
        new, old = (middle - begin) / (1.0 + strain), max((k + 1) * BIN - middle, 0.0) / (1.0 + layer[k])
        if new + old > 0.0:
            shared = new / (new + old)
            lost += 0.5 * stiffness * (1.0 - shared) * new * (strain - layer[k]) ** 2
            layer[k] += shared * (strain - layer[k])
    return lost


@kernel
def _pay_out(layer: Array, place: float, step: float, stiffness: float) -> tuple[float, float]:
    """Mean strain of the cable that a drum pays out, and the energy [J] that is lost by averaging."""
    # `layer`: strain in each bin of the cable on the drum, (B,); the last bin has no end. `place`: length paid out
    # before this step [m]. `step`: length to pay out [m], > 0. `stiffness`: EA [N].
    first, last = _bin_of(layer, place), _bin_of(layer, place + step)
    if first == last:
        return layer[first], 0.0
    length, strained, squares = 0.0, 0.0, 0.0
    for k in range(first, last + 1):
        begin = max(place, k * BIN) if k > first else place
        end = min(place + step, (k + 1) * BIN) if k < last else place + step
        part = (end - begin) / (1.0 + layer[k])
        length, strained, squares = length + part, strained + part * layer[k], squares + part * layer[k] * layer[k]
    mean = strained / length
    return mean, 0.5 * stiffness * (squares - mean * strained)


@formula
def _bin_of(layer: Array, place: float) -> int:
    """Index of the bin at the position `place` [m] along the cable."""
    return min(max(int(place / BIN), 0), layer.shape[0] - 1)


# kinds of winches
IDEAL, SECOND_ORDER, DRUMS = 0, 1, 2

NO, YES, NEW = 0.0, 1.0, 4.0  # NEW is added to a state that is not recorded yet
TORQUE, SPEED_BOUND = 1.0, 2.0  # states of a drive at its limits; their sum if it is at both limits

# rows of the state of the drives of m cables, (DRIVE_ROWS, m)
RATE = 0  # dL/dt of the unstrained length [m/s]
WOUND, SPEED = 1, 2  # length s paid out [m], and its rate [m/s]
# force of the motor at the cable, positive in the direction of paying out; integral part of its controller [N]
FORCE, INTEGRAL = 3, 4
AT_FRAME, WHOLE, AT_DRUM = 5, 6, 7  # frame-end tension including damping; H and drum tension without damping [N]
STRETCHING = 8  # damping part of H [N]
FILTERED = 9  # frame-end tension after the load cell's filter [N]
PEAK = 10  # largest tension at the frame end [N]
HELD, SATURATED, SLACK = 11, 12, 13  # NO or YES; SATURATED contains the limits; the last two rows also contain NEW
STORED = 14  # strain of the cable that enters or leaves the drum
BEFORE, BEFORE_WHOLE, BEFORE_DRUM = 15, 16, 17  # L, H and tension at the drum one step before
PULL = 18  # frame-end tension without damping [N]; cables without mass only
ANCHOR_X, ANCHOR_Y, ANCHOR_Z = 19, 20, 21  # velocity of the frame anchor [m/s]; cables without mass only
ANCHOR_LOSS = 22  # power of the anchor due to damping [W]
DRIVE_ROWS = 23

# rows of the parameters of the drives, (DATA_ROWS, m)
INERTIA = 0  # inertia of motor, gear and drum at the cable [kg]
FORCE_LIMIT, SPEED_LIMIT = 1, 2  # limits of the motor: force [N] and speed [m/s]
FRICTION = 3  # Coulomb friction [N]
POSITION_GAIN, SPEED_GAIN, INTEGRAL_GAIN = 4, 5, 6  # [1/s], [N s/m], [N/m]
BANDWIDTH, RATIO = 7, 8  # second-order winch: omega [rad/s], damping ratio
WINDING_STRAIN = 9  # strain of the cable on the drum
BEHIND_RISE = 10  # height of the frame end above the drum [m]
DRAG = 11  # force of the wind per length and square of the speed [N s^2/m^3]
DATA_ROWS = 12

# sums over a run [J]
SUPPLIED, LOST, ON_DRUMS, GIVEN_POWER, LOST_POWER = 0, 1, 2, 3, 4
START, START_POTENTIAL, BEGIN = 5, 6, 7  # energy at the start and its potential part [J]; time of step 0 [s]
MOVED = 8  # largest value so far of the sum of kinetic energy, change of potential energy, supplied and lost energy
AUDIT_SIZE = 9

LOOP_PERIOD = 1e-3  # [s]


class Drives(NamedTuple):
    """The drives of m cables."""

    kind: int  # IDEAL, SECOND_ORDER or DRUMS
    remembered: bool  # True if the drum stores the winding tension
    data: Array  # their parameters, (DATA_ROWS, m)
    now: Array  # their state, (DRIVE_ROWS, m)
    layers: Array  # strain of the cable on the drums, bin by bin, (m, B)
    audit: Array  # sums over the run, (AUDIT_SIZE,)


@formula
def _kick_lagging(drives: Drives, rows: Array, targets: Array, time: float, begins: bool) -> None:
    """Update the rates of second-order winches: explicitly at a step's start (`begins`), by the adjoint at its end."""
    for i in range(rows.shape[1]):
        omega, ratio = drives.data[BANDWIDTH, i], drives.data[RATIO, i]
        push = omega * omega * (targets[i] - rows[g.LENGTH, i])
        if begins:
            drives.now[RATE, i] += time * (push - 2.0 * ratio * omega * drives.now[RATE, i])
        else:
            drives.now[RATE, i] = (drives.now[RATE, i] + time * push) / (1.0 + 2.0 * ratio * omega * time)
        if drives.now[HELD, i] > 0.0:
            drives.now[RATE, i] = 0.0


@formula
def _kick_drums(drives: Drives, time: float) -> None:
    """Update the speeds of the drums by motor, cable and friction. Friction can hold a drum at rest."""
    for i in range(drives.now.shape[1]):
        inertia, before = drives.data[INERTIA, i], drives.now[SPEED, i]
        if drives.now[HELD, i] > 0.0:
            drives.audit[LOST] += 0.5 * inertia * before * before
            drives.now[SPEED, i] = 0.0
            continue
        pull = drives.now[AT_DRUM, i] + drives.now[STRETCHING, i] / (1.0 + drives.now[STORED, i])
        free = before + time * (drives.now[FORCE, i] + pull) / inertia
        most = time * drives.data[FRICTION, i] / inertia
        after = free - math.copysign(most, free) if abs(free) > most else 0.0
        mean = 0.5 * (before + after)
        drives.audit[SUPPLIED] += drives.now[FORCE, i] * time * mean
        drives.audit[LOST] += inertia * (free - after) * mean
        drives.now[SPEED, i] = after


@formula
def _fill_stored_strain(drives: Drives, cables: Array, time: float) -> None:
    """Fill the strain of the cable that the drums pay out or wind in during a step."""
    for i in range(cables.shape[0]):
        strain, lost = drives.data[WINDING_STRAIN, i], 0.0
        if drives.remembered:
            stiffness, step = cables[i, tables.STIFFNESS], time * drives.now[SPEED, i]
            if step < 0.0:
                strain = drives.now[AT_DRUM, i] / stiffness
                lost = _wind_in(drives.layers[i], drives.now[WOUND, i], -step, strain, stiffness)
            elif step > 0.0:
                strain, lost = _pay_out(drives.layers[i], drives.now[WOUND, i], step, stiffness)
        drives.now[STORED, i] = strain
        drives.audit[ON_DRUMS] -= lost
        drives.audit[LOST] += lost


@formula
def _turn_drums(drives: Drives, cables: Array, rows: Array, gravity: float, time: float) -> None:
    """Pay out or wind in cable for `time`, and update the energy of the cable on the drums."""
    _fill_stored_strain(drives, cables, time)
    for i in range(cables.shape[0]):
        step, strain = time * drives.now[SPEED, i], drives.now[STORED, i]
        rate = drives.now[SPEED, i] / (1.0 + strain)
        lifted = -cables[i, tables.DENSITY] * gravity * drives.data[BEHIND_RISE, i]
        drives.now[WOUND, i] += step
        drives.now[RATE, i] = rate
        rows[g.LENGTH, i] += time * rate
        held = 0.5 * cables[i, tables.STIFFNESS] * strain * strain + lifted
        drives.audit[ON_DRUMS] -= held * time * rate


@formula
def _add_slip_energy(drives: Drives, cables: Array, time: float) -> None:
    """Add the energy of the strain change of cable that leaves its drum to the audit. Row RATE must be filled."""
    for i in range(cables.shape[0]):
        stiffness = cables[i, tables.STIFFNESS]
        wound = stiffness * drives.now[STORED, i]
        before, after = drives.now[BEFORE_DRUM, i] - wound, drives.now[AT_DRUM, i] - wound
        square = 0.5 * (before * before + after * after)
        drives.audit[LOST] += 0.5 * square / stiffness * drives.now[RATE, i] * time


@formula
def close_loops(drives: Drives, targets: Array, rates: Array, period: float) -> None:
    """Fill the motor forces from lengths and speeds: P-PI control with anti-windup."""
    # `targets`: set points of s (m,), then the expected tensions at the drums (m,).
    m = drives.now.shape[1]
    for i in range(m):
        limit, fastest = drives.data[FORCE_LIMIT, i], drives.data[SPEED_LIMIT, i]
        wanted = drives.data[POSITION_GAIN, i] * (targets[i] - drives.now[WOUND, i]) + rates[i]
        speed = min(max(wanted, -fastest), fastest)
        error = speed - drives.now[SPEED, i]
        asked = drives.data[SPEED_GAIN, i] * error + drives.now[INTEGRAL, i] - targets[m + i]
        force = min(max(asked, -limit), limit)
        if force == asked or (asked > limit and error < 0.0) or (asked < -limit and error > 0.0):
            drives.now[INTEGRAL, i] += period * drives.data[INTEGRAL_GAIN, i] * error
        drives.now[FORCE, i] = force
        known, reached = drives.now[SATURATED, i] % NEW, NO
        if not drives.now[HELD, i] > 0.0:
            reached = (TORQUE if force != asked else 0.0) + (SPEED_BOUND if speed != wanted else 0.0)
        joined = (force != asked and known % SPEED_BOUND == NO) or (speed != wanted and known < SPEED_BOUND)
        drives.now[SATURATED, i] = reached + (NEW if joined and reached > NO else NO)


@formula
def tension_at_drum(whole: float, lifted: float, stiffness: float) -> float:
    """Tension at the drum [N]. `whole`: H at the frame end. `lifted`: weight of cable between drum and frame end."""
    fallen = whole - lifted
    return 2.0 * fallen / (1.0 + math.sqrt(max(1.0 + 2.0 * fallen / stiffness, 0.0)))


@glue
def keep_set_points(drives: Drives, rows: Array, targets: Array, rates: Array) -> None:
    """Fill lengths and rates of ideal winches, which follow their set points exactly."""
    if drives.kind == IDEAL:
        for i in range(rows.shape[1]):
            held = drives.now[HELD, i] > 0.0
            drives.now[RATE, i] = 0.0 if held else rates[i]
            if not held:
                rows[g.LENGTH, i] = targets[i]


@glue
def kick_winches(drives: Drives, rows: Array, targets: Array, time: float, begins: bool) -> None:
    """Update the speeds of all winches by forces that act for `time`. `begins` has the meaning of `_kick_lagging`."""
    if drives.kind == DRUMS:
        _kick_drums(drives, time)
    elif drives.kind == SECOND_ORDER:
        _kick_lagging(drives, rows, targets, time, begins)


@glue
def store_step_start(drives: Drives, rows: Array) -> None:
    """Store the data at the start of a step for `add_winch_energy`."""
    for i in range(rows.shape[1]):
        drives.now[BEFORE, i] = rows[g.LENGTH, i]
        drives.now[BEFORE_WHOLE, i] = drives.now[WHOLE, i]
        drives.now[BEFORE_DRUM, i] = drives.now[AT_DRUM, i]


@glue
def turn_winches(drives: Drives, cables: Array, rows: Array, gravity: float, time: float) -> None:
    """Pay out or wind in cable for `time`. Ideal winches are skipped, because they follow their set points."""
    if drives.kind == DRUMS:
        _turn_drums(drives, cables, rows, gravity, time)
    elif drives.kind == SECOND_ORDER:
        for i in range(rows.shape[1]):
            rows[g.LENGTH, i] += time * drives.now[RATE, i]


@glue
def add_winch_energy(drives: Drives, cables: Array, rows: Array, time: float) -> None:
    """Add to the energy audit the work of the winches during a step."""
    if drives.kind == DRUMS:
        _add_slip_energy(drives, cables, time)
    else:
        for i in range(rows.shape[1]):
            wound = rows[g.LENGTH, i] - drives.now[BEFORE, i]
            drives.audit[SUPPLIED] -= 0.5 * (drives.now[BEFORE_WHOLE, i] + drives.now[WHOLE, i]) * wound


@glue
def filter_tensions(drives: Drives, share: float) -> None:
    """Update the filtered tensions. `share`: weight of the new reading."""
    for i in range(drives.now.shape[1]):
        drives.now[FILTERED, i] += share * (drives.now[AT_FRAME, i] - drives.now[FILTERED, i])

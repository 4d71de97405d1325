"""Proofs that all poses of a box are wrench-feasible, or that all are infeasible; docs/model.md, section 13.

The proof of INSIDE is a formula that gives, at every pose and for every wrench of the set, balancing tensions within
the limits. The proof of OUTSIDE is one wrench of the set and a direction that depends on the pose. Along this
direction, all cables together contribute less than this wrench demands.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.factors import copy, dot, norm, solve_lower, solve_upper
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.sag_forces import Curves, new_curves
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.terms import new_cables
from sagline.kernels.inverse.poses import LimitTerms, ModelTerms, Robots, model_at
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import Triple, place_cables
from sagline.kernels.workspaces import box_tensions
from sagline.kernels.workspaces.box_tensions import (
    MOTIONS,
    CablesInBox,
    Centered,
    PoseRange,
    Ranges,
    factor_normal,
    in_wrench_space,
    most_of_linear,
    new_cables_in_box,
    norm3,
    set_cables_in_box,
    spread_of_slopes,
)
from sagline.kernels.workspaces.sag_force_bounds import fall, fall_rate, rise, rise_rate, sag_force_slope
from sagline.kernels.workspaces.wrench_set import Loads, dot6, farthest, reach_of_loads

# largest error of the pseudo-inverse; with a larger error, the pose is almost singular and the proof fails
POOREST_INVERSE = 1e-6
HEADROOM = 1.2  # size of the box of tensions in the proof, divided by the first estimate of this size
ITERATIONS = 3  # number of iterations that improve the size of the box of tensions


class Precision(NamedTuple):
    """Safety terms of the proofs; tests set them to zero."""

    bends: float  # weight of the terms of second and higher order; 1 in proofs
    rounding: float  # rounding error of a sum, relative to the sum of its terms' magnitudes


class _TensionBox(NamedTuple):
    """Work arrays of a proof of INSIDE for m cables: a box of tensions around the centered tensions."""

    inverse: Array  # weighted pseudo-inverse of the structure matrix, (m, n)
    change: Array  # change of each tension per newton of each tension, (m, m)
    hanging: Array  # change of each tension per newton of each sag force, (m, m)
    slack: Array  # distance of the tensions from their limits [N], (m,)
    sum: Array  # largest change of the tensions, without their effect on each other [N], (m,)
    trial: Array  # half edges of the box [N], (m,)
    low: Array  # smallest tensions in the box [N], (m,)
    sag_force: Array  # largest change of the sag forces [N], (m,)
    size: Array  # sum of the magnitudes in each row of the pseudo-inverse, (m,)
    weight: Array  # weights of the pseudo-inverse, (m,)


@glue
def _new_tension_box(memory: Memory, m: int, n: int) -> tuple[_TensionBox, Memory]:
    """Work arrays, and the remaining memory."""
    inverse, memory = block(memory, m, n)
    change, memory = block(memory, m, m)
    hanging, memory = block(memory, m, m)
    rows, memory = block(memory, 7, m)
    return _TensionBox(inverse, change, hanging, rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6]), memory


@kernel
def _proves_inside(
    place: CablesInBox,
    box: PoseRange,
    curves: Curves,
    loads: Loads,
    centered: Centered,
    ranges: Ranges,
    precision: Precision,
    memory: Memory,
) -> bool:
    """True if the tensions tau + J^+ z are within the limits at all poses of `box`; z is the change of the demand."""
    # centered.give is filled with the change of each tension due to the set of wrenches [N].
    n, m = place.matrix.shape
    room, memory = _new_tension_box(memory, m, n)
    slopes, memory = block(memory, MOTIONS + 2, 6)
    along, coefficients = slopes[MOTIONS], slopes[MOTIONS + 1]
    tau, slack, weight = centered.tau, room.slack, room.weight
    for i in range(m):
        slack[i] = min(tau[i] - ranges.low[i], ranges.high[i] - tau[i])
        down, up = tau[i] - centered.low[i], centered.high[i] - tau[i]
        weight[i] = 1.0 / (1.0 / (down * down) + 1.0 / (up * up))
        if not slack[i] > 0.0:
            slack[i] = 0.0
    if not factor_normal(place.matrix, weight, 0.0, centered.normal):
        return False
    spread_of_slopes(place, box, centered, ranges, slopes)
    largest = 0.0
    for k in range(n):
        largest = max(largest, _sum_of_terms(place, centered, k))
    error = _fill_inverse(place, centered.normal, room) + precision.rounding
    possible = error < POOREST_INVERSE
    reaching = 0.0
    for k in range(n):
        for i in range(m):
            reaching = max(reaching, abs(place.matrix[k, i]))
    for i in range(m):
        in_wrench_space(place.rows, room.inverse[i], along)
        for motion in range(MOTIONS):
            coefficients[motion] = dot6(slopes[motion], along)
        first = most_of_linear(box, coefficients)
        first += abs(dot(room.inverse[i], centered.left)) + precision.rounding * room.size[i] * largest
        inexact = room.size[i] * error / (1.0 - error) * reaching
        bends = _fill_changes(place, ranges, tau, along, inexact, precision.bends, room.change[i], room.hanging[i])
        most = reach_of_loads(loads, along)
        for a in range(6):
            along[a] = -along[a]
        centered.give[i] = max(most, reach_of_loads(loads, along))
        room.sum[i] = (first + precision.bends * bends + centered.give[i]) * (1.0 + precision.rounding)
        possible = possible and room.sum[i] < slack[i]
    return possible and _keeps_limits(place, curves, tau, room, precision.rounding)


@formula
def _sum_of_terms(place: CablesInBox, centered: Centered, k: int) -> float:
    """Sum of the magnitudes of the terms of the demand's residual in row `k` [N]."""
    total = abs(centered.right[k])
    for i in range(centered.tau.size):
        total += abs(place.matrix[k, i]) * centered.tau[i]
    return total


@formula
def _at_platform_end(place: CablesInBox, i: int, direction: Array) -> Triple:
    """Components of a force at the platform end of cable `i` along a `direction` (6,) of wrenches."""
    rx, ry, rz = place.lever[0, i], place.lever[1, i], place.lever[2, i]
    x = direction[0] + direction[4] * rz - direction[5] * ry
    y = direction[1] + direction[5] * rx - direction[3] * rz
    z = direction[2] + direction[3] * ry - direction[4] * rx
    return x, y, z


@glue
def _fill_inverse(place: CablesInBox, normal: Array, room: _TensionBox) -> float:
    """Fill the pseudo-inverse and the sums of its rows. Returns the norm of the error of matrix . pseudo-inverse."""
    n, m = place.matrix.shape
    for i in range(m):
        row = room.inverse[i]
        for k in range(n):
            row[k] = place.matrix[k, i]
        solve_lower(normal, row)
        solve_upper(normal, row)
        room.size[i] = 0.0
        for k in range(n):
            row[k] *= room.weight[i]
            room.size[i] += abs(row[k])
    error = 0.0
    for k in range(n):
        off = 0.0
        for j in range(n):
            total = -1.0 if j == k else 0.0
            for i in range(m):
                total += place.matrix[k, i] * room.inverse[i, j]
            off += abs(total)
        error = max(error, off)
    return error


@glue
def _fill_changes(
    place: CablesInBox,
    ranges: Ranges,
    tau: Array,
    along: Array,
    inexact: float,
    bends_weight: float,
    change: Array,
    hanging: Array,
) -> float:
    """Fill how a tension changes per newton of all tensions and sag forces. Returns its change by bends [N]."""
    # `along`: row of the pseudo-inverse as a direction of wrenches, (6,). `inexact`: error of the pseudo-inverse, per
    # newton. `bends_weight`: `Precision.bends`.
    arm = norm3(along[3], along[4], along[5])
    bends = 0.0
    for j in range(tau.size):
        x, y, z = _at_platform_end(place, j, along)
        length = norm3(x, y, z)
        bends += tau[j] * (length * place.bent[j] + arm * (place.swung[j] * place.turned[j] + place.curled[j]))
        bends += abs(ranges.sag_force[j]) * arm * place.curled[j]
        change[j] = bends_weight * (length * place.turned[j] + arm * place.swung[j]) + inexact
        hanging[j] = abs(z) + arm * place.swung[j]
    return bends


@glue
def _keeps_limits(place: CablesInBox, curves: Curves, tau: Array, room: _TensionBox, rounding: float) -> bool:
    """True if a box of tensions within the limits contains all changes that the tensions of the box cause."""
    trial, low, sag_force = room.trial, room.low, room.sag_force
    copy(room.sum, trial)
    for _ in range(ITERATIONS):
        for i in range(tau.size):
            low[i] = room.sum[i]
            for j in range(tau.size):
                low[i] += room.change[i, j] * trial[j]
        copy(low, trial)
    for i in range(tau.size):
        trial[i] = min(room.slack[i], HEADROOM * trial[i])
        low[i] = tau[i] - trial[i]
    for j in range(tau.size):
        moved = place.way[j] * sag_force_slope(curves, j, place.way[j], low[j])
        sag_force[j] = moved + trial[j] * max(fall_rate(curves, j, low[j]), rise_rate(curves, j, low[j]))
    kept = True
    for i in range(tau.size):
        total = room.sum[i]
        for j in range(tau.size):
            total += room.change[i, j] * trial[j] + room.hanging[i, j] * sag_force[j]
        kept = kept and total * (1.0 + rounding) < trial[i]
    return kept


BORNE = 0.3  # largest share of the gap that a cable between its limits may use
PIECES = 4  # number of pieces of the range below the tension; the lower end of a piece is half its upper end

# rows of the cables' contributions along a direction
VALUE, BENT, SPREAD, HANGING, HANGING_SPREAD, HANGING_BENT = 1, 2, 3, 4, 5, 6
GIVE, WORK = 0, 7  # weights of the cables, and a work row


@kernel
def _proves_outside(
    place: CablesInBox,
    box: PoseRange,
    curves: Curves,
    centered: Centered,
    ranges: Ranges,
    precision: Precision,
    memory: Memory,
) -> bool:
    """True if a direction y, which depends on the pose, separates demand and available wrenches in a box of poses."""
    # The direction is the residual of the centered tensions, with its derivatives with respect to the pose. The
    # direction is slightly corrected, so that the cables between their limits contribute zero or less.
    n, m = place.matrix.shape
    wide, memory = block(memory, 8, m)
    turns, memory = block(memory, MOTIONS, n)
    slopes, memory = block(memory, 2 * MOTIONS + 2, 6)
    vectors, memory = block(memory, 2, n)
    give, value, bend, spread, work = wide[GIVE], wide[VALUE], wide[BENT], wide[SPREAD], wide[WORK]
    full, direction = slopes[2 * MOTIONS], slopes[2 * MOTIONS + 1]
    tau, y = centered.tau, vectors[0]
    motions = MOTIONS if box.turn > 0.0 else 3
    length = norm(centered.left)
    for k in range(n):
        y[k] = centered.left[k] / length
    for i in range(m):
        along = dot(y, place.matrix[:, i])
        borne = abs(along) + BORNE * length / (centered.high[i] - centered.low[i])
        give[i] = 1.0 / (borne * borne)
    if not factor_normal(place.matrix, give, 1.0, centered.normal):
        return False
    spread_of_slopes(place, box, centered, ranges, slopes)
    in_wrench_space(place.rows, y, direction)
    for motion in range(motions):
        _turn_direction(place, centered.normal, give, direction, motion, work, turns[motion])
        in_wrench_space(place.rows, turns[motion], slopes[MOTIONS + motion])
    for attempt in range(2):
        _measure_direction(place, box, direction, slopes[MOTIONS : 2 * MOTIONS], wide)
        for i in range(m):
            bend[i] *= precision.bends
        if attempt == 1:
            break
        _correct_direction(place, centered, ranges, wide, vectors[1], y)
        in_wrench_space(place.rows, y, direction)
    gap = 0.0
    size = 0.0
    for k in range(n):
        gap += y[k] * centered.left[k]
        size += abs(y[k]) * _sum_of_terms(place, centered, k)
    for motion in range(MOTIONS):
        full[motion] = 0.0
        if motion < motions:
            full[motion] = -dot6(direction, slopes[motion])
            for k in range(n):
                full[motion] += turns[motion, k] * centered.left[k]
    gap -= most_of_linear(box, full)
    for i in range(m):
        gap -= _most_of_cable(place, curves, ranges, tau[i], i, wide)
        tension = ranges.highest[i] if ranges.highest[i] < math.inf else tau[i]
        size += tension * (abs(value[i]) + spread[i] + bend[i])
    return gap > precision.rounding * size


@glue
def _turn_direction(
    place: CablesInBox, normal: Array, give: Array, direction: Array, motion: int, work: Array, turn: Array
) -> None:
    """Fill the derivative `turn` (n,) of y with respect to a `motion`. `work` (m,) is overwritten."""
    n, m = place.matrix.shape
    columns = place.slopes[motion].reshape((6, m))
    for i in range(m):
        work[i] = dot6(columns[:, i], direction)
    for k in range(n):
        turn[k] = 0.0
        for i in range(m):
            turn[k] -= place.matrix[k, i] * give[i] * work[i]
    solve_lower(normal, turn)
    solve_upper(normal, turn)


@glue
def _correct_direction(
    place: CablesInBox, centered: Centered, ranges: Ranges, rows: Array, push: Array, y: Array
) -> None:
    """Correct `y` (n,), so that the cables between their limits contribute zero or less. `push` (n,) is overwritten."""
    n, m = place.matrix.shape
    value, bend, spread, tau = rows[VALUE], rows[BENT], rows[SPREAD], centered.tau
    push[:] = 0.0
    for i in range(m):
        if abs(value[i]) < spread[i] + bend[i]:
            goal = -bend[i] - value[i]
            width = ranges.highest[i] - ranges.lowest[i]
            goal += (
                spread[i] * ((tau[i] - ranges.lowest[i]) - (ranges.highest[i] - tau[i])) / width
                if width < math.inf
                else -spread[i]
            )
            for k in range(n):
                push[k] += place.matrix[k, i] * rows[GIVE, i] * goal
    solve_lower(centered.normal, push)
    solve_upper(centered.normal, push)
    for k in range(n):
        y[k] += push[k]


@formula
def _moment_turned(place: CablesInBox, i: int, direction: Array, motion: int) -> Triple:
    """Change of `_at_platform_end` per rad of the rotation `motion`, 3 to 5, because the lever turns."""
    rx, ry, rz = place.lever[0, i], place.lever[1, i], place.lever[2, i]
    x, y, z = direction[3], direction[4], direction[5]
    if motion == 3:
        return y * ry + z * rz, -x * ry, -x * rz
    if motion == 4:
        return -y * rx, z * rz + x * rx, -y * rz
    return -z * rx, -z * ry, x * rx + y * ry


@kernel
def _measure_direction(place: CablesInBox, box: PoseRange, direction: Array, turning: Array, rows: Array) -> None:
    """Fill the contributions along a direction, per newton of tension and of sag force, and their changes in a box."""
    # `direction`: y at the middle, (6,). `turning`: derivatives of y with respect to each motion, (MOTIONS, 6). `rows`:
    # filled for tensions, then for sag forces, with the value at the middle, the largest linear change (SPREAD), and
    # the largest deviation from the linear change (BENT).
    m = place.way.size
    motions = MOTIONS if box.turn > 0.0 else 3
    arm = norm3(direction[3], direction[4], direction[5])
    turned_arm = 0.0  # changes of the moment part of y
    square = 0.0
    for motion in range(motions):
        length = norm3(turning[motion, 3], turning[motion, 4], turning[motion, 5])
        if motion < 3:
            turned_arm += box.half[motion] * length
        else:
            square += length * length
    turned_arm += box.turn * math.sqrt(square)
    for i in range(m):
        value = dot6(direction, place.full[:, i])
        x, y, z = _at_platform_end(place, i, direction)
        leading, hanging_leading, going = 0.0, 0.0, 0.0
        square, square_value, square_hanging = 0.0, 0.0, 0.0
        for motion in range(motions):
            vx, vy, vz = _at_platform_end(place, i, turning[motion])
            if motion >= 3:
                mx, my, mz = _moment_turned(place, i, direction, motion)
                vx += mx
                vy += my
                vz += mz
            slope = place.slopes[motion]
            change = vx * place.full[0, i] + vy * place.full[1, i] + vz * place.full[2, i]
            # here only the derivative of the unit vector contributes
            change += x * slope[i] + y * slope[m + i] + z * slope[2 * m + i]
            if motion < 3:
                half = box.half[motion]
                leading += half * abs(change)
                hanging_leading += half * abs(vz)
                going += half * norm3(vx, vy, vz)
            else:
                square += vx * vx + vy * vy + vz * vz
                square_value += change * change
                square_hanging += vz * vz
        leading += box.turn * math.sqrt(square_value)
        hanging_leading += box.turn * math.sqrt(square_hanging)
        going += box.turn * math.sqrt(square)
        curled = arm * place.curled[i] + turned_arm * place.swung[i]
        rows[VALUE, i] = value
        rows[SPREAD, i] = leading
        rows[BENT, i] = norm3(x, y, z) * place.bent[i] + going * place.turned[i] + curled
        rows[HANGING, i] = z
        rows[HANGING_SPREAD, i] = hanging_leading
        rows[HANGING_BENT, i] = curled


@formula
def _most_of_run(slope: float, rate: float, most: float, width: float) -> float:
    """Largest value of t `slope` + min(t `rate`, `most`) for 0 <= t <= `width`; `rate` and `most` are >= 0."""
    if slope >= 0.0 or width == 0.0:
        return width * slope + min(rate * width, most) if width > 0.0 else 0.0
    if rate + slope <= 0.0:
        return 0.0
    turn = min(most / rate, width)
    return turn * (rate + slope)


@kernel
def _most_of_cable(place: CablesInBox, curves: Curves, ranges: Ranges, tau: float, i: int, rows: Array) -> float:
    """Upper bound in a box: growth of the contribution of cable `i` along y if its tension differs from `tau`."""
    low, high = ranges.lowest[i], ranges.highest[i]
    bend, spread, hanging = rows[BENT, i], rows[SPREAD, i], rows[HANGING, i]
    weight = abs(hanging)
    # tensions above tau; the column of the structure matrix has its largest contribution
    slope = rows[VALUE, i] + spread + bend
    if slope > 0.0 and high == math.inf:
        return math.inf
    most = fall(curves, i, tau, high) if hanging > 0.0 else rise(curves, i, tau, high)
    rate = fall_rate(curves, i, tau) if hanging > 0.0 else rise_rate(curves, i, tau)
    gain = _most_of_run(slope, weight * rate, weight * most, max(high - tau, 0.0))
    # tensions below tau, in pieces; the column has its smallest contribution
    slope = -(rows[VALUE, i] - spread + bend)
    top = tau
    largest = 0.0
    for piece in range(PIECES):
        if top <= low:
            break
        bottom = max(low, 0.5 * top) if piece < PIECES - 1 else low
        most = rise(curves, i, bottom, tau) if hanging > 0.0 else fall(curves, i, bottom, tau)
        largest = max(largest, most)
        if piece == 0:
            rate = rise_rate(curves, i, bottom) if hanging > 0.0 else fall_rate(curves, i, bottom)
            gain = max(gain, _most_of_run(slope, weight * rate, weight * most, tau - bottom))
        else:
            gain = max(gain, max((tau - top) * slope, (tau - bottom) * slope) + weight * most)
        top = bottom
    largest = max(largest, fall(curves, i, low, tau), rise(curves, i, low, tau), rise(curves, i, tau, high))
    if high < math.inf:
        largest = max(largest, fall(curves, i, tau, high))
    moved = place.way[i] * sag_force_slope(curves, i, place.way[i], low)
    gain += tau * bend + weight * moved + (rows[HANGING_SPREAD, i] + rows[HANGING_BENT, i]) * (largest + moved)
    return gain + abs(ranges.sag_force[i]) * rows[HANGING_BENT, i]


OPEN, INSIDE, OUTSIDE = 0, 1, 2  # verdicts
BOX_COLUMNS = 11  # pose row, half edges, turn
ATTEMPTS = 3  # alternating computations of the tensions and of their limits, which the set of wrenches narrows

LoadTerms = tuple[Array, Array, Array, Array, Indices]  # Loads
PrecisionTerms = tuple[float, float]  # Precision


def memory_for_proofs(cables: int) -> tuple[Array, Indices]:
    """Work arrays of the proofs, for a number of cables."""
    return np.empty(14 * cables * cables + 500 * cables + 800), np.empty(10 * cables + 40, dtype=np.int64)


@entry
def prove_boxes(
    model_terms: ModelTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    load_terms: LoadTerms,
    boxes: Array,
    precision_terms: PrecisionTerms,
    memory: tuple[Array, Indices],
    answers: tuple[Codes, Codes],
) -> None:
    """Try to prove for each of N boxes that all its poses are wrench-feasible, or that all are infeasible."""
    # model_terms: Cable model: code, k_h, k_p.
    # limit_terms: Limits of the tensions: `TensionLimits`.
    # robot_terms: Rows that select the free motions, (n, 6); body_table (1, BODY_COLUMNS); cable_table, (1, m,
    #   CABLE_COLUMNS), of a robot without pulleys.
    # load_terms: The wrenches to balance: `Loads`.
    # boxes: Rows: pose at the middle, half edges [m], largest rotation from the middle [rad], (N, BOX_COLUMNS).
    # precision_terms: `Precision`.
    # memory: `proof_memory` for the number of cables.
    # answers: Filled with OPEN, INSIDE or OUTSIDE, (N,); and a work array of statuses, (m,).
    limits, loads, precision = TensionLimits(*limit_terms), Loads(*load_terms), Precision(*precision_terms)
    freedom, bodies, robots = robot_terms
    verdicts, statuses = answers
    body, robot = bodies[0], robots[0]
    n, m = freedom.shape[0], robot.shape[0]
    model = model_at(model_terms, body)
    cables, rest = new_cables(Memory(*memory), m, False)
    place, rest = new_cables_in_box(rest, m, n)
    centered, rest = box_tensions.new_centered(rest, m, n)
    curves, rest = new_curves(model, cables, statuses, rest)
    rows, rest = block(rest, g.GEOMETRY_ROWS + 6, m)
    small, rest = block(rest, 6, 6)
    geometry, spans = rows[: g.GEOMETRY_ROWS], rows[g.GEOMETRY_ROWS :]
    ranges, taken = box_tensions.Ranges(spans[0], spans[1], spans[2], spans[3], spans[4]), spans[5]
    rotation, center, wrench, direction = small[:3, :3], small[3, :3], small[4], small[5]
    several = loads.segments.shape[0] + loads.ellipsoids.shape[0] + loads.sizes.size > 0
    copy(body[tables.CENTER_X : tables.CENTER_X + 3], center)
    for p in range(boxes.shape[0]):
        verdicts[p] = OPEN
        box = PoseRange(boxes[p, 7:10], boxes[p, 10])
        cable_geometry(robot, body, boxes[p], rotation, geometry)
        placed = place_cables(model, limits, robot, geometry, cables)
        if not (placed and set_cables_in_box(freedom, geometry, rotation, center, box, place)):
            continue
        box_tensions.set_ranges(limits.quantity, place, curves, ranges)
        size = _tighten_by_load(freedom, body, loads, place, curves, direction, ranges)
        copy(loads.center, wrench)
        taken[:] = 0.0
        if not box_tensions.search_limits(ranges, taken, size, centered):
            continue
        outside = box_tensions.center_tensions(place, curves, geometry, body, wrench, centered, ranges)
        beyond = outside  # of the last search, whose limits the set of wrenches narrows
        for _ in range(0 if outside else ATTEMPTS if several else 1):
            if _proves_inside(place, box, curves, loads, centered, ranges, precision, rest):
                verdicts[p] = INSIDE
                break
            if beyond:
                break
            if several:
                copy(centered.give, taken)
                box_tensions.search_limits(ranges, taken, size, centered)
                beyond = box_tensions.center_tensions(place, curves, geometry, body, wrench, centered, ranges)
        if several and verdicts[p] == OPEN:
            box_tensions.in_wrench_space(place.rows, centered.left, direction)
            farthest(loads, direction, wrench)
            taken[:] = 0.0
            box_tensions.search_limits(ranges, taken, size, centered)
            outside = box_tensions.center_tensions(place, curves, geometry, body, wrench, centered, ranges)
        if outside and _proves_outside(place, box, curves, centered, ranges, precision, rest):
            verdicts[p] = OUTSIDE


@glue
def _tighten_by_load(
    freedom: Array,
    body: Array,
    loads: Loads,
    place: CablesInBox,
    curves: Curves,
    direction: Array,
    ranges: box_tensions.Ranges,
) -> float:
    """Reduce the largest tensions to the values that the load can cause. Returns the sum of all forces [N]."""
    # `direction` (6,) is overwritten.
    direction[:] = 0.0
    direction[2] = 1.0
    upward = body[tables.MASS] * body[tables.GRAVITY] - loads.center[2] + reach_of_loads(loads, direction)
    box_tensions.tighten(freedom, place, curves, upward, ranges)
    size = abs(upward)
    for a in range(6):
        size += abs(loads.center[a])
    for i in range(ranges.low.size):
        size += ranges.low[i] + curves.cables.half_weight[i]
    return size

"""Proofs for a box of poses: tensions within the limits, or a direction that separates demand and cable wrenches."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.algebra.factors import solve_lower, solve_upper
from sagline.kernels.cable.sag_forces import Curves
from sagline.kernels.jit import formula, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.workspaces.box_tensions import Centered, Ranges, factor_normal, in_wrench_space, spread_of_slopes
from sagline.kernels.workspaces.pose_box import MOTIONS, CablesInBox, PoseRange, most_of_linear, norm3
from sagline.kernels.workspaces.sag_force_bounds import fall, fall_rate, rise, rise_rate, sag_force_slope
from sagline.kernels.workspaces.wrench_set import Loads, dot6, reach_of_loads

# largest error of the pseudo-inverse; with a larger error, the pose is almost singular and the proof fails
POOREST_INVERSE = 1e-6
HEADROOM = 1.2  # size of the box of tensions in the proof, divided by the first estimate of this size
ITERATIONS = 3  # number of iterations that improve the size of the box of tensions


class Precision(NamedTuple):
    """Safety terms of the proofs; tests set them to zero."""

    bends: float  # weight of the terms of second and higher order; 1 in proofs
    rounding: float  # rounding error of a sum, relative to the sum of its terms' magnitudes


@kernel
def proves_inside(
    place: CablesInBox,
    box: PoseRange,
    curves: Curves,
    loads: Loads,
    centered: Centered,
    ranges: Ranges,
    precision: Precision,
    memory: Memory,
) -> bool:
    """True if the tensions tau + J^+ z are within the limits at all poses of `box`; z is the change of the demand.

    centered.give is filled with the change of each tension due to the set of wrenches [N].
    """
    n, m = place.matrix.shape
    inverse, memory = block(memory, m, n)
    change, memory = block(memory, m, m)
    hanging, memory = block(memory, m, m)
    rows, memory = block(memory, 7, m)
    slopes, memory = block(memory, MOTIONS + 2, 6)
    slack, sum_, trial, low, sag_force, size, weight = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6]
    along, coefficients = slopes[MOTIONS], slopes[MOTIONS + 1]
    tau = centered.tau
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
        numbers = abs(centered.right[k])
        for i in range(m):
            numbers += abs(place.matrix[k, i]) * tau[i]
        largest = max(largest, numbers)
    for i in range(m):
        row = inverse[i]
        for k in range(n):
            row[k] = place.matrix[k, i]
        solve_lower(centered.normal, row)
        solve_upper(centered.normal, row)
        size[i] = 0.0
        for k in range(n):
            row[k] *= weight[i]
            size[i] += abs(row[k])
    error = 0.0
    reaching = 0.0
    for k in range(n):
        off = 0.0
        for j in range(n):
            total = -1.0 if j == k else 0.0
            for i in range(m):
                total += place.matrix[k, i] * inverse[i, j]
            off += abs(total)
        error = max(error, off)
    for k in range(n):
        for i in range(m):
            reaching = max(reaching, abs(place.matrix[k, i]))
    error += precision.rounding
    possible = error < POOREST_INVERSE
    for i in range(m):
        in_wrench_space(place.rows, inverse[i], along)
        for motion in range(MOTIONS):
            coefficients[motion] = dot6(slopes[motion], along)
        first = most_of_linear(box, coefficients)
        left = 0.0
        for k in range(n):
            left += inverse[i, k] * centered.left[k]
        first += abs(left) + precision.rounding * size[i] * largest
        arm = norm3(along[3], along[4], along[5])
        bends = 0.0
        inexact = size[i] * error / (1.0 - error) * reaching
        for j in range(m):
            x = along[0] + along[4] * place.lever[2, j] - along[5] * place.lever[1, j]
            y = along[1] + along[5] * place.lever[0, j] - along[3] * place.lever[2, j]
            z = along[2] + along[3] * place.lever[1, j] - along[4] * place.lever[0, j]
            length = norm3(x, y, z)
            bends += tau[j] * (length * place.bent[j] + arm * (place.swung[j] * place.turned[j] + place.curled[j]))
            bends += abs(ranges.sag_force[j]) * arm * place.curled[j]
            change[i, j] = precision.bends * (length * place.turned[j] + arm * place.swung[j]) + inexact
            hanging[i, j] = abs(z) + arm * place.swung[j]
        most = reach_of_loads(loads, along)
        for a in range(6):
            along[a] = -along[a]
        centered.give[i] = max(most, reach_of_loads(loads, along))
        sum_[i] = (first + precision.bends * bends + centered.give[i]) * (1.0 + precision.rounding)
        possible = possible and sum_[i] < slack[i]
    if not possible:
        return False
    for i in range(m):
        trial[i] = sum_[i]
    for _ in range(ITERATIONS):
        for i in range(m):
            low[i] = sum_[i]
            for j in range(m):
                low[i] += change[i, j] * trial[j]
        for i in range(m):
            trial[i] = low[i]
    for i in range(m):
        trial[i] = min(slack[i], HEADROOM * trial[i])
        low[i] = tau[i] - trial[i]
    for j in range(m):
        moved = place.way[j] * sag_force_slope(curves, j, place.way[j], low[j])
        sag_force[j] = moved + trial[j] * max(fall_rate(curves, j, low[j]), rise_rate(curves, j, low[j]))
    for i in range(m):
        total = sum_[i]
        for j in range(m):
            total += change[i, j] * trial[j] + hanging[i, j] * sag_force[j]
        possible = possible and total * (1.0 + precision.rounding) < trial[i]
    return possible


BORNE = 0.3  # largest share of the gap that a cable between its limits may use
PIECES = 4  # number of pieces of the range below the tension; the lower end of a piece is half its upper end

# rows of the cables' contributions along a direction
VALUE, BENT, SPREAD, HANGING, HANGING_SPREAD, HANGING_BENT = 1, 2, 3, 4, 5, 6


@kernel
def proves_outside(
    place: CablesInBox,
    box: PoseRange,
    curves: Curves,
    smoothing: float,
    centered: Centered,
    ranges: Ranges,
    precision: Precision,
    memory: Memory,
) -> bool:
    """True if a direction y, which depends on the pose, separates demand and available wrenches in a box of poses.

    The direction is the residual of the centered tensions, with its derivatives with respect to the pose. The direction
    is slightly corrected, so that the cables between their limits contribute zero or less.
    """
    n, m = place.matrix.shape
    wide, memory = block(memory, 7 + MOTIONS, m)
    turns, memory = block(memory, MOTIONS, n)
    slopes, memory = block(memory, 2 * MOTIONS + 2, 6)
    vectors, memory = block(memory, 2, n)
    give, value, bend, spread = wide[0], wide[1], wide[2], wide[3]
    each = wide[7:]
    full, direction = slopes[2 * MOTIONS], slopes[2 * MOTIONS + 1]
    tau, y = centered.tau, vectors[0]
    motions = MOTIONS if box.turn > 0.0 else 3
    length = 0.0
    for k in range(n):
        length += centered.left[k] * centered.left[k]
    length = math.sqrt(length)
    for k in range(n):
        y[k] = centered.left[k] / length
    for i in range(m):
        along = 0.0
        for k in range(n):
            along += y[k] * place.matrix[k, i]
        borne = abs(along) + BORNE * length / (centered.high[i] - centered.low[i])
        give[i] = 1.0 / (borne * borne)
    if not factor_normal(place.matrix, give, 1.0, centered.normal):
        return False
    spread_of_slopes(place, box, centered, ranges, slopes)
    in_wrench_space(place.rows, y, direction)
    for motion in range(motions):
        columns = place.slopes[motion].reshape((6, m))
        for i in range(m):
            each[motion, i] = 0.0
            for a in range(6):
                each[motion, i] += columns[a, i] * direction[a]
        turn = turns[motion]
        for k in range(n):
            turn[k] = 0.0
            for i in range(m):
                turn[k] -= place.matrix[k, i] * give[i] * each[motion, i]
        solve_lower(centered.normal, turn)
        solve_upper(centered.normal, turn)
        in_wrench_space(place.rows, turn, slopes[MOTIONS + motion])
    for attempt in range(2):
        _measure_direction(place, box, direction, slopes[MOTIONS : 2 * MOTIONS], wide)
        for i in range(m):
            bend[i] *= precision.bends
        if attempt == 1:
            break
        push = vectors[1]
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
                    push[k] += place.matrix[k, i] * give[i] * goal
        solve_lower(centered.normal, push)
        solve_upper(centered.normal, push)
        for k in range(n):
            y[k] += push[k]
        in_wrench_space(place.rows, y, direction)
    gap = 0.0
    size = 0.0
    for k in range(n):
        gap += y[k] * centered.left[k]
        numbers = abs(centered.right[k])
        for i in range(m):
            numbers += abs(place.matrix[k, i]) * tau[i]
        size += abs(y[k]) * numbers
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


@kernel
def _measure_direction(place: CablesInBox, box: PoseRange, direction: Array, turning: Array, rows: Array) -> None:
    """Fill the contributions along a direction, per newton of tension and of sag force, and their changes in a box.

    `direction`: y at the middle, (6,). `turning`: derivatives of y with respect to each motion, (MOTIONS, 6). `rows`:
    filled for tensions, then for sag forces, with the value at the middle, the largest linear change (SPREAD), and the
    largest deviation from the linear change (BENT).
    """
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
        rx, ry, rz = place.lever[0, i], place.lever[1, i], place.lever[2, i]
        value = 0.0
        for a in range(6):
            value += direction[a] * place.full[a, i]
        x = direction[0] + direction[4] * rz - direction[5] * ry
        y = direction[1] + direction[5] * rx - direction[3] * rz
        z = direction[2] + direction[3] * ry - direction[4] * rx
        leading, hanging_leading, going = 0.0, 0.0, 0.0
        square, square_value, square_hanging = 0.0, 0.0, 0.0
        for motion in range(motions):
            turn = turning[motion]
            vx = turn[0] + turn[4] * rz - turn[5] * ry
            vy = turn[1] + turn[5] * rx - turn[3] * rz
            vz = turn[2] + turn[3] * ry - turn[4] * rx
            if motion == 3:
                vx += direction[4] * ry + direction[5] * rz
                vy -= direction[3] * ry
                vz -= direction[3] * rz
            elif motion == 4:
                vx -= direction[4] * rx
                vy += direction[5] * rz + direction[3] * rx
                vz -= direction[4] * rz
            elif motion == 5:
                vx -= direction[5] * rx
                vy -= direction[5] * ry
                vz += direction[3] * rx + direction[4] * ry
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

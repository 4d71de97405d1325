"""Tensions for a box of poses: limits that apply at all poses of the box, and centered tensions at its middle.

Centered tensions minimize a sum of two terms. The first term is the smoothing times the sum over cables of -log(tau -
low) - log(high - tau). The second term is half the squared residual of the demand. If the demand is feasible, the
tensions are near the analytic center. If not, the residual points along the direction that separates the demand from
all wrenches of the cables. The error of the direction is of the order of the square root of the smoothing. The method
takes primal-dual Newton steps. Each step solves a linear system with one unknown per free motion of the platform.

Along each axis, a position in a box is at most half an edge from the middle of the box. At each position, the box
contains all orientations that differ from the orientation at the middle by a rotation up to a given angle. If the angle
is zero, all poses have the same orientation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import dot, factor_positive, solve_lower, solve_upper
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.sag_forces import Curves, sag_forces_at
from sagline.kernels.cable.states import is_limited_by_strain, least_of_sag
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import fill_structure_matrix, is_rotation, rows_along_freedom
from sagline.kernels.workspaces.sag_force_bounds import has_sag, largest_sag_force, sag_force_slope

BEND = 0.57735027  # half of 2/sqrt(3), rounded up; 2/sqrt(3) is the largest second derivative of x/|x|, times |x|^2
MOTIONS = 6  # number of motions: three translations and three rotations


class PoseRange(NamedTuple):
    """A box of poses."""

    half: Array  # half edges [m], (3,)
    turn: float  # largest rotation from the orientation at the middle [rad]


class CablesInBox(NamedTuple):
    """Cables at the middle of a box of poses, and bounds of their changes in the box."""

    rows: Array  # free motions, with rotations per lever arm, so that all components are in newtons, (n, 6)
    full: Array  # structure matrix, (6, m)
    matrix: Array  # components of the structure matrix along the free motions, (n, m)
    lever: Array  # levers from center of mass to platform end, world axes [m], (3, m)
    slopes: Array  # derivatives of the structure matrix with respect to each motion, (MOTIONS, 6 * m)
    way: Array  # largest displacement of a platform end [m], (m,)
    turned: Array  # largest change of a unit vector, (m,)
    bent: Array  # largest deviation of a unit vector from the linear prediction, (m,)
    swung: Array  # largest change of a lever [m], (m,)
    curled: Array  # largest deviation of a lever from the linear prediction [m], (m,)


@glue
def new_cables_in_box(memory: Memory, m: int, n: int) -> tuple[CablesInBox, Memory]:
    """Work arrays for m cables and n free motions, and the remaining memory."""
    rows, memory = block(memory, n, 6)
    wide, memory = block(memory, 6 + n + 3 + 5, m)
    slopes, memory = block(memory, MOTIONS, 6 * m)
    spans = wide[9 + n :]
    place = CablesInBox(
        rows, wide[:6], wide[6 : 6 + n], wide[6 + n : 9 + n], slopes, spans[0], spans[1], spans[2], spans[3], spans[4]
    )
    return place, memory


@kernel
def set_cables_in_box(
    freedom: Array, geometry: Array, rotation: Array, center: Array, box: PoseRange, place: CablesInBox
) -> bool:
    """Fill `place` from the geometry of the cables. False if a platform end may meet its frame end in the box."""
    # `freedom`: rows that select the free motions, (n, 6). `geometry`: rows of `cable_geometry` at the middle,
    # (GEOMETRY_ROWS, m). `rotation`: platform -> world at the middle, (3, 3). `center`: center of mass in the platform
    # frame [m], (3,). `place`: filled.
    n, m = place.matrix.shape
    fill_structure_matrix(geometry, place.full)
    mean = 0.0
    for i in range(m):
        for k in range(3):
            place.lever[k, i] = geometry[g.LEVER_X + k, i]
        mean += norm3(place.lever[0, i], place.lever[1, i], place.lever[2, i]) / m
    for k in range(n):
        unit = 1.0 / mean if is_rotation(freedom, k) and mean > 0.0 else 1.0
        for a in range(6):
            place.rows[k, a] = freedom[k, a] * unit
    rows_along_freedom(place.rows, place.full, place.matrix)
    if n == 6:
        for k in range(6):
            for i in range(m):
                place.matrix[k, i] = place.rows[k, k] * place.full[k, i]
    straight = norm3(box.half[0], box.half[1], box.half[2])
    possible = True
    for i in range(m):
        arm = 0.0
        for k in range(3):
            offset = place.lever[k, i]
            for j in range(3):
                offset += rotation[k, j] * center[j]
            arm += offset * offset
        lever = norm3(place.lever[0, i], place.lever[1, i], place.lever[2, i])
        chord = geometry[g.CHORD, i]
        way = straight + box.turn * math.sqrt(arm)
        least = chord - way
        possible = possible and least > 0.0
        share = min(way / chord, 1.0)
        place.way[i] = way
        place.turned[i] = share / math.sqrt(0.5 + 0.5 * math.sqrt(1.0 - share * share))
        place.bent[i] = BEND * way * way / (least * least) + 0.5 * box.turn * box.turn * math.sqrt(arm) / chord
        place.swung[i] = box.turn * lever
        place.curled[i] = 0.5 * box.turn * box.turn * lever
    if possible:
        _set_slopes(geometry, rotation, center, box, place)
    return possible


@kernel
def _set_slopes(geometry: Array, rotation: Array, center: Array, box: PoseRange, place: CablesInBox) -> None:
    """Fill the derivatives of the structure matrix with respect to the motions."""
    m = place.way.size
    for motion in range(MOTIONS if box.turn > 0.0 else 3):
        slopes = place.slopes[motion].reshape((6, m))
        for i in range(m):
            x, y, z = place.full[0, i], place.full[1, i], place.full[2, i]
            rx, ry, rz = place.lever[0, i], place.lever[1, i], place.lever[2, i]
            bx = by = bz = 0.0  # displacement of the platform end
            sx = sy = sz = 0.0  # displacement of the end of the lever
            if motion == 0:
                bx = 1.0
            elif motion == 1:
                by = 1.0
            elif motion == 2:
                bz = 1.0
            else:
                ax = rx + rotation[0, 0] * center[0] + rotation[0, 1] * center[1] + rotation[0, 2] * center[2]
                ay = ry + rotation[1, 0] * center[0] + rotation[1, 1] * center[1] + rotation[1, 2] * center[2]
                az = rz + rotation[2, 0] * center[0] + rotation[2, 1] * center[1] + rotation[2, 2] * center[2]
                if motion == 3:
                    by, bz, sy, sz = -az, ay, -rz, ry
                elif motion == 4:
                    bx, bz, sx, sz = az, -ax, rz, -rx
                else:
                    bx, by, sx, sy = -ay, ax, -ry, rx
            along = x * bx + y * by + z * bz
            chord = geometry[g.CHORD, i]
            dx, dy, dz = (x * along - bx) / chord, (y * along - by) / chord, (z * along - bz) / chord
            slopes[0, i] = dx
            slopes[1, i] = dy
            slopes[2, i] = dz
            slopes[3, i] = ry * dz - rz * dy + sy * z - sz * y
            slopes[4, i] = rz * dx - rx * dz + sz * x - sx * z
            slopes[5, i] = rx * dy - ry * dx + sx * y - sy * x


@formula
def norm3(x: float, y: float, z: float) -> float:
    """Length of the vector (x, y, z)."""
    return math.sqrt(x * x + y * y + z * z)


@formula
def most_of_linear(box: PoseRange, slopes: Array) -> float:
    """Largest value in `box` of a linear function that is zero at the middle and has the slopes `slopes` (MOTIONS,)."""
    most = abs(slopes[0]) * box.half[0] + abs(slopes[1]) * box.half[1] + abs(slopes[2]) * box.half[2]
    if box.turn > 0.0:
        most += box.turn * norm3(slopes[3], slopes[4], slopes[5])
    return most


STEPS = 40
REDUCTION = 0.1  # smallest factor by which a step reduces the smoothing
TO_LIMIT = 0.95  # largest step, relative to the distance to a limit
# largest relative error of slack times barrier force at the center; proofs are valid at any error
CENTERED = 0.2
FARTHEST = 50.0  # upper end of the search for a tension without limit, relative to the sum of all forces


class Centered(NamedTuple):
    """State of the search, for m cables and n rows."""

    low: Array  # limits of the tensions [N], (m,)
    high: Array  # upper limits of the tensions [N], (m,), finite
    tau: Array  # tensions, strictly inside, (m,)
    below: Array  # barrier forces of the lower limits [N], (m,), > 0
    above: Array  # barrier forces of the upper limits [N], (m,), > 0
    give: Array  # for each tension, inverse of the second derivative of the barrier, (m,)
    right: Array  # demand on the chord tensions [N], (n,)
    left: Array  # residual of the demand, (n,)
    normal: Array  # work array, (n, n)
    vector: Array  # work array, (n,)


@glue
def new_centered(memory: Memory, m: int, n: int) -> tuple[Centered, Memory]:
    """Work arrays for `m` cables and `n` rows, without tensions yet, and the remaining memory."""
    wide, memory = block(memory, 6, m)
    thin, memory = block(memory, 3 + n, n)
    centered = Centered(wide[0], wide[1], wide[2], wide[3], wide[4], wide[5], thin[0], thin[1], thin[3:], thin[2])
    centered.tau[0] = math.nan
    return centered, memory


@kernel
def _fill_imbalance(matrix: Array, centered: Centered) -> float:
    """Fill the residual of the demand at the present tensions. Returns the square of the residual's length [N^2]."""
    n, m = matrix.shape
    square = 0.0
    for k in range(n):
        centered.left[k] = centered.right[k]
        for i in range(m):
            centered.left[k] -= matrix[k, i] * centered.tau[i]
        square += centered.left[k] * centered.left[k]
    return square


@kernel
def _start_centering(matrix: Array, smoothing: float, centered: Centered) -> None:
    """Start from the previous tensions if they are between the limits, else from the middle of the limits."""
    m = centered.tau.size
    known = not math.isnan(centered.tau[0])
    for i in range(m):
        room = centered.high[i] - centered.low[i]
        slack = 0.01 * room
        if not known or not centered.low[i] + slack < centered.tau[i] < centered.high[i] - slack:
            centered.tau[i] = min(max(centered.tau[i], centered.low[i] + slack), centered.high[i] - slack)
            if not known:
                centered.tau[i] = centered.low[i] + 0.5 * room
    square = max(_fill_imbalance(matrix, centered) / m, smoothing)
    for i in range(m):
        centered.below[i] = square / (centered.tau[i] - centered.low[i])
        centered.above[i] = square / (centered.high[i] - centered.tau[i])


@kernel
def factor_normal(matrix: Array, give: Array, unit: float, normal: Array) -> bool:
    """Fill the Cholesky factor of `unit` * 1 + matrix give matrix^T, (n, n). False if this is not positive definite."""
    n, m = matrix.shape
    for k in range(n):
        for j in range(k + 1):
            total = unit if j == k else 0.0
            for i in range(m):
                total += matrix[k, i] * give[i] * matrix[j, i]
            normal[k, j] = total
    return factor_positive(normal, 0.0, normal)


@kernel
def _find_center(matrix: Array, smoothing: float, centered: Centered) -> float:
    """Move the tensions to the smoothed center. Returns the square of the remaining residual [N^2]."""
    # `matrix`: structure matrix, all rows in newtons, (n, m). `smoothing`: [N^2], > 0. `centered`: contains limits and
    # right side; the other fields are filled.
    n, m = matrix.shape
    tau, low, high, below, above = centered.tau, centered.low, centered.high, centered.below, centered.above
    _start_centering(matrix, smoothing, centered)
    square = _fill_imbalance(matrix, centered)
    for _ in range(STEPS):
        present = 0.0
        worst = 0.0
        for i in range(m):
            down, up = below[i] * (tau[i] - low[i]), above[i] * (high[i] - tau[i])
            present += (down + up) / (2 * m)
            worst = max(worst, abs(down - smoothing), abs(up - smoothing))
        unbalanced = 0.0
        for i in range(m):
            push = below[i] - above[i]
            for k in range(n):
                push += matrix[k, i] * centered.left[k]
            unbalanced = max(unbalanced, abs(push) / (below[i] + above[i]))
        if worst <= CENTERED * smoothing and unbalanced <= CENTERED:
            break
        goal = max(smoothing, REDUCTION * present) if present > smoothing else smoothing
        for i in range(m):
            centered.give[i] = 1.0 / (below[i] / (tau[i] - low[i]) + above[i] / (high[i] - tau[i]))
        if not factor_normal(matrix, centered.give, 1.0, centered.normal):
            break
        for k in range(n):
            centered.vector[k] = centered.left[k]
            for i in range(m):
                force = goal / (tau[i] - low[i]) - goal / (high[i] - tau[i])
                centered.vector[k] -= matrix[k, i] * centered.give[i] * force
        solve_lower(centered.normal, centered.vector)
        solve_upper(centered.normal, centered.vector)
        share = 1.0
        dual_share = 1.0
        for i in range(m):
            down, up = tau[i] - low[i], high[i] - tau[i]
            step = goal / down - goal / up
            for k in range(n):
                step += matrix[k, i] * centered.vector[k]
            step *= centered.give[i]
            centered.give[i] = step
            if step < 0.0:
                share = min(share, -TO_LIMIT * down / step)
            elif step > 0.0:
                share = min(share, TO_LIMIT * up / step)
            fall = below[i] * (1.0 + step / down) - goal / down
            if fall > 0.0:
                dual_share = min(dual_share, TO_LIMIT * below[i] / fall)
            fall = above[i] * (1.0 - step / up) - goal / up
            if fall > 0.0:
                dual_share = min(dual_share, TO_LIMIT * above[i] / fall)
        for i in range(m):
            down, up, step = tau[i] - low[i], high[i] - tau[i], centered.give[i]
            below[i] += dual_share * (goal / down - below[i] * (1.0 + step / down))
            above[i] += dual_share * (goal / up - above[i] * (1.0 - step / up))
            tau[i] += share * step
        square = _fill_imbalance(matrix, centered)
    return square


SMOOTHNESS = 0.01  # size of the residual due to smoothing, relative to the change of the demand in a box
SLACK = 0.45  # up to this X, a frame-end limit changes at most as fast as the sag force
# smallest range of the search after the set of wrenches is subtracted, relative to the full range
LEAST_WIDTH = 0.05
ITERATIONS = 2  # number of alternating computations of tensions and sag forces
BEYOND = 2.0  # smoothing per cable; a demand whose residual is larger is infeasible
LEAST_WAY = 1e-4  # smallest displacement, relative to a chord, from which the smoothing is computed


class Ranges(NamedTuple):
    """Admissible chord tensions for all poses of a box [N]."""

    low: Array  # largest value of the smallest admissible tension in the box, (m,), for proofs of feasibility
    high: Array  # smallest value of the largest admissible tension, for proofs of feasibility; may be infinite
    lowest: Array  # smallest value of the smallest admissible tension, for proofs of infeasibility
    highest: Array  # largest value of the largest admissible tension, or a bound from the load; may be infinite
    sag_force: Array  # sag forces at the centered tensions


@kernel
def set_ranges(quantity: int, place: CablesInBox, curves: Curves, ranges: Ranges) -> None:
    """Fill the admissible tensions of all poses of a box from the admissible tensions at its middle."""
    # The smallest tension that the limit of the sag admits increases with the length of the chord.
    cables = curves.cables
    for i in range(place.way.size):
        low, high = cables.low[i], cables.high[i]
        ranges.low[i] = ranges.lowest[i] = low
        ranges.high[i] = ranges.highest[i] = high
        floor = least_of_sag(curves.model, cables.half_weight[i])
        share = place.way[i] / cables.chord[i]
        if quantity != codes.LIMITS_OF_CHORD and has_sag(curves, i):
            _move_limits(place, curves, i, ranges)
        elif not low > floor:
            ranges.lowest[i] = 0.0
        ranges.low[i] = max(ranges.low[i], floor * (1.0 + share))
        ranges.lowest[i] = max(ranges.lowest[i], floor * (1.0 - share))


@kernel
def _move_limits(place: CablesInBox, curves: Curves, i: int, ranges: Ranges) -> None:
    """Widen or narrow the chord limits by the largest change of the limits from the middle to any pose of the box."""
    # If a cable is not slack, a limit changes at most as fast as the sag force. If a cable may be slack at a limit
    # somewhere in the box, this limit is replaced: in proofs of feasibility by the smallest chord tension at which the
    # cable is not slack, and in proofs of infeasibility by 0 N. If a cable has no admissible tension at the middle, it
    # is slack at any admissible tension elsewhere in the box.
    cables = curves.cables
    way = place.way[i]
    tight = cables.half_weight[i] * (1.0 + way / cables.chord[i]) / SLACK
    low, high = cables.low[i], cables.high[i]
    moves = way * sag_force_slope(curves, i, way, tight)
    ranges.low[i] = max(low, tight) + moves
    ranges.lowest[i] = low - moves if tight < low - moves < math.inf else 0.0
    if not is_limited_by_strain(cables, i):
        ranges.high[i] = high - moves if high - moves > tight else 0.0
        ranges.highest[i] = max(high, tight) + moves


@kernel
def tighten(freedom: Array, place: CablesInBox, curves: Curves, upward: float, ranges: Ranges) -> None:
    """If all cables pull upward, reduce the largest tensions to the values that the load can cause."""
    # The vertical parts of all tensions balance weight, load and sag forces. The vertical part of one tension is
    # therefore at most this load minus the smallest vertical parts of the other tensions.
    # `freedom`: rows that select the free motions, (n, 6). `upward`: largest vertical force that the cables must
    # supply, without sag forces [N].
    free = 0.0
    for k in range(freedom.shape[0]):
        free += freedom[k, 2] * freedom[k, 2]
    total = upward
    least = math.inf
    for i in range(place.way.size):
        up = place.full[2, i] - place.turned[i]
        least = min(least, up)
        moves = place.way[i] * sag_force_slope(curves, i, place.way[i], ranges.lowest[i])
        total += largest_sag_force(curves, i, ranges.lowest[i]) + moves - up * ranges.lowest[i]
    if free > 1.0 - 1e-12 and least > 0.0:
        for i in range(place.way.size):
            most = ranges.lowest[i] + max(total, 0.0) / (place.full[2, i] - place.turned[i])
            ranges.highest[i] = min(ranges.highest[i], most * (1.0 + 1e-9))


@kernel
def spread_of_slopes(place: CablesInBox, box: PoseRange, centered: Centered, ranges: Ranges, slopes: Array) -> None:
    """Fill the derivatives of the wrench of tensions and sag forces by each motion of the platform, (MOTIONS, 6)."""
    m = place.way.size
    for motion in range(MOTIONS):
        slopes[motion] = 0.0
        if motion >= 3 and box.turn == 0.0:
            continue
        columns = place.slopes[motion].reshape((6, m))
        for a in range(6):
            for i in range(m):
                slopes[motion, a] += centered.tau[i] * columns[a, i]
        for i in range(m):  # the lever of a sag force changes with rotation
            if motion == 3:
                slopes[motion, 3] += ranges.sag_force[i] * place.lever[2, i]
            elif motion == 4:
                slopes[motion, 4] += ranges.sag_force[i] * place.lever[2, i]
            elif motion == 5:
                slopes[motion, 3] -= ranges.sag_force[i] * place.lever[0, i]
                slopes[motion, 4] -= ranges.sag_force[i] * place.lever[1, i]


@formula
def in_wrench_space(rows: Array, vector: Array, full: Array) -> None:
    """Fill the direction `full` (6,) of wrenches from `vector` (n,), a direction along the free motions."""
    for a in range(6):
        full[a] = dot(rows[:, a], vector)


@kernel
def _fill_demand(
    curves: Curves, place: CablesInBox, center: Array, load: Array, centered: Centered, ranges: Ranges
) -> None:
    """Fill the demand on the chord tensions, with the sag forces at the present tensions."""
    # `load`: wrench, (6,). `centered`: its demand is filled. `ranges`: its sag forces are filled.
    n, m = place.matrix.shape
    sag_forces_at(curves, centered.tau, ranges.sag_force)
    z = center[tables.MASS] * center[tables.GRAVITY] - load[2]
    x, y = -load[3], -load[4]
    for i in range(m):
        z += ranges.sag_force[i]
        x += place.lever[1, i] * ranges.sag_force[i]
        y -= place.lever[0, i] * ranges.sag_force[i]
    for k in range(n):
        row = place.rows[k]
        centered.right[k] = (
            row[2] * z + row[3] * x + row[4] * y - row[0] * load[0] - row[1] * load[1] - row[5] * load[5]
        )


@glue
def _smoothing_of(place: CablesInBox, geometry: Array, tau: Array) -> float:
    """Smoothing for a box [N^2], proportional to the squared change of the wrench of constant tensions in the box."""
    square = 0.0
    for i in range(tau.size):
        change = tau[i] * max(place.way[i] / geometry[g.CHORD, i], LEAST_WAY)
        square += change * change
    return SMOOTHNESS * SMOOTHNESS * max(square, 1e-24)


@glue
def search_limits(ranges: Ranges, taken: Array, size: float, centered: Centered) -> bool:
    """Fill the limits of the search for tensions: the limits of the box, narrowed by `taken` (m,) at both ends."""
    # Returns False if a lower limit exceeds the upper limit.
    possible = True
    for i in range(taken.size):
        low = ranges.low[i]
        high = min(ranges.high[i], ranges.highest[i], low + FARTHEST * (size + low))
        possible = possible and low < high
        share = min(taken[i], 0.5 * (1.0 - LEAST_WIDTH) * (high - low))
        centered.low[i] = low + share
        centered.high[i] = high - share
    return possible


@kernel
def center_tensions(
    place: CablesInBox, curves: Curves, geometry: Array, body: Array, wrench: Array, centered: Centered, ranges: Ranges
) -> bool:
    """Compute centered tensions within the limits of the search, and their sag forces, for `wrench` (6,)."""
    # Returns True if the residual is so large that the demand is infeasible.
    iterations = ITERATIONS if curves.model.code == codes.CATENARY else 1
    smoothing = 0.0
    for i in range(centered.tau.size):
        if not centered.low[i] < centered.tau[i] < centered.high[i]:
            centered.tau[i] = 0.5 * (centered.low[i] + centered.high[i])
    for _ in range(iterations):
        _fill_demand(curves, place, body, wrench, centered, ranges)
        smoothing = _smoothing_of(place, geometry, centered.tau)
        _find_center(place.matrix, smoothing, centered)
    _fill_demand(curves, place, body, wrench, centered, ranges)
    return _fill_imbalance(place.matrix, centered) > BEYOND * centered.tau.size * smoothing

"""Sensitivities of the lengths and tensions of the inverse kinematics, by the implicit function theorem.

The chord tensions tau minimize the distance to goals within their limits, and balance the platform. The unknowns are
the changes of tau and of the multipliers lambda in tau = goal + J^T lambda, where J is the structure matrix. A cable at
a limit keeps the limited tension, and has no such equation. The result is valid as long as the same limits are active.
docs/model.md, sections 5 and 6.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.cable.pulley import from_axis, pulley_at
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.swivel import SLOPES
from sagline.kernels.cable.terms import Cables, Model, chord_at, new_cables
from sagline.kernels.forward import platform as f
from sagline.kernels.forward.sensitivity import BY_LENGTH, States, describe_pose, invert_scaled
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters, vector
from sagline.kernels.statics import place_cables

FREE, AT_CHORD, AT_FRAME_END, OF_SAG = 0, 1, 2, 3  # free, or at a limit: of the chord or frame-end tension, of the sag
ACTIVE = 1e-9  # relative distance of a tension from its limit below which the limit is active
LENGTH_COLUMNS = 7  # columns per cable: displacement of its platform end, change of its lever, change of its goal


class _Distribution(NamedTuple):
    """Work arrays of one pose, for m cables and n free motions."""

    free: Array  # free motions in units of stiffness, (n, 6)
    columns: Array  # structure matrix along the free motions, (n, m)
    forces: Array  # derivative of the unbalance by the chord tensions, along the free motions, (n, m)
    by_end: Array  # derivatives of the chord tensions by displacements of the platform ends, (m, 3) [N/m]
    by_length: Array  # derivatives of the chord tensions by the cable lengths, (m,) [N/m]
    own_end: Array  # direct effect of the displacement of a platform end on the tension of its cable, (m, 3) [N/m]
    own_lever: Array  # direct effect of a change of the lever, (m, 3) [N/m]
    spread: Array  # change of the chord tensions per unbalance along the free motions, (m, n)
    multipliers: Array  # lambda in world axes: force and moment, (6,)
    square: Array  # work array, (2 n + 1, n)
    part: Array  # work array, (n,)


@glue
def _new_distribution(memory: Memory, n: int, m: int) -> tuple[_Distribution, Memory]:
    """Work arrays, and the remaining memory."""
    free, memory = block(memory, n, 6)
    columns, memory = block(memory, n, m)
    forces, memory = block(memory, n, m)
    by_end, memory = block(memory, m, 3)
    by_length, memory = vector(memory, m)
    own_end, memory = block(memory, m, 3)
    own_lever, memory = block(memory, m, 3)
    spread, memory = block(memory, m, n)
    multipliers, memory = vector(memory, 6)
    square, memory = block(memory, 2 * n + 1, n)
    part, memory = vector(memory, n)
    found = _Distribution(
        free, columns, forces, by_end, by_length, own_end, own_lever, spread, multipliers, square, part
    )
    return found, memory


@formula
def _limit_of(limits: TensionLimits, robot: Array, cables: Cables, tau: float, end: float, i: int) -> int:
    """Active limit of cable `i`. `tau`, `end`: chord tension and frame-end tension [N]."""
    low, high = cables.low[i], cables.high[i]
    if low * (1.0 + ACTIVE) < tau < high * (1.0 - ACTIVE):
        return FREE
    least, most = robot[i, tables.TENSION_MIN], robot[i, tables.TENSION_MAX]
    if limits.quantity == codes.LIMITS_OF_CHORD:
        return OF_SAG if tau > least * (1.0 + 2.0 * ACTIVE) and tau < high * (1.0 - ACTIVE) else AT_CHORD
    near = 1e3 * ACTIVE
    return AT_FRAME_END if abs(end - least) <= near * least or abs(end - most) <= near * most else OF_SAG


@kernel
def _wrench_along(free: Array, lever: Array, x: float, y: float, z: float, part: Array) -> None:
    """Fill the components (n,) of the wrench of a force at the platform end with `lever`, along the free motions."""
    a = lever[1] * z - lever[2] * y
    b = lever[2] * x - lever[0] * z
    c = lever[0] * y - lever[1] * x
    for j in range(part.shape[0]):
        part[j] = free[j, 0] * x + free[j, 1] * y + free[j, 2] * z + (free[j, 3] * a + free[j, 4] * b + free[j, 5] * c)


@glue
def _fill_cable(rows: Array, block_: Array, slope: Array, lever: Array, work: _Distribution, i: int) -> None:
    """Fill the structure matrix, and the derivatives of the chord tension T_x/cos phi of cable `i`."""
    sine, cosine = rows[g.SINE, i], rows[g.COSINE, i]
    cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    turn = rows[g.TENSION, i] * sine / (cosine * rows[g.CHORD, i])
    normal = (-sine * cx, -sine * cy, cosine)
    for k in range(3):
        work.by_end[i, k] = (block_[0, k] * cx + block_[1, k] * cy) / cosine + turn * normal[k]
    c = (slope[0] * cx + slope[1] * cy) / cosine
    work.by_length[i] = c
    _wrench_along(work.free, lever, -cosine * cx, -cosine * cy, -sine, work.part)
    for j in range(work.part.shape[0]):
        work.columns[j, i] = work.part[j]
    _wrench_along(work.free, lever, slope[0] / c, slope[1] / c, slope[2] / c, work.part)
    for j in range(work.part.shape[0]):
        work.forces[j, i] = work.part[j]


@glue
def _fill_multipliers(rows: Array, goals: Array, active: Indices, work: _Distribution) -> bool:
    """Fill lambda: least squares of tau - goal = J^T lambda over the free cables. False if J has lost rank."""
    n, m = work.columns.shape
    matrix, inverse = work.square[:n], work.square[n : 2 * n]
    for j in range(n):
        work.part[j] = 0.0
        for k in range(n):
            matrix[j, k] = 0.0
        for i in range(m):
            if active[i] == FREE:
                work.part[j] += work.columns[j, i] * (rows[g.TENSION, i] - goals[i])
                for k in range(n):
                    matrix[j, k] += work.columns[j, i] * work.columns[k, i]
    if not invert_scaled(matrix, inverse, work.square[2 * n]):
        return False
    work.multipliers[:] = 0.0
    for j in range(n):
        total = 0.0
        for k in range(n):
            total += inverse[j, k] * work.part[k]
        for a in range(6):
            work.multipliers[a] += work.free[j, a] * total
    return True


@glue
def _fill_own(
    rows: Array, robot: Array, tensions: Array, lever: Array, limit: int, work: _Distribution, i: int
) -> None:
    """Fill the direct effects of the end and the lever of cable `i` on its chord tension."""
    for k in range(3):
        work.own_end[i, k] = 0.0
        work.own_lever[i, k] = 0.0
        if limit == AT_FRAME_END:
            work.own_end[i, k] = work.by_end[i, k] - work.by_length[i] * tensions[k] / tensions[6]
    if limit != FREE:
        return
    sine, cosine, chord = rows[g.SINE, i], rows[g.COSINE, i], rows[g.CHORD, i]
    cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    normal, aside = (-sine * cx, -sine * cy, cosine), (-cy, cx, 0.0)
    pulley = pulley_at(robot, i)
    swing = 1.0 / chord if pulley.radius == 0.0 else cosine / from_axis(pulley, chord_at(rows, i))
    px, py, pz = work.multipliers[3], work.multipliers[4], work.multipliers[5]
    vx = work.multipliers[0] + py * lever[2] - pz * lever[1]
    vy = work.multipliers[1] + pz * lever[0] - px * lever[2]
    vz = work.multipliers[2] + px * lever[1] - py * lever[0]
    tilts = (vx * normal[0] + vy * normal[1] + vz * normal[2]) / chord
    swings = (vx * aside[0] + vy * aside[1]) * swing
    ux, uy, uz = -cosine * cx, -cosine * cy, -sine
    for k in range(3):
        work.own_end[i, k] = -(tilts * normal[k] + swings * aside[k])
    work.own_lever[i, 0] = uy * pz - uz * py
    work.own_lever[i, 1] = uz * px - ux * pz
    work.own_lever[i, 2] = ux * py - uy * px


@glue
def _fill_spread(active: Indices, work: _Distribution) -> bool:
    """Fill the change of the chord tensions per unbalance along the free motions. False if the balance is singular."""
    n, m = work.columns.shape
    matrix, inverse = work.square[:n], work.square[n : 2 * n]
    for j in range(n):
        for k in range(n):
            total = 0.0
            for i in range(m):
                if active[i] == FREE:
                    total += work.forces[j, i] * work.columns[k, i]
            matrix[j, k] = total
    if not invert_scaled(matrix, inverse, work.square[2 * n]):
        return False
    for i in range(m):
        for k in range(n):
            total = 0.0
            for j in range(n):
                total += work.columns[j, i] * inverse[j, k]
            work.spread[i, k] = total if active[i] == FREE else 0.0
    return True


@glue
def _store_column(work: _Distribution, own: int, direct: float, by_end: float, out: Array, column: int) -> None:
    """Fill a column of length changes. `work.part`: minus the unbalance, without the direct effect on cable `own`."""
    # `direct`: direct effect on the chord tension of cable `own`. `by_end`: its derivative at a fixed length.
    m, n = work.spread.shape
    for i in range(m):
        total = 0.0
        for j in range(n):
            total += work.spread[i, j] * (work.part[j] - work.forces[j, own] * direct)
        if i == own:
            total += direct - by_end
        out[i, column] = total / work.by_length[i]


@glue
def _fill_columns(state: States, p: int, active: Indices, work: _Distribution, out: Array) -> None:
    """Fill all columns of pose `p`: ends (3 m), levers (3 m), goals (m) and wrench (6)."""
    m, n = work.spread.shape
    for i in range(m):
        k, lever, force = state.blocks[p, i], state.levers[p, i], state.forces[p, i]
        for c in range(3):
            _wrench_along(work.free, lever, k[0, c], k[1, c], k[2, c], work.part)
            for j in range(n):
                work.part[j] = work.forces[j, i] * work.by_end[i, c] - work.part[j]
            _store_column(work, i, work.own_end[i, c], work.by_end[i, c], out, 3 * i + c)
            ex, ey, ez = 1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0
            tx = force[1] * ez - force[2] * ey
            ty = force[2] * ex - force[0] * ez
            tz = force[0] * ey - force[1] * ex
            for j in range(n):
                work.part[j] = work.free[j, 3] * tx + work.free[j, 4] * ty + work.free[j, 5] * tz
            _store_column(work, i, work.own_lever[i, c], 0.0, out, 3 * (m + i) + c)
        work.part[:] = 0.0
        _store_column(work, i, 1.0 if active[i] == FREE else 0.0, 0.0, out, 6 * m + i)
    for c in range(6):
        for j in range(n):
            work.part[j] = work.free[j, c]
        _store_column(work, 0, 0.0, 0.0, out, LENGTH_COLUMNS * m + c)


@entry
def sensitivities_of_lengths(
    model: f.ForwardTerms,
    limits: tuple[int, float],
    robots: tuple[Array, Array, Array],
    poses: Array,
    results: Array,
    goals: Array,
    memory: tuple[Array, Indices],
    states: tuple[Array, Array, Array, Array, Array, Array],
    lengths: Array,
) -> None:
    """Sensitivities of the lengths of N poses with tensions nearest to `goals` (1 or N, m) [N]."""
    # The other arguments are the same as in `describe_states` and `inverse_poses`. Vertical swivel axes only.
    # `lengths`: derivatives of the lengths, (N, m, 7 m + 6), to be filled. The columns are displacements of the
    # platform ends relative to the frame ends (3 m), changes of the levers (3 m), goals (m) and the wrench on the
    # platform (6). NaN for a pose without lengths, a singular balance, a vertical chord, and a cable at the limit of
    # its sag.
    n, m = robots[0].shape[0], results.shape[2]
    state, limited = States(*states), TensionLimits(*limits)
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, CABLE_ROWS, m)
    more, rest = block(rest, SLOPES, 5)
    cables, rest = new_cables(rest, m, True)
    work, rest = _new_distribution(rest, n, m)
    active, rest = counters(rest, m)
    for p in range(poses.shape[0]):
        known = describe_pose(model, robots, poses, results, p, (rotation, rows, more), state)
        body, robot, goal = f.row_of(robots[1], p), f.row_of(robots[2], p), f.row_of(goals, p)
        placed = Model(model[0], model[1], model[2], body[tables.GRAVITY], None)
        known = known and place_cables(placed, limited, robot, rows, cables)
        if known:
            f.fill_arcs(robots[0], robot, body, work.free)
            for i in range(m):
                tau, x, y = rows[g.TENSION, i], rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
                length = rows[g.LENGTH, i] if model[3] is None else rows[g.FREE_LENGTH, i]
                y -= 0.0 if model[0] == codes.ELASTIC else cables.density[i] * placed.gravity * length
                active[i] = _limit_of(limited, robot, cables, tau, math.sqrt(x * x + y * y), i)
                known = known and active[i] != OF_SAG
                _fill_cable(rows, state.blocks[p, i], state.slopes[p, BY_LENGTH, i], state.levers[p, i], work, i)
            known = known and _fill_multipliers(rows, goal, active, work)
        if known:
            for i in range(m):
                _fill_own(rows, robot, state.tensions[p, i], state.levers[p, i], active[i], work, i)
            known = _fill_spread(active, work)
        if known:
            _fill_columns(state, p, active, work, lengths[p])
        else:
            lengths[p] = math.nan

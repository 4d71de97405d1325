"""Feasibility of poses: proofs and shortfalls, the polygon of feasible tensions, and capacity margins."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Flags, Indices
from sagline.kernels import codes, statics, tables
from sagline.kernels.algebra.bounds import START, STRIP_ROWS
from sagline.kernels.algebra.factors import copy
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.pulley import robots_have_machine
from sagline.kernels.cable.sag_forces import new_curves, sag_forces_at
from sagline.kernels.cable.states import TensionLimits, cable_without_tension
from sagline.kernels.cable.terms import Cables, new_cables
from sagline.kernels.inverse import poses as inverse
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.tension.bracket import NODES, component_along, decide_feasibility
from sagline.kernels.tension.least_change import Demand, TensionChange, norm_of_part
from sagline.kernels.tension.margin import zonotope_margin
from sagline.kernels.tension.nearest import Distribution
from sagline.kernels.tension.on_polygon import feasible_interval
from sagline.kernels.tension.polygon import feasible_polygon

SUPPORT = 1e-9  # least component of a cable along the proof that counts as limiting, relative to the largest component
AT_LIMIT = 1e-9  # a tension counts as at its limit if their relative difference is smaller


@entry
def decide_poses(
    model_terms: inverse.ModelTerms,
    limit_terms: inverse.LimitTerms,
    robot_terms: inverse.Robots,
    poses: Array,
    wrenches: Array,
    which: Indices,
    covers: bool,
    memory: tuple[Array, Indices],
    answers: inverse.Answers,
    verdicts: tuple[Array, Array, Array, Flags],
) -> None:
    """Decide with chord tensions whether poses are feasible that the distribution iterations reported as infeasible."""
    # The tensions of feasible poses are filled.
    # The arguments are the same as in `inverse_poses`, and:
    # `which`: indices of the poses, (K,). `covers`: True if the method finds a distribution at every feasible pose. If
    # False, a feasible pose gets POSE_NOT_COVERED. `verdicts`: filled for the poses `which`: lower and upper bound [N]
    # of the least change of the force that makes the pose feasible, (N, 2); this change along the free motions, (N, n),
    # and Farkas vectors, (N, n), both NaN if not found; True for each cable whose limit opposes the needed wrench, (N,
    # m).
    limits = TensionLimits(*limit_terms)
    freedom, _bodies, robots = robot_terms
    results, statuses, residuals, needed, pose_statuses = answers
    brackets, reliefs, farkas, blocking = verdicts
    n = freedom.shape[0]
    m = statuses.shape[1]
    cables, rest = new_cables(Memory(*memory), m, robots_have_machine(robots))
    balance, rest = statics.new_balance(rest, m, n)
    space, change, weight, rest = new_demand(rest, m, freedom)
    translations = space.soft
    for p in which:
        platform = inverse.platform_at(robot_terms, poses, wrenches, p)
        model = inverse.model_at(model_terms, platform.body)
        statics.set_pose(model, limits, codes.CHORD_TENSION, weight, platform, cables, balance)
        if cable_without_tension(cables) >= 0:
            brackets[p, tables.PROVED], brackets[p, tables.ENOUGH] = math.inf, math.inf
            for i in range(m):
                blocking[p, i] = not cables.low[i] <= cables.high[i]
            continue
        demand, lever = demand_of_pose(platform, cables, balance, space, change)
        curves, left = new_curves(model, cables, statuses[p], rest)
        status, brackets[p, tables.PROVED], brackets[p, tables.ENOUGH], proved = decide_feasibility(
            curves, demand, NODES, change, left
        )
        sag_forces_at(curves, change.tau, change.sag_force)
        for i in range(m if status == codes.POSE_SOLVED else 0):
            if statuses[p, i] >= codes.CABLE_TOO_SLACK:
                status = codes.POSE_NOT_CONVERGED
        if status == codes.POSE_SOLVED and not covers:
            status = codes.POSE_NOT_COVERED
        if status != codes.POSE_SOLVED and status != codes.POSE_INFEASIBLE and status != codes.POSE_BORDERLINE:
            brackets[p, tables.PROVED] = brackets[p, tables.ENOUGH] = math.nan
        if status == codes.POSE_SOLVED:
            inverse.measure_balance(None, platform, cables, balance, residuals[p])
            inverse.write_solution(True, model, cables, balance, results, p)
        else:
            statuses[p] = codes.CABLE_SOLVED
        pose_statuses[p] = status
        farkas[p] = reliefs[p] = math.nan
        _write_needed(demand, change.sag_force, lever, needed[p])
        if status != codes.POSE_SOLVED and brackets[p, tables.ENOUGH] < math.inf:
            for k in range(n):
                reliefs[p, k] = change.residual[k] if k < translations else 0.0
        if status == codes.POSE_INFEASIBLE and proved:
            _write_proof(demand, change, lever, farkas[p])
        if status == codes.POSE_INFEASIBLE or status == codes.POSE_BORDERLINE:
            _block_cables(cables, demand, change, blocking[p])


@glue
def new_demand(memory: Memory, m: int, freedom: Array) -> tuple[Demand, TensionChange, Array, Memory]:
    """Work arrays for `m` cables and the free motions `freedom` (n, 6), root weights equal to 1, and remaining memory.

    The field `size` of the demand remains unset.
    """
    n = freedom.shape[0]
    rows, memory = block(memory, 2 * n + 3, m)
    vectors, memory = block(memory, 3, n)
    rows[2 * n] = 1.0
    change = TensionChange(rows[2 * n + 1], rows[2 * n + 2], vectors[0], vectors[1])
    demand = Demand(rows[:n], rows[n : 2 * n], vectors[2], statics.translation_count(freedom), 0.0)
    return demand, change, rows[2 * n], memory


@glue
def demand_of_pose(
    platform: statics.Platform, cables: Cables, balance: statics.Balance, demand: Demand, change: TensionChange
) -> tuple[Demand, float]:
    """Fill the demand that a pose sets to its cables, and the initial tensions of the search."""
    # Returns the demand, and the lever arm [m] by which its moments are divided.
    n, m = balance.matrix.shape
    statics.fill_needed_wrench(platform, cables, balance)
    statics.start_from_minimum_norm(balance)
    copy(balance.bounds[START], change.tau)
    lever = 0.0
    for i in range(m):
        for k in range(demand.soft, n):
            lever = max(lever, abs(balance.matrix[k, i]))
    column, hanging = balance.needed, demand.right
    for i in range(m):
        column[:] = 0.0
        column[2] = 1.0
        column[3] = balance.geometry[g.LEVER_Y, i]
        column[4] = -balance.geometry[g.LEVER_X, i]
        statics.along_freedom(platform.freedom, column, hanging)
        for k in range(n):
            unit = 1.0 if k < demand.soft else 1.0 / lever
            demand.matrix[k, i] = balance.matrix[k, i] * unit
            demand.hanging[k, i] = hanging[k] * unit
    size = 0.0
    for i in range(m):
        size = max(size, cables.half_weight[i])
    for k in range(n):
        demand.right[k] = balance.right[k] if k < demand.soft else balance.right[k] / lever
        for i in range(m):
            demand.right[k] -= demand.hanging[k, i] * cables.sag_force[i]
        size = max(size, abs(demand.right[k]))
    if size == 0.0:
        for i in range(m):
            size = max(size, cables.low[i])
    return Demand(demand.matrix, demand.hanging, demand.right, demand.soft, size), lever


@glue
def _write_needed(demand: Demand, sag_force: Array, lever: float, needed: Array) -> None:
    """Fill the wrench that the chord tensions must supply, `needed` (n,), at the sag forces `sag_force` (m,)."""
    for k in range(needed.size):
        supplied = demand.right[k]
        for i in range(sag_force.size):
            supplied += demand.hanging[k, i] * sag_force[i]
        needed[k] = supplied if k < demand.soft else supplied * lever


@glue
def _write_proof(demand: Demand, change: TensionChange, lever: float, farkas: Array) -> None:
    """Fill the direction `farkas` of the proof. The force part of `farkas`, or a pure moment, has length 1."""
    n = farkas.size
    for k in range(n):
        farkas[k] = change.direction[k] if k < demand.soft else change.direction[k] / lever
    if norm_of_part(farkas, 0, demand.soft) == 0.0:
        size = norm_of_part(farkas, demand.soft, n)
        for k in range(n):
            farkas[k] /= size


@glue
def _block_cables(cables: Cables, demand: Demand, change: TensionChange, blocking: Flags) -> None:
    """Fill `blocking` (m,): True for cables at a limit that opposes the least change."""
    largest = 0.0
    for i in range(blocking.size):
        largest = max(largest, abs(component_along(demand.matrix, change.direction, i)))
    for i in range(blocking.size):
        a = component_along(demand.matrix, change.direction, i)
        limit = cables.high[i] if a > 0.0 else cables.low[i]
        blocking[i] = abs(a) > SUPPORT * largest and abs(cables.tau[i] - limit) <= AT_LIMIT * limit


@entry
def polygon_of_pose(
    model_terms: inverse.ModelTerms,
    distribution_terms: inverse.DistributionTerms,
    limit_terms: inverse.LimitTerms,
    robot_terms: inverse.Robots,
    pose: Array,
    wrench: Array,
    carried: tuple[Array, Array],
    memory: tuple[Array, Indices],
    polygon: tuple[Array, Array, Array, Array, Array, Indices],
) -> int:
    """Fill the set of feasible tensions of one pose at fixed sag forces. Returns the number of corners of the set."""
    # The arguments are the same as in `inverse_poses`, for one robot and one pose. From `distribution_terms`, only the
    # variable is used.
    # `carried`: chord tensions and sag forces of the cables, (m,) each. For NaN, first-order sag forces are used.
    # `polygon`: filled with scale and offset of the variable, (m,) each; minimum-norm tensions and limits, (3, m); null
    # space (r, m); for r = 2 corners and labels as in `feasible_polygon`; for r = 1 the ends of the interval,
    # corners[0, 0] and corners[1, 0], which may be infinite.
    distribution = Distribution(*distribution_terms)
    freedom, bodies, robots = robot_terms
    tensions, sag_forces = carried
    scale, offset, bounds, null, corners, labels = polygon
    r, m = null.shape
    cables, rest = new_cables(Memory(*memory), m, robots_have_machine(robots))
    balance, rest = statics.new_balance(rest, m, freedom.shape[0])
    platform = statics.Platform(freedom, bodies[0], robots[0], pose, wrench)
    model = inverse.model_at(model_terms, bodies[0])
    statics.set_pose(
        model, TensionLimits(*limit_terms), distribution.variable, distribution.weight, platform, cables, balance
    )
    if not math.isnan(tensions[0]):
        copy(tensions, cables.tau)
        copy(sag_forces, cables.sag_force)
        if distribution.variable == codes.FRAME_END_TENSION:
            inverse.linearize_ends(model, distribution, cables, balance)
    statics.fill_needed_wrench(platform, cables, balance)
    statics.start_from_minimum_norm(balance)
    copy(balance.scale, scale)
    copy(balance.offset, offset)
    for row in range(STRIP_ROWS):
        copy(balance.bounds[row], bounds[row])
    for k in range(r):
        copy(balance.null[k], null[k])
    count = 1
    if r == 1:
        corners[0, 0], corners[1, 0] = feasible_interval(bounds, null)
        count = 2
    elif r == 2:
        count = feasible_polygon(bounds, null, corners, labels)
    return count


@entry
def margins_of_poses(
    model_terms: inverse.ModelTerms,
    limit_terms: inverse.LimitTerms,
    robot_terms: inverse.Robots,
    poses: Array,
    wrenches: Array,
    sag_forces: Array,
    memory: tuple[Array, Indices],
    margins: Array,
) -> None:
    """Fill the capacity margins (N,) [N] of poses with `sag_forces` (N, m). NaN where the sag forces are NaN."""
    limits = TensionLimits(*limit_terms)
    freedom, _bodies, robots = robot_terms
    count, m = sag_forces.shape
    n = freedom.shape[0]
    cables, rest = new_cables(Memory(*memory), m, robots_have_machine(robots))
    balance, rest = statics.new_balance(rest, m, n)
    weight, rest = vector(rest, m)
    weight[:] = 1.0
    translations = statics.translation_count(freedom)
    for p in range(count):
        margins[p] = math.nan
        platform = inverse.platform_at(robot_terms, poses, wrenches, p)
        model = inverse.model_at(model_terms, platform.body)
        placed = (
            statics.set_pose(model, limits, codes.CHORD_TENSION, weight, platform, cables, balance)
            != codes.POSE_NO_CHORD
        )
        if placed and not math.isnan(sag_forces[p, 0]):
            copy(sag_forces[p], cables.sag_force)
            statics.fill_needed_wrench(platform, cables, balance)
            margins[p] = zonotope_margin(balance.matrix, balance.right, cables.low, cables.high, translations, rest)

"""Inverse kinematics of a batch of poses: tensions that balance the platform, and unstrained lengths of the cables.

docs/model.md, sections 4 and 5. For the exact cable, the sag forces T_z - tau sin phi depend on the tensions. The
balance is therefore solved repeatedly, each time with the last sag forces, until the sag forces converge. If the
variable of the distribution is the frame-end tension, the balance is linearized at the last tensions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, statics, tables
from sagline.kernels.algebra.factors import copy
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable import states
from sagline.kernels.cable.pulley import Wrap, behind_cable, robots_have_machine
from sagline.kernels.cable.terms import Cables, Model, chord_of, material_of, new_cables, pulley_of
from sagline.kernels.inverse.exits import NEXT_EXIT, SAME_EXIT, Exits, fill_needed_wrench, move_exits
from sagline.kernels.inverse.stability import new_stability_arrays, proves_stability
from sagline.kernels.jit import entry, glue, kernel
from sagline.kernels.memory import Memory
from sagline.kernels.tension import nearest
from sagline.kernels.tension.other_methods import distribute_by_other_method
from sagline.kernels.tension.polygon import WorkArrays, new_work_arrays, reset_work_arrays

TENSION_CONVERGED = 1e-9  # a distribution in frame-end tensions has converged below this relative change
SLOPE_STEP = 1e-4  # relative step of the central difference of the frame-end tension


@kernel
def linearize_ends(model: Model, distribution: nearest.Distribution, cables: Cables, balance: statics.Balance) -> bool:
    """Linearize the frame-end tensions at the present chord tensions, and factor the balance. False if singular."""
    for i in range(cables.tau.size):
        tau = cables.tau[i]
        chord, material, pulley = chord_of(cables, i), material_of(cables, i), pulley_of(cables, i)
        above = states.frame_end_tension(model, chord, material, pulley, tau * (1.0 + SLOPE_STEP))
        below = states.frame_end_tension(model, chord, material, pulley, tau * (1.0 - SLOPE_STEP))
        slope = (above - below) / (2.0 * SLOPE_STEP * tau)
        balance.offset[i] = states.frame_end_tension(model, chord, material, pulley, tau) - slope * tau
        balance.scale[i] = slope * distribution.weight[i]
        statics.scale_limits(cables, balance, i)
    return statics.factor_balance(balance)


ITERATIONS = 30
# iterations before the reference is fixed; a fixed reference always selects the same of several optimal tensions
FREE_ITERATIONS = 8
CONVERGED = 1e-10  # largest change of a converged sag force, in N and relative to the largest tension:
SAG_ROUNDING = 1e-15


class Method(NamedTuple):
    """Tension distribution of a batch, and its reference point."""

    distribution: nearest.Distribution
    near: nearest.ReferencePoint


@glue
def distribute_and_solve_cables(
    model: Model, method: Method, platform: statics.Platform, cables: Cables,
    balance: statics.Balance, work: WorkArrays | None, exits: Exits | None, statuses: Codes,
) -> int:  # fmt: skip
    """Distribute tensions and solve the cables until the sag forces converge. Returns the pose's status."""
    # `cables`: the cables from `set_pose`, with tensions, ratios and sag forces to be filled. `work`: work arrays for
    # frame-end tensions and for methods that are not projections; if None, this code is not compiled. `exits`: pulleys
    # with swivel axes of any direction; the cables start at eyelets at their exit points. `statuses`: filled with the
    # status of each cable, (m,).
    distribution, near = method.distribution, method.near
    near.held.labels[0] = 0
    if work is not None:
        reset_work_arrays(work)
    nearest.set_reference(distribution, balance.offset, balance.null, near)
    solved, away, placed = False, 0.0, False
    statics.fill_needed_wrench(platform, cables, balance)
    possible = states.cable_without_tension(cables) < 0
    status = codes.POSE_NOT_CONVERGED if possible else codes.POSE_INFEASIBLE
    for k in range(ITERATIONS if possible else 0):
        statics.start_from_minimum_norm(balance)
        if work is None:
            status = nearest.share_nearest(balance.bounds, balance.null, near, balance.tension)
        elif nearest.is_nearest(distribution) or k >= FREE_ITERATIONS:
            if k >= FREE_ITERATIONS and not nearest.is_nearest(distribution):
                fix_reference(balance, near)
            status = nearest.share_nearest(balance.bounds, balance.null, near, balance.tension)
        else:
            status = distribute_by_other_method(
                distribution, balance.bounds, balance.offset, balance.null, near, work, balance.tension
            )
        if status != codes.POSE_SOLVED:
            break
        moved, largest = take_tensions(cables, balance)
        if exits is not None:
            before, away = away, 0.0 if placed else move_exits(model, exits, platform, cables, balance, not solved)
            placed = away * away <= NEXT_EXIT * before  # successive changes have a nearly constant ratio
        gravest, turned = states.solve_cable_states(
            model, cables, not solved, solved and moved + away < states.NEAR, statuses
        )
        status = codes.POSE_NOT_CONVERGED
        if gravest == codes.CABLE_TOO_SLACK or gravest == codes.CABLE_NOT_CONVERGED:
            break
        change = sag_force_change(cables)
        converged = away <= SAME_EXIT and (
            model.code != codes.CATENARY
            or (change <= CONVERGED + SAG_ROUNDING * largest and turned <= states.SAME_EXIT)
        )
        if work is None or distribution.variable != codes.FRAME_END_TENSION:
            if converged:
                status = codes.POSE_SOLVED
                break
        else:
            if converged and solved and moved <= TENSION_CONVERGED:
                status = codes.POSE_SOLVED
                break
            if not linearize_ends(model, distribution, cables, balance):
                status = codes.POSE_SINGULAR
                break
            nearest.set_reference(distribution, balance.offset, balance.null, near)
            reset_work_arrays(work)
        solved = True
        fill_needed_wrench(exits, platform, cables, balance)
    if status == codes.POSE_SOLVED and not _strain_admits_tensions(cables):
        status = codes.POSE_INFEASIBLE
    return status


@glue
def _strain_admits_tensions(cables: Cables) -> bool:
    """True if all cables without an upper limit are within the largest strain. The distribution methods ignore it."""
    for i in range(cables.tau.size):
        if cables.tau[i] > cables.high[i] and states.is_limited_by_strain(cables, i):
            return False
    return True


@glue
def fix_reference(balance: statics.Balance, near: nearest.ReferencePoint) -> None:
    """Set the present tensions as the reference, and release active bounds that only selected among equal optima."""
    near.held.labels[0] = 0
    for k in range(balance.null.shape[0]):
        near.reference[k] = 0.0
        for i in range(balance.null.shape[1]):
            near.reference[k] += balance.null[k, i] * balance.tension[i]


@glue
def take_tensions(cables: Cables, balance: statics.Balance) -> tuple[float, float]:
    """Copy the distributed tensions to the cables. Returns the largest relative change and the largest tension [N]."""
    largest = 0.0
    moved = 0.0
    for i in range(cables.tau.size):
        new = balance.tension[i] / balance.scale[i]
        moved = max(moved, abs(new - cables.tau[i]) / new)
        largest = max(largest, new)
        cables.tau[i] = new
        cables.last_sag_force[i] = cables.sag_force[i]
    return moved, largest


@glue
def sag_force_change(cables: Cables) -> float:
    """Largest change of a sag force in this iteration [N]."""
    change = 0.0
    for i in range(cables.tau.size):
        change = max(change, abs(cables.sag_force[i] - cables.last_sag_force[i]))
    return change


@glue
def store_tensions(
    model: Model,
    distribution: nearest.Distribution,
    cables: Cables,
    work: WorkArrays | None,
    near: nearest.ReferencePoint,
) -> None:
    """Store the tensions, in the variable of the distribution, for the next pose."""
    for i in range(cables.tau.size):
        near.previous[i] = cables.tau[i]
        if distribution.variable == codes.HORIZONTAL_TENSION:
            near.previous[i] = cables.tau[i] * cables.cosine[i]
        elif work is not None and distribution.variable == codes.FRAME_END_TENSION:
            near.previous[i] = states.frame_end_tension(
                model, chord_of(cables, i), material_of(cables, i), pulley_of(cables, i), cables.tau[i]
            )


FORCE, MOMENT = 0, 1  # columns of the residuals

# types of the arguments from Python; plain tuples take the least time to pass
ModelTerms = tuple[int, float, float]  # code, k_h, k_p
DistributionTerms = tuple[int, float, int, Array, Array]  # Distribution
LimitTerms = tuple[int, float]  # Limits
Robots = tuple[Array, Array, Array]  # freedom, bodies, robots
Answers = tuple[Array, Codes, Array, Array, Codes]  # results, statuses, residuals, needed, pose_statuses


@glue
def platform_at(robots: Robots, poses: Array, wrenches: Array, p: int) -> statics.Platform:
    """Platform at pose `p`. `robots` and `wrenches` have one row for all poses, or one row per pose."""
    freedom, bodies, cables = robots
    body, cable_rows = bodies[min(p, bodies.shape[0] - 1)], cables[min(p, cables.shape[0] - 1)]
    return statics.Platform(freedom, body, cable_rows, poses[p], wrenches[min(p, wrenches.shape[0] - 1)])


@glue
def model_at(terms: ModelTerms, body: Array) -> Model:
    """Cable model `terms` with the gravity of `body`, a row of the body_table."""
    return Model(terms[0], terms[1], terms[2], body[tables.GRAVITY], None)


@entry
def inverse_poses(
    model_terms: ModelTerms,
    distribution_terms: DistributionTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    poses: Array,
    wrenches: Array,
    previous: Array,
    memory: tuple[Array, Indices],
    otherwise: bool | None,
    stability: bool | None,
    answers: Answers,
    first: int,
    last: int,
) -> None:
    """Solve part of a batch, pose by pose. With CLOSEST, the tensions of each feasible pose are the next reference."""
    # model_terms: Cable model: code, k_h, k_p.
    # distribution_terms: Tension distribution: `Distribution`.
    # limit_terms: Limits of the tensions: `TensionLimits`.
    # robot_terms: Rows that select the free motions, translations first, (n, 6); body_table, (1 or N, BODY_COLUMNS);
    #   cable_table, (1 or N, m, CABLE_COLUMNS).
    # poses: Rows (N, POSE_COLUMNS).
    # wrenches: External plus inertial wrenches about the center of mass, (1 or N, 6).
    # previous: Reference tensions in the distribution's variable (m,), NaN for the minimum norm. CLOSEST overwrites
    #   `previous` with the tensions of the last feasible pose.
    # memory: Work arrays from `memory_for`, for the number of cables.
    # otherwise: True for any method. None if the method is a projection in chord or horizontal tensions; the code of
    #   all other methods is then not compiled.
    # stability: True to prove the stability of each equilibrium. A solved pose without a proof then gets
    #   UNPROVED_STABILITY. With None, the proof is not compiled.
    # answers: Filled with span and rise of the free spans, unstrained length off the drum, T_x, T_z, tau, and then the
    #   rows for pulleys and dead lengths, if any, (RESULT_ROWS, N, m); status of each cable, (N, m); norms of the
    #   unbalanced force [N] and moment [N m] along the free motions, (N, 2); wrench that J tau must supply along the
    #   free motions, (N, n); status of each pose, (N,).
    # first: Index of the first pose.
    # last: Index after the last pose.
    distribution = nearest.Distribution(*distribution_terms)
    limits = states.TensionLimits(*limit_terms)
    freedom, _bodies, robots = robot_terms
    results, statuses, residuals, needed, pose_statuses = answers
    m = statuses.shape[1]
    n = freedom.shape[0]
    machine = robots_have_machine(robots)
    cables, rest = new_cables(Memory(*memory), m, machine)
    balance, rest = statics.new_balance(rest, m, n)
    near, rest = nearest.new_reference_point(rest, previous, m - n)
    proof, rest = (
        (None, rest) if stability is None else new_stability_arrays(rest, m, n - statics.translation_count(freedom))
    )
    others = None if otherwise is None else new_work_arrays(distribution.method, rest, m, m - n)
    for p in range(first, last):
        platform = platform_at(robot_terms, poses, wrenches, p)
        model = model_at(model_terms, platform.body)
        statuses[p] = codes.CABLE_SOLVED
        status = statics.set_pose(model, limits, distribution.variable, distribution.weight, platform, cables, balance)
        if status == codes.POSE_SOLVED:
            status = distribute_and_solve_cables(
                model, Method(distribution, near), platform, cables, balance, others, None, statuses[p]
            )
        if status == codes.POSE_SOLVED:
            measure_balance(None, platform, cables, balance, residuals[p])
            if distribution.method == codes.CLOSEST:
                store_tensions(model, distribution, cables, others, near)
        else:
            residuals[p, FORCE] = residuals[p, MOMENT] = math.nan
        for k in range(n):
            supplied = status != codes.POSE_NO_CHORD and status != codes.POSE_SINGULAR
            needed[p, k] = balance.right[k] if supplied else math.nan
        pose_statuses[p] = status
        if stability is not None and proof is not None:
            asked = stability and status == codes.POSE_SOLVED
            if asked and not proves_stability(model, None, platform, cables, balance, proof):
                pose_statuses[p] = codes.UNPROVED_STABILITY
        write_solution(status == codes.POSE_SOLVED, model, cables, balance, results, p)


@glue
def measure_balance(
    exits: Exits | None, platform: statics.Platform, cables: Cables, balance: statics.Balance, residuals: Array
) -> None:
    """Fill the norms of the unbalanced force [N] and moment [N m] along the platform's free motions."""
    fill_needed_wrench(exits, platform, cables, balance)
    rest = balance.needed  # `needed` serves as work memory here, because `balance.right` still contains its components
    for k in range(balance.right.size):
        rest[k] = -balance.right[k]
        for i in range(cables.tau.size):
            rest[k] += balance.matrix[k, i] * cables.tau[i]
    force, moment = statics.squares_along(platform.freedom, rest)
    residuals[FORCE] = math.sqrt(force)
    residuals[MOMENT] = math.sqrt(moment)


@glue
def write_solution(
    solved: bool, model: Model, cables: Cables, balance: statics.Balance, results: Array, p: int
) -> None:
    """Write the results of pose `p`. If `solved` is false, all rows except span and rise become NaN."""
    for i in range(cables.tau.size):
        tension = cables.tau[i] if solved else math.nan
        results[tables.SPAN, p, i] = balance.geometry[g.SPAN, i]
        results[tables.RISE, p, i] = balance.geometry[g.RISE, i]
        results[tables.LENGTH, p, i] = cables.ratio[i] * cables.free_chord[i] if solved else math.nan
        results[tables.HORIZONTAL, p, i] = tension * cables.cosine[i]
        results[tables.VERTICAL, p, i] = tension * cables.sine[i] + cables.sag_force[i]
        results[tables.TENSION, p, i] = tension
    if cables.machine:
        _write_behind(solved, model, cables, results, p)


@glue
def _write_behind(solved: bool, model: Model, cables: Cables, results: Array, p: int) -> None:
    """Write the free spans. Add the cable on the pulleys and the dead lengths to the unstrained lengths."""
    m = cables.tau.size
    if not solved:
        results[tables.WRAP, p] = results[tables.WRAPPED, p] = math.nan
        results[tables.DEAD, p] = results[tables.SINE, p] = math.nan
        return
    # the memory of the previous sag forces, which are no longer needed, takes the exit points
    tension = cables.last_sag_force
    copy(cables.tau, tension)
    if model.code == codes.CATENARY:
        for i in range(m):
            x, z = cables.free_tau[i] * cables.free_cosine[i], cables.free_tau[i] * cables.free_sine[i]
            length = cables.ratio[i] * cables.free_chord[i]
            z += cables.free_sag_force[i] - cables.density[i] * model.gravity * length
            tension[i] = math.sqrt(x * x + z * z)
    for i in range(m):
        results[tables.SPAN, p, i] = cables.free_chord[i] * cables.free_cosine[i]
    for i in range(m):
        results[tables.RISE, p, i] = cables.free_chord[i] * cables.free_sine[i]
    for i in range(m):
        results[tables.WRAP, p, i] = angle(cables.wrap_sine[i], cables.wrap_cosine[i])
    for i in range(m):
        wrap = Wrap(cables.wrap_sine[i], cables.wrap_cosine[i], results[tables.WRAP, p, i])
        wrapped, _dead = behind_cable(model, material_of(cables, i), pulley_of(cables, i), tension[i], wrap)
        results[tables.WRAPPED, p, i] = wrapped
    for i in range(m):
        wrap = Wrap(cables.wrap_sine[i], cables.wrap_cosine[i], 0.0)
        _wrapped, dead = behind_cable(model, material_of(cables, i), pulley_of(cables, i), tension[i], wrap)
        results[tables.DEAD, p, i] = dead
    for i in range(m):
        results[tables.LENGTH, p, i] += results[tables.WRAPPED, p, i] + results[tables.DEAD, p, i]
    copy(cables.sine, results[tables.SINE, p])

"""Inverse kinematics of a batch of poses: tensions that balance the platform, and unstrained lengths of the cables.

docs/model.md, sections 4 and 5. For the exact cable, the sag forces T_z - tau sin phi depend on the tensions. The
balance is therefore solved repeatedly with the last sag forces, until the sag forces converge.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import angle
from sagline.kernels.balance.setting import Balance, Platform, fill_needed_wrench, new_balance, set_pose
from sagline.kernels.balance.wrench import is_rotation, translation_count
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.admissible import TensionLimits
from sagline.kernels.cable.cables import Cables, material_of, new_cables, pulley_of
from sagline.kernels.cable.pulley import Wrap, behind_cable, robots_have_machine
from sagline.kernels.cable.terms import Model
from sagline.kernels.inverse.iterations import distribute_and_solve_cables, store_tensions
from sagline.kernels.inverse.stability import new_stability_arrays, proves_stability
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory
from sagline.kernels.tension.nearest import Distribution, new_reference_point
from sagline.kernels.tension.polygon import new_work_arrays

FORCE, MOMENT = 0, 1  # columns of the residuals

# types of the arguments from Python; plain tuples take the least time to pass
ModelTerms = tuple[int, float, float]  # code, k_h, k_p
DistributionTerms = tuple[int, float, int, Array, Array]  # Distribution
LimitTerms = tuple[int, float]  # Limits
Robots = tuple[Array, Array, Array]  # freedom, bodies, robots
Answers = tuple[Array, Codes, Array, Array, Codes]  # results, statuses, residuals, needed, pose_statuses


@glue
def platform_at(robots: Robots, poses: Array, wrenches: Array, p: int) -> Platform:
    """Platform at pose `p`. Robots and wrenches have a single row for all poses, or one row per pose."""
    freedom, bodies, cables = robots
    body, cable_rows = bodies[min(p, bodies.shape[0] - 1)], cables[min(p, cables.shape[0] - 1)]
    return Platform(freedom, body, cable_rows, poses[p], wrenches[min(p, wrenches.shape[0] - 1)])


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
    """Solve part of a batch, pose by pose. With CLOSEST, each feasible pose gives the next reference tensions.

    Args:
        model_terms: Cable model: code, k_h, k_p.
        distribution_terms: Tension distribution: `Distribution`.
        limit_terms: Limits of the tensions: `TensionLimits`.
        robot_terms: Rows that select the free motions, translations first, (n, 6); body_table, (1 or N, BODY_COLUMNS);
            cable_table, (1 or N, m, CABLE_COLUMNS).
        poses: Rows (N, POSE_COLUMNS).
        wrenches: External plus inertial wrenches about the center of mass, (1 or N, 6).
        previous: Reference tensions in the distribution's variable (m,), NaN for the minimum norm. CLOSEST overwrites
            them with the tensions of the last feasible pose.
        memory: Work arrays from `memory_for`, for the number of cables.
        otherwise: True for any method. None if the method is a projection onto a reference in chord or horizontal
            tensions; the code of all other methods is then not compiled.
        stability: True to prove the stability of each equilibrium. A solved pose without a proof then gets
            UNPROVED_STABILITY. With None, the proof is not compiled.
        answers: Filled with span and rise of the free spans, unstrained length off the drum, T_x, T_z, tau, and then
            the rows for pulleys and dead lengths, if any, (RESULT_ROWS, N, m); status of each cable, (N, m); norms of
            the unbalanced force [N] and moment [N m] along the free motions, (N, 2); wrench that J tau must supply
            along the free motions, (N, n); status of each pose, (N,).
        first: Index of the first pose.
        last: Index after the last pose.
    """
    distribution = Distribution(*distribution_terms)
    limits = TensionLimits(*limit_terms)
    freedom, _bodies, robots = robot_terms
    results, statuses, residuals, needed, pose_statuses = answers
    m = statuses.shape[1]
    n = freedom.shape[0]
    machine = robots_have_machine(robots)
    cables, rest = new_cables(Memory(*memory), m, machine)
    balance, rest = new_balance(rest, m, n)
    near, rest = new_reference_point(rest, previous, m - n)
    proof, rest = (None, rest) if stability is None else new_stability_arrays(rest, m, n - translation_count(freedom))
    others = None if otherwise is None else new_work_arrays(distribution.method, rest, m, m - n)
    for p in range(first, last):
        platform = platform_at(robot_terms, poses, wrenches, p)
        model = model_at(model_terms, platform.body)
        for i in range(m):
            statuses[p, i] = codes.CABLE_SOLVED
        status = set_pose(model, limits, distribution.variable, distribution.weight, platform, cables, balance)
        if status == codes.POSE_SOLVED:
            status = distribute_and_solve_cables(
                model, distribution, platform, cables, balance, near, others, statuses[p]
            )
        if status == codes.POSE_SOLVED:
            measure_balance(platform, cables, balance, residuals[p])
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
            if asked and not proves_stability(model, platform, cables, balance, proof):
                pose_statuses[p] = codes.UNPROVED_STABILITY
        write_solution(status == codes.POSE_SOLVED, model, cables, balance, results, p)


@glue
def measure_balance(platform: Platform, cables: Cables, balance: Balance, residuals: Array) -> None:
    """Fill the norms of the unbalanced force [N] and moment [N m] along the platform's free motions."""
    fill_needed_wrench(platform, cables, balance)
    force = 0.0
    moment = 0.0
    for k in range(balance.right.size):
        total = -balance.right[k]
        for i in range(cables.tau.size):
            total += balance.matrix[k, i] * cables.tau[i]
        if is_rotation(platform.freedom, k):
            moment += total * total
        else:
            force += total * total
    residuals[FORCE] = math.sqrt(force)
    residuals[MOMENT] = math.sqrt(moment)


@glue
def write_solution(solved: bool, model: Model, cables: Cables, balance: Balance, results: Array, p: int) -> None:
    """Write the results of pose `p`. If it has no solution, all rows except span and rise become NaN."""
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
    for i in range(m):
        if not solved:
            results[tables.WRAP, p, i] = results[tables.WRAPPED, p, i] = math.nan
            results[tables.DEAD, p, i] = results[tables.SINE, p, i] = math.nan
    if solved:
        # memory for the exit points of the cables, because the previous sag forces are no longer needed
        tension = cables.last_sag_force
        for i in range(m):
            tension[i] = cables.tau[i]
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
        for i in range(m):
            results[tables.SINE, p, i] = cables.sine[i]

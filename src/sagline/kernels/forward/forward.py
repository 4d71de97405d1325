"""Forward kinematics of a batch: the pose in which the platform rests on cables of given lengths.

docs/model.md, section 6.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes
from sagline.kernels import tables
from sagline.kernels.algebra.dense import extreme_eigenvalues
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.freedom import make_symmetric, norm, project, restricted
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import (
    CATENARY,
    ELASTIC,
    FORWARD_LOOSE,
    FORWARD_NO_LENGTHS,
    FORWARD_NOT_CONVERGED,
    FORWARD_OVERSTRETCHED,
    FORWARD_SINGULAR,
    FORWARD_SOLVED,
    FORWARD_UNSTABLE,
)
from sagline.kernels.forward.descent import BALANCED, descend, polish
from sagline.kernels.forward.platform import platform_energy, unbalance
from sagline.kernels.forward.problem import Problem, Space, new_space
from sagline.kernels.jit import entry_with_memory, kernel

UNIT_SHARE = 0.2  # of the mean length: the displacement that counts as much as a rotation by 1 rad
FLAT = 1e-9  # of the largest stiffness: smaller ones are none
OVERSTRETCHED = 0.1  # strain that no cable survives

# columns of the numbers that describe one solution
ENERGY, FORCE_RESIDUAL, MOMENT_RESIDUAL, STIFFNESS_MIN, ITERATIONS = 0, 1, 2, 3, 4
FORWARD_NUMBERS = 5


@kernel
def verdict(problem: Problem, space: Space, size: float, low: float, high: float) -> int:
    """What kind of solution space holds; size is the sum of tensions, low and high the extreme stiffnesses."""
    cables, result = problem.cables, space.result
    gravity = problem.model.gravity
    m = cables.shape[0]
    n = problem.freedom.shape[0]
    project(problem.freedom, space.gradient, problem.scale, space.part)
    if not norm(space.part) <= BALANCED * size * norm(problem.scale):
        return FORWARD_NOT_CONVERGED
    if low < -FLAT * high:
        return FORWARD_UNSTABLE
    if not low > FLAT * high:
        return FORWARD_SINGULAR
    taut = 0
    strain = 0.0
    for i in range(m):
        tension = result[tables.TENSION, i]
        half_weight = 0.0 if problem.model.code == ELASTIC else 0.5 * cables[i, tables.DENSITY] * gravity
        taut += 1 if tension > half_weight * space.geometry[g.CHORD, i] else 0
        strain = max(strain, tension / cables[i, tables.STIFFNESS])
    if strain > OVERSTRETCHED:
        return FORWARD_OVERSTRETCHED
    return FORWARD_LOOSE if taut < min(n, m) else FORWARD_SOLVED


@kernel
def fill_residuals(problem: Problem, space: Space, numbers: Array) -> None:
    """Fill the norms of the unbalanced force [N] and moment [N m] along the free motions."""
    force = 0.0
    moment = 0.0
    for j in range(problem.freedom.shape[0]):
        total = 0.0
        turns = 0.0
        for a in range(6):
            total += problem.freedom[j, a] * space.gradient[a]
            turns += abs(problem.freedom[j, a]) if a >= 3 else 0.0
        if turns > 0.0:
            moment += total * total
        else:
            force += total * total
    numbers[FORCE_RESIDUAL] = math.sqrt(force)
    numbers[MOMENT_RESIDUAL] = math.sqrt(moment)


@kernel
def fill_scales(freedom: Array, cables: Array, body: Array, lengths: Array, scale: Array, arc: Array) -> None:
    """Fill the units of the free motions for the trust region, and those by which stiffnesses are compared.

    In the latter a rotation counts by the arc it makes at the platform ends' root mean square distance from the
    center of mass, so that every stiffness is in N/m.
    """
    m = lengths.shape[0]
    mean = 0.0
    square = 0.0
    for i in range(m):
        mean += lengths[i] / m
        for k in range(3):
            lever = cables[i, tables.PLATFORM_X + k] - body[tables.CENTER_X + k]
            square += lever * lever / m
    radius = math.sqrt(square)
    for j in range(freedom.shape[0]):
        turns = abs(freedom[j, 3]) + abs(freedom[j, 4]) + abs(freedom[j, 5]) > 0.0
        scale[j] = 1.0 if turns else UNIT_SHARE * mean
        arc[j] = 1.0 / radius if turns and radius > 0.0 else 1.0


@kernel
def solve_pose(problem: Problem, energy_problem: Problem, pose: Array, arc: Array, space: Space, numbers: Array) -> int:
    """Move pose to the equilibrium and fill the numbers; returns the status."""
    steps, size = descend(energy_problem, pose, space)
    if size == 0.0 or problem.model.code != energy_problem.model.code:
        size = unbalance(problem, pose, space)
    steps += polish(problem, pose, space, size * norm(problem.scale))
    numbers[ENERGY] = platform_energy(problem, pose, space)[0]
    numbers[ITERATIONS] = steps
    fill_residuals(problem, space, numbers)
    restricted(problem.freedom, space.stiffness, arc, space.matrix)
    make_symmetric(space.matrix)
    low, high = extreme_eigenvalues(space.matrix, space.part, space.work, space.step, space.motion)
    numbers[STIFFNESS_MIN] = low
    return verdict(problem, space, size, low, high)


@entry_with_memory
def forward_poses(
    code: int,
    k_h: float,
    k_p: float,
    chained: bool,
    freedom: Array,
    bodies: Array,
    robots: Array,
    lengths: Array,
    starts: Array,
    wrenches: Array,
    poses: Array,
    results: Array,
    statuses: Codes,
    numbers: Array,
    pose_statuses: Codes,
) -> None:
    """Solve every sample in turn.

    Args:
        code: Cable model; the shallow ones go downhill as exact cables and are polished as what they are.
        k_h: The empirical model's constant.
        k_p: The empirical model's constant.
        chained: Whether each sample starts where the last solved one ended, the first at starts[0].
        freedom: Rows that pick the free motions, (n, 6).
        bodies: body_table, (1 or N, BODY_COLUMNS).
        robots: cable_table, (1 or N, m, CABLE_COLUMNS).
        lengths: Unstrained lengths [m], (N, m); a row of NaN is left out.
        starts: Pose rows (1 or N, POSE_COLUMNS).
        wrenches: External plus inertial, about the center of mass, (1 or N, 6).
        poses: Filled: pose rows (N, POSE_COLUMNS).
        results: Filled: span, rise, length, T_x, T_z, tau, (RESULT_ROWS, N, m).
        statuses: Filled: status of each cable, (N, m).
        numbers: Filled: energy, residuals, smallest stiffness, iterations, (N, FORWARD_NUMBERS).
        pose_statuses: Filled, (N,).
    """
    count, m = lengths.shape
    n = freedom.shape[0]
    space = new_space(m, n)
    scale = np.empty(n)
    arc = np.empty(n)
    pose = np.empty(tables.POSE_COLUMNS)
    last = starts[0].copy()
    energy_code = ELASTIC if code == ELASTIC else CATENARY
    for p in range(count):
        cables = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        if math.isnan(lengths[p, 0]):
            poses[p, :] = math.nan
            results[:, p] = math.nan
            statuses[p, :] = 0
            numbers[p, :] = math.nan
            numbers[p, ITERATIONS] = 0.0
            pose_statuses[p] = FORWARD_NO_LENGTHS
            continue
        for k in range(tables.POSE_COLUMNS):
            pose[k] = last[k] if chained else starts[min(p, starts.shape[0] - 1), k]
        if not chained:  # an answer must not depend on the sample before
            space.memory[:] = math.nan
        fill_scales(freedom, cables, body, lengths[p], scale, arc)
        model = Model(code, k_h, k_p, body[tables.GRAVITY])
        exact = Model(energy_code, 0.0, 0.0, body[tables.GRAVITY])
        problem = Problem(model, freedom, cables, body, lengths[p], wrench, scale)
        energy_problem = Problem(exact, freedom, cables, body, lengths[p], wrench, scale)
        status = solve_pose(problem, energy_problem, pose, arc, space, numbers[p])
        pose_statuses[p] = status
        for k in range(tables.POSE_COLUMNS):
            poses[p, k] = pose[k]
            if status != FORWARD_NOT_CONVERGED:
                last[k] = pose[k]
        for i in range(m):
            statuses[p, i] = space.statuses[i]
            for row in range(tables.RESULT_ROWS):
                results[row, p, i] = space.result[row, i]

"""Forward kinematics of a batch: the pose in which the platform rests on cables of given lengths.

docs/model.md, section 6. Downhill in the energy by Newton's method with a trust region, which ends in a stable
equilibrium from almost any start; then plain Newton on the wrench balance, to the last digit.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes
from sagline.kernels import geometry as g
from sagline.kernels import tables
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
from sagline.kernels.dense import extreme_eigenvalues, solve_general, trust_step
from sagline.kernels.freedom import make_symmetric, norm, project, restricted, spread
from sagline.kernels.jit import kernel
from sagline.kernels.platform import (
    Problem,
    Space,
    moved_pose,
    new_space,
    platform_energy,
    platform_stiffness,
    unbalance,
)

DESCENT_STEPS = 150
POLISH_STEPS = 30
SHORTENINGS = 10
UNIT_SHARE = 0.2  # of the mean length: the displacement that counts as much as a rotation by 1 rad
FIRST_RADIUS = 0.5  # of the trust region, in these units
LARGEST_RADIUS = 1.0
NEAR = 3e-3  # a full Newton step shorter than this leaves the rest to the polish
NOISE = 4e-15  # of the sum of an energy's parts: what rounding leaves of it
BALANCED = 1e-9  # of the sum of tensions and weight: an unbalance that counts as none
LAST_DIGIT = 1e-15  # a step, in these units, that rounding hides
FLAT = 1e-9  # of the largest stiffness: smaller ones are none
OVERSTRETCHED = 0.1  # strain that no cable survives

# columns of the numbers that describe one solution
ENERGY, FORCE_RESIDUAL, MOMENT_RESIDUAL, STIFFNESS_MIN, ITERATIONS = 0, 1, 2, 3, 4
FORWARD_NUMBERS = 5


@kernel
def descend(problem: Problem, pose: Array, space: Space):  # type: ignore[no-untyped-def]
    """Move pose downhill until a full Newton step is short; a start in balance stays where it is, stable or not.

    Returns the number of steps tried, and the sum of tensions that `unbalance` gave at the pose; 0 where the last
    pose tried was another.
    """
    scale, wrench = problem.scale, problem.wrench
    part, step, motion, matrix, trial = space.part, space.step, space.motion, space.matrix, space.trial
    radius = FIRST_RADIUS
    tensions = unbalance(problem, pose, space)
    project(problem.freedom, space.gradient, scale, part)
    if norm(part) <= BALANCED * tensions * norm(scale):
        return 0, tensions
    energy, size = platform_energy(problem, pose, space)
    fresh = True
    for iteration in range(DESCENT_STEPS):
        if fresh:
            platform_stiffness(problem, space)
            restricted(problem.freedom, space.stiffness, scale, matrix)
            make_symmetric(matrix)
            project(problem.freedom, space.gradient, scale, part)
        shift = trust_step(matrix, part, radius, space.factor, space.work, step)
        length = norm(step)
        promised = 0.0
        for j in range(step.shape[0]):
            promised -= part[j] * step[j]
            for k in range(step.shape[0]):
                promised -= 0.5 * step[j] * matrix[j, k] * step[k]
        spread(problem.freedom, step, scale, motion)
        moved_pose(problem.body, pose, motion, trial)
        tensions = unbalance(problem, trial, space)
        new_energy, new_size = platform_energy(problem, trial, space)
        gain = energy - new_energy
        for k in range(3):  # the work of a given moment along the motion
            gain += wrench[3 + k] * motion[3 + k]
        noise = NOISE * (size + new_size)
        fresh = gain + noise >= 0.1 * promised  # false for NaN too
        if not fresh:
            radius = 0.3 * min(length, radius)
            if not radius > 1e-14:
                return iteration + 1, 0.0
            continue
        for k in range(pose.shape[0]):
            pose[k] = trial[k]
        energy = new_energy
        size = new_size
        if shift == 0.0 and (length <= NEAR or promised <= noise):
            return iteration + 1, tensions
        if gain >= 0.6 * promised and length >= 0.7 * radius:
            radius = min(2.0 * radius, LARGEST_RADIUS)
        elif gain < 0.3 * promised:
            radius = 0.5 * length
    return DESCENT_STEPS, 0.0


@kernel
def improve(problem: Problem, pose: Array, space: Space, best: float, good: float):  # type: ignore[no-untyped-def]
    """One Newton step on the wrench balance, shortened until the unbalance is below best; needs the stiffness.

    Returns the new unbalance and the length of the step; length 0 and an unchanged pose where no step is better.
    Close to balance (good) only the full step is tried: what it cannot improve is rounding.
    """
    motion, trial, part = space.motion, space.trial, space.part
    restricted(problem.freedom, space.stiffness, problem.scale, space.matrix)
    project(problem.freedom, space.gradient, problem.scale, part)
    if not solve_general(space.matrix, part):
        return best, 0.0
    length = norm(part)
    if length <= LAST_DIGIT:
        return best, 0.0
    spread(problem.freedom, part, problem.scale, motion)
    for k in range(6):
        motion[k] = -motion[k]
    for _ in range(SHORTENINGS):
        moved_pose(problem.body, pose, motion, trial)
        unbalance(problem, trial, space)
        project(problem.freedom, space.gradient, problem.scale, part)
        new = norm(part)
        if new < best:
            for k in range(pose.shape[0]):
                pose[k] = trial[k]
            return new, length
        if best <= good:
            break
        for k in range(6):
            motion[k] *= 0.25
        length *= 0.25
    unbalance(problem, pose, space)
    return best, 0.0


@kernel
def polish(problem: Problem, pose: Array, space: Space, size: float) -> int:
    """Newton on the wrench balance while it gets better, to the last digit; returns the number of steps.

    Before and on return space is that of the pose; the stiffness may be that of a pose a rounding error away.
    """
    project(problem.freedom, space.gradient, problem.scale, space.part)
    best = norm(space.part)
    before = 0.0
    for iteration in range(POLISH_STEPS):
        platform_stiffness(problem, space)
        best, length = improve(problem, pose, space, best, BALANCED * size)
        # each step is as long as the error before it: the next would be about length^3/before^2
        if length == 0.0 or length * length * length <= LAST_DIGIT * before * before:
            return iteration + 1
        before = length
    platform_stiffness(problem, space)
    return POLISH_STEPS


@kernel
def verdict(problem: Problem, space: Space, size: float, low: float, high: float) -> int:
    """What kind of solution space holds; size is the sum of tensions, low and high the extreme stiffnesses."""
    cables, result = problem.cables, space.result
    gravity = problem.body[tables.GRAVITY]
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
        half_weight = 0.0 if problem.code == ELASTIC else 0.5 * cables[i, tables.DENSITY] * gravity
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
    if size == 0.0 or problem.code != energy_problem.code:
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


@kernel
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
        problem = Problem(code, k_h, k_p, freedom, cables, body, lengths[p], wrench, scale)
        energy_problem = Problem(energy_code, 0.0, 0.0, freedom, cables, body, lengths[p], wrench, scale)
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

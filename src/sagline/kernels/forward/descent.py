"""To an equilibrium: downhill in the energy, then by Newton's method on the wrench balance.

docs/model.md, section 6. The descent is Newton's method with a trust region, which ends in a stable equilibrium from
almost any start; what follows is the plain one, to the last digit. Steps are measured in units of the problem's scale.
"""

from __future__ import annotations

from sagline.arrays import Array
from sagline.kernels.algebra.dense import solve_general, trust_step
from sagline.kernels.balance.freedom import make_symmetric, norm, project, restricted, spread
from sagline.kernels.forward.platform import moved_pose, platform_energy, platform_stiffness, unbalance
from sagline.kernels.forward.problem import Problem, Space
from sagline.kernels.jit import kernel

DESCENT_STEPS = 150
POLISH_STEPS = 30
SHORTENINGS = 10
FIRST_RADIUS = 0.5  # of the trust region, in these units
LARGEST_RADIUS = 1.0
NEAR = 3e-3  # a full Newton step shorter than this leaves the rest to the polish
NOISE = 4e-15  # of the sum of an energy's parts: what rounding leaves of it
BALANCED = 1e-9  # of the sum of tensions and weight: an unbalance that counts as none
LAST_DIGIT = 1e-15  # a step, in these units, that rounding hides


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

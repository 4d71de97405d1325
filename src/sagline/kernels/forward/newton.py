"""Search for an equilibrium: Newton's method from a nearby pose, or energy descent with a trust region.

docs/model.md, section 6. The descent ends in a stable equilibrium from almost any start. Steps are in the problem's
units.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import copy, dot, factor_positive, norm, solve_general, solve_lower, solve_upper
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import end_motion_per_length
from sagline.kernels.cable.stiffness import force_by_length, force_change, force_of, plane_of
from sagline.kernels.cable.swivel import exit_in
from sagline.kernels.cable.terms import Model, PlaneVector, material_at
from sagline.kernels.forward import platform as f
from sagline.kernels.jit import glue, kernel
from sagline.kernels.statics import add_world_force, components_along, matrix_along, step_pose, symmetric_part


@kernel
def trust_step(matrix: Array, gradient: Array, radius: float, factor: Array, work: Array, step: Array) -> float:
    """Fill the step s that minimizes g.s + s.H s/2 within |s| <= `radius`. Returns the shift mu."""
    # The method of More and Sorensen solves (H + mu 1) s = -g. The number mu is the smallest with a positive definite
    # matrix and a step that is short enough. For mu = 0, the step is an ordinary Newton step.
    n = gradient.shape[0]
    frobenius = 0.0
    for i in range(n):
        for j in range(n):
            frobenius += matrix[i, j] * matrix[i, j]
    low = 0.0
    high = norm(gradient) / radius + math.sqrt(frobenius)
    shift = 0.0
    for _ in range(40):
        if not factor_positive(matrix, shift, factor):
            low = max(low, shift)
            shift = max(math.sqrt(low * high), low + 0.001 * (high - low))
            continue
        length = solve_step(factor, gradient, step)
        if length <= 1.1 * radius and (shift == 0.0 or length >= 0.8 * radius or high - low <= 1e-6 * high):
            break
        if length > radius:
            low = shift
        else:
            high = shift
        copy(step, work)
        solve_lower(factor, work)
        new = shift + dot(step, step) / dot(work, work) * (length - radius) / radius
        shift = new if low < new < high else max(math.sqrt(low * high), low + 0.1 * (high - low))
    return shift


POLISH_STEPS = 30
SHORTENINGS = 10
NEAR_STEPS = 6
NEAR = 3e-3  # length of a full Newton step below which Newton's method replaces the descent
PREDICTED = 0.03  # longest first-order step
SHRINKING = 0.3  # largest ratio of a Newton step to the previous Newton step
FRESH = 1e-4  # largest distance from the pose of a factored stiffness at which this stiffness is used again
BALANCED = 1e-9  # an unbalance below this share of the sum of tensions and weight counts as zero
LAST_DIGIT = 1e-15  # a shorter step is only a rounding error


@glue
def _add_length_change(model: Model, cables: Array, lengths: Array, rows: Array, wrench: Array) -> None:
    """Add to `wrench` (6,) the first-order change of the cable forces due to the new `lengths` (m,)."""
    for i in range(cables.shape[0]):
        span, rise, length = rows[g.SPAN, i], rows[g.RISE, i], rows[g.LENGTH, i]
        if model.behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
            wound = lengths[i] - length
            wound = -wound if f.is_on_platform(cables, i) else wound
            x, y, z = wound * rows[g.LONGER_X, i], wound * rows[g.LONGER_Y, i], wound * rows[g.LONGER_Z, i]
            add_world_force(rows, i, (x, y, z), wrench)
            if f.is_on_platform(cables, i):  # almost the whole moment
                px, py, pz = exit_in(rows, cables, i)
                wrench[3] += py * z - pz * y
                wrench[4] += pz * x - px * z
                wrench[5] += px * y - py * x
            continue
        if model.behind is not None:
            x, z, _gives = end_motion_per_length(model, cables, rows, i)
            slope = force_change(plane_of(rows, i), PlaneVector(x, z))
        else:
            material, force = material_at(cables, i), force_of(rows, i)
            slope = force_by_length(model, span, rise, material, length, force, plane_of(rows, i))
        wound = lengths[i] - length
        f.add_force(rows, i, wound * slope.x, wound * slope.z, wrench)


@kernel
def solve_step(factor: Array, part: Array, step: Array) -> float:
    """Fill the `step` (n,) that removes the unbalance `part` (n,), from the factored stiffness. Returns its length."""
    for j in range(part.shape[0]):
        step[j] = -part[j]
    solve_lower(factor, step)
    solve_upper(factor, step)
    return norm(step)


@glue
def predict(
    problem: f.PoseProblem, lengths: Array, start: Array, last: Array, space: f.ForwardArrays, pose: Array
) -> bool:
    """Move `pose` by the first-order effect of new lengths and wrench. False if `last` has no equilibrium at `start`.

    Afterwards the rows contain the new lengths.
    """
    known = problem.model.code == codes.CATENARY or problem.model.code == codes.ELASTIC
    for k in range(tables.POSE_COLUMNS):
        known = known and last[k] == start[k]
    if known:
        for k in range(6):
            space.gradient[k] = last[tables.LAST_WRENCH + k] - problem.wrench[k]
        _add_length_change(problem.model, problem.cables, lengths, space.rows, space.gradient)
        components_along(problem.free, space.gradient, space.part)
        known = solve_step(space.factor, space.part, space.step) <= PREDICTED
    if known:
        step_pose(problem.free, problem.body, start, space.step, space.motion, pose)
    copy(lengths, space.rows[g.LENGTH])
    return known


@glue
def newton_from(problem: f.PoseProblem, pose: Array, space: f.ForwardArrays) -> tuple[int, float]:
    """Take full Newton steps with the symmetric stiffness. Returns the number of steps and the last sum of tensions."""
    # The number is 0 if the stiffness is not positive definite or the first step is too long. In these cases, the pose
    # is unchanged, and `space.matrix` is the stiffness at the pose. The number is -1 if the steps do not decrease fast
    # enough. On return, all arrays of space belong to the final pose, except the stiffness. The skew part of the
    # stiffness (half of a given moment) is neglected, which costs one additional step.
    model, cables, body, wrench, free = problem.model, problem.cables, problem.body, problem.wrench, problem.free
    rotation, rows, gradient = space.rotation, space.rows, space.gradient
    part, step = space.part, space.step
    best, before = math.inf, NEAR / SHRINKING
    age = math.inf  # distance from the pose of the factored stiffness
    steps = -1
    size = 0.0
    last = False
    for iteration in range(NEAR_STEPS + 1):
        size = f.unbalance(model, cables, body, wrench, pose, rotation, rows, gradient)
        rest = components_along(free, gradient, part)
        if last:
            steps = iteration if rest <= BALANCED * size * problem.unit else -1
            break
        if not rest <= best:
            break
        best = rest
        if age > FRESH:
            f.platform_stiffness(model, cables, rows, space.stiffness)
            symmetric_part(free, space.stiffness, space.matrix)
            age = 0.0
            if not factor_positive(space.matrix, 0.0, space.factor):
                steps = -min(iteration, 1)
                break
        length = solve_step(space.factor, part, step)
        if length <= LAST_DIGIT:
            steps = max(iteration, 1)
            break
        if not length <= SHRINKING * before:
            steps = -min(iteration, 1)
            break
        last = length * length <= LAST_DIGIT * before  # the ratio of successive steps is constant
        before = length
        age += length
        step_pose(free, body, pose, step, space.motion, space.trial)
        copy(space.trial, pose)
    return steps, size


@glue
def _newton_steps(
    problem: f.PoseProblem, pose: Array, space: f.ForwardArrays, best: float, good: float
) -> tuple[float, float]:
    """Take one Newton step for the force balance, shortened until the unbalance is below `best`. Uses the stiffness."""
    # Returns the new unbalance and the length of the step. If no step is better, the length is 0 and the pose is
    # unchanged. An unbalance below `good` can increase by rounding; then only the full step is tried.
    model, cables, body, wrench, free = problem.model, problem.cables, problem.body, problem.wrench, problem.free
    step, trial, part = space.step, space.trial, space.part
    matrix_along(free, space.stiffness, space.matrix)
    components_along(free, space.gradient, step)
    better = False
    new, length = best, 0.0
    if solve_general(space.matrix, step):
        length = norm(step)
    if length > LAST_DIGIT:
        share = -1.0
        for shortening in range(SHORTENINGS + 1):
            last = shortening == SHORTENINGS or (shortening > 0 and best <= good)
            if last:  # no step reduces the unbalance: restore the pose
                copy(pose, trial)
            else:
                for j in range(step.shape[0]):
                    step[j] *= share
                step_pose(free, body, pose, step, space.motion, trial)
            f.unbalance(model, cables, body, wrench, trial, space.rotation, space.rows, space.gradient)
            new = components_along(free, space.gradient, part)
            better = new < best and not last
            if better or last:
                break
            share = 0.25
        length = norm(step)
        copy(trial, pose)
    return (new, length) if better else (best, 0.0)


@glue
def polish(problem: f.PoseProblem, pose: Array, space: f.ForwardArrays, good: float) -> int:
    """Take Newton steps for the force balance until the unbalance no longer decreases. Returns the number of steps."""
    # `good`: an unbalance below this counts as zero. The work arrays belong to the initial pose before the steps, and
    # to the final pose after the steps. The stiffness may belong to a pose that differs by rounding errors.
    best = components_along(problem.free, space.gradient, space.part)
    before = 0.0
    steps = POLISH_STEPS
    for iteration in range(POLISH_STEPS):
        f.platform_stiffness(problem.model, problem.cables, space.rows, space.stiffness)
        best, length = _newton_steps(problem, pose, space, best, good)
        # a step is about as long as the error before it; the next step would be about length^3/before^2
        if length == 0.0 or length * length * length <= LAST_DIGIT * before * before:
            steps = iteration + 1
            break
        before = length
    return steps


DESCENT_STEPS = 150
FIRST_RADIUS = 0.5  # radius of the trust region, in the problem's units
LARGEST_RADIUS = 1.0
SMALLEST_RADIUS = 1e-14
NOISE = 4e-15  # rounding error of an energy, relative to the sum of its parts


@glue
def descend(problem: f.PoseProblem, pose: Array, space: f.ForwardArrays, known: float) -> tuple[int, float]:
    """Decrease the energy until a full Newton step is short. A pose in equilibrium stays, even if it is unstable."""
    # `known`: sum of tensions at the pose if `space` contains the arrays and the stiffness of this pose; otherwise 0.
    # Returns the number of tried steps, and the sum of tensions at the pose. The sum is 0 if the last pose was
    # rejected.
    model, cables, body, wrench, free = problem.model, problem.cables, problem.body, problem.wrench, problem.free
    trial, motion, rotation, rows, gradient = space.trial, space.motion, space.rotation, space.rows, space.gradient
    matrix, part, step = space.matrix, space.part, space.step
    radius = FIRST_RADIUS
    steps, tensions = DESCENT_STEPS, known
    energy, size, promised, shift, length = 0.0, 0.0, 0.0, 0.0, 0.0
    copy(pose, trial)
    for iteration in range(DESCENT_STEPS + 1):
        if iteration > 0 or known == 0.0:
            tensions = f.unbalance(model, cables, body, wrench, trial, rotation, rows, gradient)
        new_energy, new_size = f.platform_energy(model, cables, body, wrench, trial, rotation, rows)
        fresh = True
        if iteration == 0:
            if components_along(free, gradient, part) <= BALANCED * tensions * problem.unit:
                steps = 0
                break
        else:
            gain = energy - new_energy
            for k in range(3):  # minus the work of the given moment along the motion
                gain += wrench[3 + k] * motion[3 + k]
            noise = NOISE * (size + new_size)
            fresh = gain + noise >= 0.1 * promised  # the comparison is also False for NaN
            if not fresh:
                radius = 0.3 * min(length, radius)
                tensions = 0.0
                if not radius > SMALLEST_RADIUS:
                    steps = iteration
                    break
            else:
                copy(trial, pose)
                if shift == 0.0 and (length <= NEAR or promised <= noise):
                    steps = iteration
                    break
                if gain >= 0.6 * promised and length >= 0.7 * radius:
                    radius = min(2.0 * radius, LARGEST_RADIUS)
                elif gain < 0.3 * promised:
                    radius = 0.5 * length
        if fresh:
            energy, size = new_energy, new_size
            if iteration > 0 or known == 0.0:
                f.platform_stiffness(model, cables, rows, space.stiffness)
                symmetric_part(free, space.stiffness, matrix)
            components_along(free, gradient, part)
        shift = trust_step(matrix, part, radius, space.factor, motion[: part.shape[0]], step)
        length = norm(step)
        promised = _promised_gain(matrix, part, step)
        step_pose(free, body, pose, step, motion, trial)
    return steps, tensions


@glue
def _promised_gain(matrix: Array, gradient: Array, step: Array) -> float:
    """Decrease of the energy along `step`, predicted by the quadratic model."""
    gain = 0.0
    for j in range(step.shape[0]):
        gain -= gradient[j] * step[j]
        for k in range(step.shape[0]):
            gain -= 0.5 * step[j] * matrix[j, k] * step[k]
    return gain

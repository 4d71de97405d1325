"""To an equilibrium from far: downhill in the energy, by Newton's method with a trust region.

docs/model.md, section 6. It ends in a stable equilibrium from almost any start. Steps are in the problem's
units.
"""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.algebra.trust_step import trust_step
from sagline.kernels.balance.freedom import components_along, norm, symmetric_part
from sagline.kernels.forward.newton import BALANCED, NEAR
from sagline.kernels.forward.platform import platform_energy, platform_stiffness, step_pose, unbalance
from sagline.kernels.forward.problem import ForwardArrays, PoseProblem, copy_pose
from sagline.kernels.jit import glue

DESCENT_STEPS = 150
FIRST_RADIUS = 0.5  # of the trust region, in these units
LARGEST_RADIUS = 1.0
NOISE = 4e-15  # of the sum of an energy's parts: what rounding leaves of it


@glue
def descend(problem: PoseProblem, pose: Array, space: ForwardArrays, known: float) -> tuple[int, float]:
    """Move pose downhill until a full Newton step is short; a start in balance stays where it is, stable or not.

    known: the sum of tensions that `unbalance` gave at the pose, if space is still that of the pose with its stiffness
    as matrix; else 0.

    Returns the number of steps tried, and that sum at the pose; 0 where the last pose tried was another.
    """
    model, cables, body, wrench, free = problem.model, problem.cables, problem.body, problem.wrench, problem.free
    trial, motion, rotation, rows, gradient = space.trial, space.motion, space.rotation, space.rows, space.gradient
    matrix, part, step = space.matrix, space.part, space.step
    radius = FIRST_RADIUS
    steps, tensions = DESCENT_STEPS, known
    energy, size, promised, shift, length = 0.0, 0.0, 0.0, 0.0, 0.0
    copy_pose(pose, trial)
    for iteration in range(DESCENT_STEPS + 1):
        if iteration > 0 or known == 0.0:
            tensions = unbalance(model, cables, body, wrench, trial, rotation, rows, gradient)
        new_energy, new_size = platform_energy(model, cables, body, wrench, trial, rotation, rows)
        fresh = True
        if iteration == 0:
            if components_along(free, gradient, part) <= BALANCED * tensions * problem.unit:
                steps = 0
                break
        else:
            gain = energy - new_energy
            for k in range(3):  # the work of a given moment along the motion
                gain += wrench[3 + k] * motion[3 + k]
            noise = NOISE * (size + new_size)
            fresh = gain + noise >= 0.1 * promised  # false for NaN too
            if not fresh:
                radius = 0.3 * min(length, radius)
                tensions = 0.0
                if not radius > 1e-14:
                    steps = iteration
                    break
            else:
                copy_pose(trial, pose)
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
                platform_stiffness(model, cables, rows, space.stiffness)
                symmetric_part(free, space.stiffness, matrix)
            components_along(free, gradient, part)
        shift = trust_step(matrix, part, radius, space.factor, motion, step)
        length = norm(step)
        promised = _promised_gain(matrix, part, step)
        step_pose(free, body, pose, step, motion, trial)
    return steps, tensions


@glue
def _promised_gain(matrix: Array, gradient: Array, step: Array) -> float:
    """Decrease of the quadratic model of the energy along a step."""
    gain = 0.0
    for j in range(step.shape[0]):
        gain -= gradient[j] * step[j]
        for k in range(step.shape[0]):
            gain -= 0.5 * step[j] * matrix[j, k] * step[k]
    return gain

"""Forward kinematics of straight cables: the least-squares pose, found by the Levenberg-Marquardt method.

The model is for comparison with the exact cable. It does not distinguish slack cables from taut cables. All lengths
have the same weight. A mirrored pose fits the lengths as well as the true pose.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import factor_positive
from sagline.kernels.algebra.functions import angle
from sagline.kernels.balance.pose import step_pose
from sagline.kernels.balance.wrench import components_along
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.over_pulleys import chord_at, material_at
from sagline.kernels.cable.pulley import Wrap, behind_cable, pulley_at, straight_behind
from sagline.kernels.cable.terms import Model
from sagline.kernels.forward.newton import solve_step
from sagline.kernels.forward.platform import add_force
from sagline.kernels.forward.problem import (
    ENERGY,
    ITERATIONS,
    ForwardArrays,
    ForwardSamples,
    LastEquilibrium,
    LastEquilibriumArrays,
    PoseProblem,
    SampleArrays,
    SolutionArrays,
    Solutions,
    clear_solution,
    copy_pose,
    new_forward_arrays,
    new_motions,
    problem_at,
    row_of,
)
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory

FIT_STEPS = 200
FIRST_DAMPING = 1e-3  # relative to the largest diagonal element
SMALL_STEP = 1e-14  # a fit ends at a smaller step, in the problem's units
NOTHING = 1e-13  # a fit ends at a smaller relative decrease of the cost


@formula
def _straight_length(cables: Array, rows: Array, i: int) -> float:
    """Length of an unstrained straight cable [m], including pulley and dead length."""
    return rows[g.CHORD, i] + straight_behind(pulley_at(cables, i), chord_at(rows, i))


@kernel
def _half_square_error(cables: Array, body: Array, lengths: Array, pose: Array, rotation: Array, rows: Array) -> float:
    """Half the sum of squared length errors [m^2] at `pose`. Fills the geometry of this pose."""
    cable_geometry(cables, body, pose, rotation, rows)
    total = 0.0
    for i in range(lengths.shape[0]):
        error = _straight_length(cables, rows, i) - lengths[i]
        total += 0.5 * error * error
    return total


@glue
def _normal_equations(free: Array, cables: Array, lengths: Array, space: ForwardArrays) -> None:
    """Fill matrix J^T J (n, n) and part J^T e (n,) of the length errors e along the free motions."""
    rows, matrix, part = space.rows, space.matrix, space.part
    full, row = space.gradient, space.step
    n = part.shape[0]
    for j in range(n):
        part[j] = 0.0
        for k in range(n):
            matrix[j, k] = 0.0
    for i in range(lengths.shape[0]):
        for j in range(6):
            full[j] = 0.0
        add_force(rows, i, rows[g.COSINE, i], rows[g.SINE, i], full)
        components_along(free, full, row)
        error = _straight_length(cables, rows, i) - lengths[i]
        for j in range(n):
            part[j] += row[j] * error
            for k in range(n):
                matrix[j, k] += row[j] * row[k]


@glue
def _fit_pose(problem: PoseProblem, lengths: Array, pose: Array, space: ForwardArrays) -> tuple[float, int, bool]:
    """Move `pose` to the best fit. Returns half the sum of squares [m^2], number of steps, and True on success."""
    cables, body, free = problem.cables, problem.body, problem.free
    rotation, rows = space.rotation, space.rows
    cost = _half_square_error(cables, body, lengths, pose, rotation, rows)
    _normal_equations(free, cables, lengths, space)
    largest = 0.0
    for j in range(space.part.shape[0]):
        largest = max(largest, space.matrix[j, j])
    damping = FIRST_DAMPING * largest
    steps, fitted = FIT_STEPS, False
    for iteration in range(FIT_STEPS):
        if not factor_positive(space.matrix, damping, space.factor):
            damping = max(10.0 * damping, 1e-15 * largest)
            continue
        length = solve_step(space.factor, space.part, space.step)
        if length <= SMALL_STEP:
            steps, fitted = iteration, True
            break
        step_pose(free, body, pose, space.step, space.motion, space.trial)
        new = _half_square_error(cables, body, lengths, space.trial, rotation, rows)
        if new < cost:
            copy_pose(space.trial, pose)
            gain = cost - new
            cost = new
            damping = 0.1 * damping if damping > 1e-14 * largest else 0.0
            _normal_equations(free, cables, lengths, space)
            fitted = gain <= NOTHING * cost
        else:
            fitted = length <= 1e-7  # squared errors have a rounding error of the square root of machine precision
            damping = max(10.0 * damping, 1e-12 * largest)
        if fitted:
            steps = iteration + 1
            break
    _half_square_error(cables, body, lengths, pose, rotation, rows)
    return cost, steps, fitted


@entry
def fit_poses(
    chained: bool,
    given: SampleArrays,
    chain: LastEquilibriumArrays,
    memory: tuple[Array, Indices],
    found: SolutionArrays,
) -> None:
    """Fit all samples; arguments as in `forward_poses`. Forces are NaN, and the energy is half the sum of squares."""
    batch, answer, kept = ForwardSamples(*given), Solutions(*found), LastEquilibrium(*chain)
    count, m = batch.lengths.shape
    space, rest = new_forward_arrays(Memory(*memory), kept.rows, kept.factor)
    free, arcs, start, pose = new_motions(rest, batch.freedom.shape[0])
    copy_pose(batch.starts[0], start)
    for p in range(count):
        clear_solution(answer, p, codes.FORWARD_NO_LENGTHS, codes.CABLE_NO_TENSION)
        if math.isnan(batch.lengths[p, 0]):
            continue
        if not chained:
            copy_pose(row_of(batch.starts, p), start)
        problem = problem_at(Model(codes.STRAIGHT, 0.0, 0.0, 0.0, None), batch, p, free, arcs)
        copy_pose(start, pose)
        answer.numbers[p, ENERGY], answer.numbers[p, ITERATIONS], fitted = _fit_pose(
            problem, batch.lengths[p], pose, space
        )
        answer.pose_statuses[p] = codes.FORWARD_FITTED if fitted else codes.FORWARD_NOT_CONVERGED
        copy_pose(pose, answer.poses[p])
        if fitted:
            copy_pose(pose, start)
        for i in range(m):
            answer.results[tables.SPAN, p, i] = space.rows[g.SPAN, i]
            answer.results[tables.RISE, p, i] = space.rows[g.RISE, i]
            answer.results[tables.LENGTH, p, i] = batch.lengths[p, i]
            if answer.results.shape[0] > tables.BARE_ROWS:
                pulley, chord = pulley_at(problem.cables, i), chord_at(space.rows, i)
                sine, cosine = chord.cosine, pulley.entry * chord.sine
                wrap = Wrap(sine, cosine, angle(sine, cosine))
                wrapped, dead = behind_cable(problem.model, material_at(problem.cables, i), pulley, 0.0, wrap)
                answer.results[tables.WRAP, p, i] = wrap.angle
                answer.results[tables.WRAPPED, p, i] = wrapped
                answer.results[tables.DEAD, p, i] = dead
                answer.results[tables.SINE, p, i] = chord.sine

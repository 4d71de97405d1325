"""Forward kinematics of a batch: the pose of the platform at rest on cables of given lengths; docs/model.md, section 6.

For straight cables, the result is the least-squares pose, found by the Levenberg-Marquardt method. The model of
straight cables is for comparison with the exact cable. Straight cables are never slack. All lengths have the same
weight. A mirrored pose fits the lengths as well as the true pose.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import copy, extreme_eigenvalues, factor_positive
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import behind_at
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.pulley import Wrap, behind_cable, pulley_at, straight_behind
from sagline.kernels.cable.terms import Model, chord_at, material_at
from sagline.kernels.forward import platform as f
from sagline.kernels.forward.newton import BALANCED, descend, newton_from, polish, predict, solve_step
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory
from sagline.kernels.statics import components_along, squares_along, step_pose, symmetric_part

FLAT = 1e-9  # a stiffness below this share of the largest stiffness counts as zero
OVERSTRETCHED = 0.1  # strain above which a result is unrealistic
PREDICTION, FROM_START, DOWNHILL = 0, 1, 2  # methods for finding the equilibrium, in the order in which they are tried


@glue
def _support_status(model: Model, cables: Array, rows: Array, needed: int) -> int:
    """Status of a stable platform, which depends on the number of taut cables. `needed`: required number."""
    taut = 0
    strain = 0.0
    for i in range(cables.shape[0]):
        tension = rows[g.TENSION, i]
        half_weight = 0.0 if model.code == codes.ELASTIC else 0.5 * cables[i, tables.DENSITY] * model.gravity
        taut += 1 if tension > half_weight * rows[g.CHORD, i] else 0
        strain = max(strain, tension / cables[i, tables.STIFFNESS])
    if strain > OVERSTRETCHED:
        return codes.FORWARD_OVERSTRETCHED
    return codes.FORWARD_LOOSE if taut < min(needed, cables.shape[0]) else codes.FORWARD_SOLVED


@glue
def _find_pose(
    problem: f.PoseProblem,
    exact: Model,
    lengths: Array,
    start: Array,
    chain: f.LastEquilibrium,
    space: f.ForwardArrays,
    pose: Array,
) -> tuple[int, float]:
    """Find the equilibrium by the first method that succeeds. Returns the number of steps and the sum of tensions."""
    # On return, `space` contains unbalance, stiffness and factor of the stiffness at the pose. The first number of the
    # factor is NaN if there is no factor. `exact`: a model with an energy. The equilibrium with `exact` is the start of
    # the search with the model of `problem`.
    model, cables, body, wrench, free = problem.model, problem.cables, problem.body, problem.wrench, problem.free
    steps, size, known = 0, 0.0, 0.0
    positive = False
    predicted = predict(problem, lengths, start, chain.last, space, pose)
    for way in range(PREDICTION if predicted else FROM_START, DOWNHILL + 1):
        if way != PREDICTION:
            copy(start, pose)
        if way != DOWNHILL:
            steps, size = newton_from(problem, pose, space)
            known = size if steps == 0 and way == FROM_START and model.code == exact.code else 0.0
            if steps <= 0:
                continue
            f.platform_stiffness(model, cables, space.rows, space.stiffness)
        else:
            downhill = f.PoseProblem(exact, free, cables, body, wrench, problem.unit)
            steps, size = descend(downhill, pose, space, known)
            if size == 0.0 or model.code != exact.code:
                size = f.unbalance(model, cables, body, wrench, pose, space.rotation, space.rows, space.gradient)
            steps += polish(problem, pose, space, BALANCED * size * problem.unit)
        symmetric_part(free, space.stiffness, space.matrix)
        positive = factor_positive(space.matrix, 0.0, space.factor)
        if positive:
            break
    if not positive:
        space.factor[0, 0] = math.nan
    return steps, size


@glue
def _fill_stability(
    problem: f.PoseProblem, pose: Array, arcs: Array, size: float, space: f.ForwardArrays, numbers: Array
) -> int:
    """Fill `numbers`, except residuals and steps, for the pose in the work arrays. Returns the status of the pose."""
    model, cables, body = problem.model, problem.cables, problem.body
    numbers[tables.ENERGY] = f.platform_energy(model, cables, body, problem.wrench, pose, space.rotation, space.rows)[0]
    symmetric_part(arcs, space.stiffness, space.matrix)
    low, high = extreme_eigenvalues(space.matrix, space.part, space.step, space.motion, FLAT)
    numbers[tables.STIFFNESS_MIN] = low
    status = codes.FORWARD_SOLVED if low > FLAT * high else codes.FORWARD_SINGULAR
    if low < -FLAT * high:
        status = codes.FORWARD_UNSTABLE
    if not components_along(problem.free, space.gradient, space.part) <= BALANCED * size * problem.unit:
        status = codes.FORWARD_NOT_CONVERGED
    elif status == codes.FORWARD_SOLVED:
        status = _support_status(model, cables, space.rows, arcs.shape[0])
    return status


@glue
def _store_sample(problem: f.PoseProblem, rows: Array, p: int, results: Array, statuses: Codes) -> None:
    """Write the cables of sample `p`."""
    for i in range(rows.shape[1]):
        statuses[p, i] = int(rows[g.STATUS, i])
        results[tables.SPAN, p, i] = rows[g.SPAN, i]
        results[tables.RISE, p, i] = rows[g.RISE, i]
    for k in range(tables.WRAP - tables.LENGTH):  # length and forces have the same order in both arrays
        copy(rows[g.LENGTH + k], results[tables.LENGTH + k, p])
    if problem.model.behind is not None:
        for i in range(rows.shape[1]):
            wrapped, dead = behind_at(problem.model, problem.cables, rows, i)
            results[tables.SPAN, p, i] = rows[g.FREE_SPAN, i]
            results[tables.RISE, p, i] = rows[g.FREE_RISE, i]
            results[tables.WRAP, p, i] = rows[g.WRAP, i]
            results[tables.WRAPPED, p, i] = wrapped
            results[tables.DEAD, p, i] = dead
            results[tables.SINE, p, i] = rows[g.SINE, i]
            if results.shape[0] > tables.RESULT_ROWS:
                results[tables.AZIMUTH, p, i] = math.atan2(rows[g.AZIMUTH_Y, i], rows[g.AZIMUTH_X, i])
            if f.is_on_platform(problem.cables, i):  # from the frame anchor to the exit point
                results[tables.RISE, p, i] = -rows[g.FREE_RISE, i]
                weight = problem.cables[i, tables.DENSITY] * problem.model.gravity * rows[g.FREE_LENGTH, i]
                weight = weight if problem.model.code == codes.CATENARY else 0.0
                results[tables.VERTICAL, p, i] = weight - rows[g.VERTICAL, i]
                results[tables.SINE, p, i] = -rows[g.SINE, i]
                results[tables.AZIMUTH, p, i] = math.atan2(-rows[g.AZIMUTH_Y, i], -rows[g.AZIMUTH_X, i])


@entry
def forward_poses(
    model: f.ForwardTerms,
    chained: bool,
    given: f.SampleArrays,
    chain: f.LastEquilibriumArrays,
    memory: tuple[Array, Indices],
    found: f.SolutionArrays,
) -> None:
    """Solve every sample in turn."""
    # model: Cable model, the empirical model's constants, and True if cables may have pulleys or dead lengths, else
    #   None. With a shallow model, only the last steps use this model; the descent before them uses the exact cable.
    # chained: True if the first sample starts at starts[0], and each later sample at the previous result.
    # given: `ForwardSamples`.
    # chain: `LastEquilibrium`. A chain of samples that starts at this pose also uses the stored stiffness.
    # memory: Work arrays from `memory_for`, for the number of cables.
    # found: `Solutions`, which is filled.
    batch, answer, kept = f.ForwardSamples(*given), f.Solutions(*found), f.LastEquilibrium(*chain)
    code, k_h, k_p, behind = model
    count = batch.lengths.shape[0]
    space, rest = f.new_forward_arrays(Memory(*memory), kept.rows, kept.factor)
    free, arcs, start, pose = f.new_motions(rest, batch.freedom.shape[0])
    copy(batch.starts[0], start)
    for p in range(count):
        if math.isnan(batch.lengths[p, 0]):
            f.clear_solution(answer, p, codes.FORWARD_NO_LENGTHS, 0)
            continue
        if not chained:  # a result must not depend on the previous sample
            copy(f.row_of(batch.starts, p), start)
            kept.last[0] = math.nan
            kept.rows[g.PARAMETER] = math.nan
        problem = f.problem_at(Model(code, k_h, k_p, 0.0, behind), batch, p, free, arcs)
        exact = Model(
            codes.ELASTIC if code == codes.ELASTIC else codes.CATENARY, 0.0, 0.0, problem.model.gravity, behind
        )
        steps, size = _find_pose(problem, exact, batch.lengths[p], start, kept, space, pose)
        status = _fill_stability(problem, pose, arcs, size, space, answer.numbers[p])
        components_along(batch.freedom, space.gradient, space.part)
        force, moment = squares_along(batch.freedom, space.part)
        answer.numbers[p, tables.FORCE_RESIDUAL], answer.numbers[p, tables.MOMENT_RESIDUAL] = (
            math.sqrt(force),
            math.sqrt(moment),
        )
        answer.numbers[p, tables.ITERATIONS] = steps
        answer.pose_statuses[p] = status
        copy(pose, answer.poses[p])
        _store_sample(problem, kept.rows, p, answer.results, answer.statuses)
        kept.last[0] = math.nan
        if status != codes.FORWARD_NOT_CONVERGED:
            copy(pose, start)
            if not math.isnan(kept.factor[0, 0]):
                copy(pose, kept.last)
                copy(problem.wrench, kept.last[tables.LAST_WRENCH :])


FIT_STEPS = 200
FIRST_DAMPING = 1e-3  # initial shift of the diagonal, relative to its largest element
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
def _normal_equations(free: Array, cables: Array, lengths: Array, space: f.ForwardArrays) -> None:
    """Fill J^T J (n, n) and J^T e (n,). J: derivatives of the length errors e by the free motions."""
    rows, matrix, part = space.rows, space.matrix, space.part
    full, row = space.gradient, space.step
    n = part.shape[0]
    part[:] = 0.0
    matrix[:] = 0.0
    for i in range(lengths.shape[0]):
        full[:] = 0.0
        f.add_force(rows, i, rows[g.COSINE, i], rows[g.SINE, i], full)
        components_along(free, full, row)
        error = _straight_length(cables, rows, i) - lengths[i]
        for j in range(n):
            part[j] += row[j] * error
            for k in range(n):
                matrix[j, k] += row[j] * row[k]


@glue
def _fit_pose(problem: f.PoseProblem, lengths: Array, pose: Array, space: f.ForwardArrays) -> tuple[float, int, bool]:
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
            copy(space.trial, pose)
            gain = cost - new
            cost = new
            damping = 0.1 * damping if damping > 1e-14 * largest else 0.0
            _normal_equations(free, cables, lengths, space)
            fitted = gain <= NOTHING * cost
        else:
            fitted = length <= 1e-7  # a sum of squares determines the pose only to the square root of machine precision
            damping = max(10.0 * damping, 1e-12 * largest)
        if fitted:
            steps = iteration + 1
            break
    _half_square_error(cables, body, lengths, pose, rotation, rows)
    return cost, steps, fitted


@entry
def fit_poses(
    chained: bool,
    given: f.SampleArrays,
    chain: f.LastEquilibriumArrays,
    memory: tuple[Array, Indices],
    found: f.SolutionArrays,
) -> None:
    """Fit all samples; arguments as in `forward_poses`. Forces become NaN; the energy is half the sum of squares."""
    batch, answer, kept = f.ForwardSamples(*given), f.Solutions(*found), f.LastEquilibrium(*chain)
    count, m = batch.lengths.shape
    space, rest = f.new_forward_arrays(Memory(*memory), kept.rows, kept.factor)
    free, arcs, start, pose = f.new_motions(rest, batch.freedom.shape[0])
    copy(batch.starts[0], start)
    for p in range(count):
        f.clear_solution(answer, p, codes.FORWARD_NO_LENGTHS, codes.CABLE_NO_TENSION)
        if math.isnan(batch.lengths[p, 0]):
            continue
        if not chained:
            copy(f.row_of(batch.starts, p), start)
        problem = f.problem_at(Model(codes.STRAIGHT, 0.0, 0.0, 0.0, None), batch, p, free, arcs)
        copy(start, pose)
        answer.numbers[p, tables.ENERGY], answer.numbers[p, tables.ITERATIONS], fitted = _fit_pose(
            problem, batch.lengths[p], pose, space
        )
        answer.pose_statuses[p] = codes.FORWARD_FITTED if fitted else codes.FORWARD_NOT_CONVERGED
        copy(pose, answer.poses[p])
        if fitted:
            copy(pose, start)
        copy(space.rows[g.SPAN], answer.results[tables.SPAN, p])
        copy(space.rows[g.RISE], answer.results[tables.RISE, p])
        copy(batch.lengths[p], answer.results[tables.LENGTH, p])
        if answer.results.shape[0] > tables.BARE_ROWS:
            for i in range(m):
                pulley, chord = pulley_at(problem.cables, i), chord_at(space.rows, i)
                sine, cosine = chord.cosine, pulley.entry * chord.sine
                wrap = Wrap(sine, cosine, angle(sine, cosine))
                wrapped, dead = behind_cable(problem.model, material_at(problem.cables, i), pulley, 0.0, wrap)
                answer.results[tables.WRAP, p, i] = wrap.angle
                answer.results[tables.WRAPPED, p, i] = wrapped
                answer.results[tables.DEAD, p, i] = dead
                answer.results[tables.SINE, p, i] = chord.sine

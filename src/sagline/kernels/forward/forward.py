"""Forward kinematics of a batch: the pose of the platform at rest on cables of given lengths.

docs/model.md, section 6.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.eigenvalues import extreme_eigenvalues
from sagline.kernels.algebra.factors import factor_positive
from sagline.kernels.balance.wrench import components_along, is_rotation, symmetric_part
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.over_pulleys import behind_at
from sagline.kernels.cable.terms import Model
from sagline.kernels.forward.newton import BALANCED, descend, newton_from, polish, predict
from sagline.kernels.forward.platform import platform_energy, platform_stiffness, unbalance
from sagline.kernels.forward.problem import (
    ENERGY,
    FORCE_RESIDUAL,
    ITERATIONS,
    LAST_WRENCH,
    MOMENT_RESIDUAL,
    STIFFNESS_MIN,
    ForwardArrays,
    ForwardSamples,
    ForwardTerms,
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
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory

FLAT = 1e-9  # relative to the largest stiffness; a smaller stiffness counts as zero
OVERSTRETCHED = 0.1  # strain above which a result is unrealistic
PREDICTION, FROM_START, DOWNHILL = 0, 1, 2  # methods for finding the equilibrium, in the order in which they are tried


@glue
def _stability(low: float, high: float) -> int:
    """Stability of an equilibrium with the smallest stiffness `low` and the largest stiffness `high`."""
    if low < -FLAT * high:
        return codes.FORWARD_UNSTABLE
    return codes.FORWARD_SOLVED if low > FLAT * high else codes.FORWARD_SINGULAR


@glue
def _support_status(model: Model, cables: Array, rows: Array, needed: int) -> int:
    """Status of a stable platform: held by enough taut cables or not; `needed`: required number of taut cables."""
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
def _fill_residuals(freedom: Array, gradient: Array, numbers: Array) -> None:
    """Fill the norms of the unbalanced force [N] and moment [N m] along the free motions."""
    force = 0.0
    moment = 0.0
    for j in range(freedom.shape[0]):
        total = 0.0
        for a in range(6):
            total += freedom[j, a] * gradient[a]
        if is_rotation(freedom, j):
            moment += total * total
        else:
            force += total * total
    numbers[FORCE_RESIDUAL] = math.sqrt(force)
    numbers[MOMENT_RESIDUAL] = math.sqrt(moment)


@glue
def _find_pose(
    problem: PoseProblem,
    exact: Model,
    lengths: Array,
    start: Array,
    chain: LastEquilibrium,
    space: ForwardArrays,
    pose: Array,
) -> tuple[int, float]:
    """Find the equilibrium by the first method that succeeds. Returns the number of steps and the sum of tensions.

    On return, `space` contains unbalance, stiffness and factor of the stiffness at the pose. The first number of the
    factor is NaN if there is no factor. `exact`: a model with an energy, whose equilibrium is the start for the model
    of `problem`.
    """
    model, cables, body, wrench, free = problem.model, problem.cables, problem.body, problem.wrench, problem.free
    steps, size, known = 0, 0.0, 0.0
    positive = False
    predicted = predict(problem, lengths, start, chain.last, space, pose)
    for way in range(PREDICTION if predicted else FROM_START, DOWNHILL + 1):
        if way != PREDICTION:
            copy_pose(start, pose)
        if way != DOWNHILL:
            steps, size = newton_from(problem, pose, space)
            known = size if steps == 0 and way == FROM_START and model.code == exact.code else 0.0
            if steps <= 0:
                continue
            platform_stiffness(model, cables, space.rows, space.stiffness)
        else:
            downhill = PoseProblem(exact, free, cables, body, wrench, problem.unit)
            steps, size = descend(downhill, pose, space, known)
            if size == 0.0 or model.code != exact.code:
                size = unbalance(model, cables, body, wrench, pose, space.rotation, space.rows, space.gradient)
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
    problem: PoseProblem, pose: Array, arcs: Array, size: float, space: ForwardArrays, numbers: Array
) -> int:
    """Fill `numbers` for the pose in the work arrays, except residuals and steps. Returns the status."""
    model, cables, body = problem.model, problem.cables, problem.body
    numbers[ENERGY] = platform_energy(model, cables, body, problem.wrench, pose, space.rotation, space.rows)[0]
    symmetric_part(arcs, space.stiffness, space.matrix)
    low, high = extreme_eigenvalues(space.matrix, space.part, space.step, space.motion, FLAT)
    numbers[STIFFNESS_MIN] = low
    status = _stability(low, high)
    if not components_along(problem.free, space.gradient, space.part) <= BALANCED * size * problem.unit:
        status = codes.FORWARD_NOT_CONVERGED
    elif status == codes.FORWARD_SOLVED:
        status = _support_status(model, cables, space.rows, arcs.shape[0])
    return status


@glue
def _store_chain(chain: LastEquilibrium, pose: Array, wrench: Array) -> None:
    """Store `pose` and its factored stiffness as the last equilibrium."""
    if not math.isnan(chain.factor[0, 0]):
        copy_pose(pose, chain.last)
        for k in range(6):
            chain.last[LAST_WRENCH + k] = wrench[k]


@glue
def _store_sample(problem: PoseProblem, rows: Array, p: int, results: Array, statuses: Codes) -> None:
    """Write the cables of sample `p`."""
    for i in range(rows.shape[1]):
        statuses[p, i] = int(rows[g.STATUS, i])
        results[tables.SPAN, p, i] = rows[g.SPAN, i]
        results[tables.RISE, p, i] = rows[g.RISE, i]
    for k in range(tables.WRAP - tables.LENGTH):  # length and forces have the same order in both arrays
        for i in range(rows.shape[1]):
            results[tables.LENGTH + k, p, i] = rows[g.LENGTH + k, i]
    if problem.model.behind is not None:
        for i in range(rows.shape[1]):
            wrapped, dead = behind_at(problem.model, problem.cables, rows, i)
            results[tables.SPAN, p, i] = rows[g.FREE_SPAN, i]
            results[tables.RISE, p, i] = rows[g.FREE_RISE, i]
            results[tables.WRAP, p, i] = rows[g.WRAP, i]
            results[tables.WRAPPED, p, i] = wrapped
            results[tables.DEAD, p, i] = dead
            results[tables.SINE, p, i] = rows[g.SINE, i]


@entry
def forward_poses(
    model: ForwardTerms,
    chained: bool,
    given: SampleArrays,
    chain: LastEquilibriumArrays,
    memory: tuple[Array, Indices],
    found: SolutionArrays,
) -> None:
    """Solve every sample in turn.

    Args:
        model: Cable model, the empirical model's constants, and True if cables may have pulleys or dead lengths, else
            None. For shallow models, only the last steps use the model; the descent before them uses the exact cable.
        chained: True if each sample starts at the previous result, and the first sample at starts[0].
        given: `ForwardSamples`.
        chain: `LastEquilibrium`. A chain of samples that starts at this pose also uses the stored stiffness.
        memory: Work arrays from `memory_for`, for the number of cables.
        found: `Solutions`, which is filled.
    """
    batch, answer, kept = ForwardSamples(*given), Solutions(*found), LastEquilibrium(*chain)
    code, k_h, k_p, behind = model
    count, m = batch.lengths.shape
    space, rest = new_forward_arrays(Memory(*memory), kept.rows, kept.factor)
    free, arcs, start, pose = new_motions(rest, batch.freedom.shape[0])
    copy_pose(batch.starts[0], start)
    for p in range(count):
        if math.isnan(batch.lengths[p, 0]):
            clear_solution(answer, p, codes.FORWARD_NO_LENGTHS, 0)
            continue
        if not chained:  # a result must not depend on the previous sample
            copy_pose(row_of(batch.starts, p), start)
            kept.last[0] = math.nan
            for i in range(m):
                kept.rows[g.PARAMETER, i] = math.nan
        problem = problem_at(Model(code, k_h, k_p, 0.0, behind), batch, p, free, arcs)
        exact = Model(
            codes.ELASTIC if code == codes.ELASTIC else codes.CATENARY, 0.0, 0.0, problem.model.gravity, behind
        )
        steps, size = _find_pose(problem, exact, batch.lengths[p], start, kept, space, pose)
        status = _fill_stability(problem, pose, arcs, size, space, answer.numbers[p])
        _fill_residuals(batch.freedom, space.gradient, answer.numbers[p])
        answer.numbers[p, ITERATIONS] = steps
        answer.pose_statuses[p] = status
        copy_pose(pose, answer.poses[p])
        _store_sample(problem, kept.rows, p, answer.results, answer.statuses)
        kept.last[0] = math.nan
        if status != codes.FORWARD_NOT_CONVERGED:
            copy_pose(pose, start)
            _store_chain(kept, pose, problem.wrench)

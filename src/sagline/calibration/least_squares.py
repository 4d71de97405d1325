"""Least squares of a calibration: Gauss-Newton method with exact cables.

The true lengths are eliminated at every pose. The objective is the sum of ((reading - prediction)/sigma)^2 over all
readings, of ((length - reported length)/sigma_L)^2 over all lengths, and of ((value - prior)/deviation)^2 over the
internal parameters. See docs/model.md, section 14.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.special import chdtri

from sagline.calibration.log import Sensors, count_of_frequencies, reading_deviations
from sagline.calibration.observations import BLOCK, NO_LOAD, MachineTerms, WhitenedRows, whitened_rows
from sagline.calibration.problem import Evaluated, Fit, FitProblem, Normal, SearchState
from sagline.calibration.straight import fit_poses, move_poses, straight_rows
from sagline.core.arrays import Array, Flags, Indices, Progress, blocks, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.calibration import kinds
from sagline.kinematics.forward_rows import solve_forward_rows

SIGNIFICANT: Final = 1e-13  # an eigenvalue counts as zero if it is smaller than this share of the largest eigenvalue
# largest number of multiplications in a matrix product; OpenBLAS wakes its threads for larger products, and these
# threads then take processor time until the next product
PRODUCT: Final = 1 << 18
STEPS: Final = 60
HALVINGS: Final = 5
TOLERANCE: Final = 1e-5  # smallest worthwhile decrease of the sum of squares: 3e-3 standard deviations, squared
ROUNDING: Final = 1e-12  # relative rounding error of the sum of squares
QUANTILE: Final = 0.99  # probability: a pose has less weight if its sum of squares exceeds this quantile of chi squared
NEARLY: Final = 1e-3  # as TOLERANCE, for a search that rounding errors or slack cables have stopped
SLOW_STEPS: Final = 10
SLOW: Final = 0.1  # a decrease of the sum of squares by a third of a standard deviation, squared
GROSS: Final = 0.1  # if a pose would have a smaller weight, the search begins with weights
LESS: Final = 0.9  # the misfit scale is updated if it falls below this share of its last value


def whitened_at(
    problem: FitProblem,
    state: SearchState,
    reported: Array,
    part: slice,
    direction: Array | None = None,
    *,
    free_of_noise: bool = False,
) -> WhitenedRows:
    """Whitened readings and their derivatives, for the poses in the slice `part`; reported: lengths (n, m) [m]."""
    # If `direction` (P,) is given, only the slopes along this direction are computed. With `free_of_noise`, the slopes
    # are computed at the true lengths: at the reported lengths, the common scale of all lengths would seem observable,
    # because the scale also multiplies the noise.
    machine = state.machine
    at = state.lengths[part] if free_of_noise else reported
    slopes = problem.winch_slopes(machine, at, part, counted=not free_of_noise)
    readings = problem.readings(reported, part)
    turning = problem.parameters.where[kinds.TURN : kinds.TURN + 3, 0]
    turn = left_jacobian(state.numbers[turning]) if turning[0] >= 0 else None
    if direction is not None and turn is not None:
        direction = direction.copy()
        direction[turning] = turn @ direction[turning]
    if problem.straight:
        rows = straight_rows(machine, readings, slopes, state.poses[part])
    else:
        rows = whitened_rows(machine, readings, slopes, state.poses[part], state.lengths[part], direction)
    if direction is None and turn is not None:
        rows.matrix[..., turning] = rows.matrix[..., turning] @ turn
    return rows


def _squares_of(sensors: Sensors, rows: WhitenedRows, reported: Array, lengths: Array) -> tuple[Array, Indices]:
    """Sum of squared residuals of each pose, in standard deviations, and number of readings of each pose."""
    m = reported.shape[1]
    deviation = reading_deviations(sensors, m, count_of_frequencies(sensors, m, m + rows.residual.shape[1]))
    misses = rows.residual / deviation[m:]
    there = ~np.isnan(rows.residual)
    squares = np.sum(np.where(there, misses, 0.0) ** 2, axis=1)
    squares += np.sum(((lengths - reported) / deviation[:m]) ** 2, axis=1)
    return squares, np.count_nonzero(there, axis=1) + rows.more


def _limits_of(readings: NDArray[np.integer], scale: float) -> Array:
    """Largest sum of squares (N,) for which a pose has full weight: `QUANTILE` of chi squared times `scale`."""
    return np.asarray(scale * exceeded_with(1.0 - QUANTILE, readings))


def _pose_weights(squares: Array, readings: NDArray[np.integer], scale: float) -> Array:
    """Weights of poses; less than 1 if the sum of squares exceeds `scale` times the 99 % quantile of chi squared."""
    if not np.isfinite(scale):
        return np.ones(len(squares))
    with np.errstate(divide="ignore", invalid="ignore"):
        weights: Array = np.minimum(1.0, _limits_of(readings, scale) / squares)
    return np.where(np.isfinite(squares), weights, 0.0)


def misfit(normal: Normal) -> float:
    """Sum of squares of a pose divided by its expected median, as a median over all poses; infinite without poses."""
    there = np.isfinite(normal.squares)
    if not there.any():
        return np.inf
    usual = exceeded_with(0.5, normal.readings[there])
    return float(np.median(normal.squares[there] / usual))


def _predict_state(
    problem: FitProblem,
    before: SearchState,
    known: WhitenedRows | None,
    step: Array,
    machine: MachineTerms,
    reported: Array,
    part: slice,
    share: float = 1.0,
) -> tuple[Array, Array]:
    """First-order prediction of true lengths [m] and pose rows after a `share` of a step (P,), for the poses `part`."""
    # known: stored whitened readings before the step, or None. machine, reported (n, m) [m]: values after the share of
    # the step. The change of the true lengths is the `share` of their change after a whole step.
    was = problem.reported_lengths(before.machine, part)
    off = before.lengths[part] - was
    if known is not None:
        best = np.einsum("nij,nj->ni", known.back, known.misfit - known.matrix @ step)
        return reported + off + share * (best - off), before.poses[part]
    rows = whitened_at(problem, before, was, part, share * step)
    best = np.einsum("nij,nj->ni", rows.back, rows.misfit - rows.matrix[..., 0] / share)
    more = share * (best - off)
    motion = rows.motion[:, -1] + np.einsum("ni,nik->nk", more, rows.motion[:, :-1])
    return reported + off + more, move_poses(before.machine.robot, machine.robot, before.poses[part], motion)


def evaluate_step(
    problem: FitProblem,
    before: SearchState,
    step: Array | None,
    kept: Flags,
    scale: float = np.inf,
    known: WhitenedRows | None = None,
    progress: Progress | None = None,
    share: float = 1.0,
) -> Evaluated:
    """One pass over the log: solve every pose after a share of a step, and sum the normal equations."""
    # Without a step of the parameters, the state itself is evaluated. Poses with a sum of squares above `scale` times
    # the expected value have less weight. Raises an error if the parameters are invalid for the robot.
    numbers = before.numbers if step is None else np.maximum(before.numbers + share * step, problem.least)
    machine = before.machine if step is None else problem.machine_at(numbers)
    count, width = len(before.poses), len(numbers)
    lengths = before.lengths if step is None else np.empty(before.lengths.shape)
    after = SearchState(numbers, machine, lengths, before.poses.copy())
    matrix, gradient = np.zeros((width, width)), np.zeros(width)
    squares, readings, weights = np.full(count, np.inf), np.zeros(count, dtype=np.int16), np.zeros(count)
    for part in blocks(count, BLOCK, progress):
        reported, starts = problem.reported_lengths(machine, part), before.poses[part]
        if step is not None and problem.straight:
            after.poses[part], after.lengths[part] = fit_poses(machine, problem.readings(reported, part), starts)
        elif step is not None:
            after.lengths[part], starts = _predict_state(problem, before, known, step, machine, reported, part, share)
        lengths = after.lengths[part]
        there = kept[part] & np.isfinite(lengths).all(axis=1) & (lengths > 0.0).all(axis=1)
        if not problem.straight:
            asked = locked(np.where(there[:, None], lengths, np.nan))
            solved = solve_forward_rows(machine.robot, problem.model, asked, locked(starts.copy()), NO_LOAD)
            there &= solved.stable
            after.poses[part][there] = solved.poses[there]
        rows = whitened_at(problem, after, reported, part)
        there &= ~np.isnan(rows.misfit).any(axis=1)
        found, number = _squares_of(machine.sensors, rows, reported, lengths)
        squares[part], readings[part] = np.where(there, found, np.inf), number
        weights[part] = np.where(there, _pose_weights(squares[part], number, scale), 0.0)
        factor, flat, misses = np.sqrt(weights[part]), rows.matrix, rows.misfit
        if not (factor == 1.0).all():
            flat, misses = flat[there] * factor[there, None, None], misses[there] * factor[there, None]
        flat, misses = flat.reshape(-1, width), misses.reshape(-1)
        size = max(PRODUCT // width**2, 1)
        for first in range(0, len(flat), size):
            some = flat[first : first + size]
            matrix += some.T @ some
            gradient += some.T @ misses[first : first + size]
    return after, Normal(matrix, gradient, squares, readings, weights, rows if count <= BLOCK else None)


def _cost_of(problem: FitProblem, current: Evaluated, kept: Flags, scale: float) -> float:
    """Value of the objective function; infinite if one of the used poses has no equilibrium."""
    state, normal = current
    squares = normal.squares[kept]
    if np.isfinite(scale):
        limit = _limits_of(normal.readings[kept], scale)
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = np.where(squares <= limit, squares, limit * (1.0 + np.log(squares / limit)))
    missed = problem.parameters.missed(state.numbers)
    return float(squares.sum() + missed @ missed)


def solve(
    problem: FitProblem,
    current: Evaluated,
    kept: Flags,
    *,
    robust: bool,
    steps: int = STEPS,
    tolerance: float = TOLERANCE,
    progress: Progress | None = None,
) -> Fit:
    """Gauss-Newton search that starts at the state `current`; each step is halved until the sum of squares falls."""
    # The search has converged if the predicted decrease is below the tolerance, or if slack cables, whose slopes jump,
    # have slowed it down: the decrease in `SLOW_STEPS` steps is below `SLOW`. With `robust`, a pose that fits worse
    # than the other poses has less weight. The weights depend on a scale of the misfit, which falls during the search.
    scale, promised, costs = np.inf, np.inf, list[float]()
    if robust:
        first = max(misfit(current[1]), 1.0)
        if _pose_weights(current[1].squares, current[1].readings, first)[kept].min() < GROSS:
            scale = first
            current = evaluate_step(problem, current[0], None, kept, scale, progress=progress)
    for iteration in range(steps):
        before = scale
        if robust and (now := max(misfit(current[1]), 1.0)) < LESS * scale:
            scale = now
        step, promised = best_step(problem, *current)
        if promised <= tolerance and scale == before:
            return Fit(*current, True, iteration)
        cost = _cost_of(problem, current, kept, scale)
        costs = [*costs, cost] if scale == before else [cost]
        if len(costs) > SLOW_STEPS and costs[-1 - SLOW_STEPS] - cost < SLOW:
            return Fit(*current, True, iteration)
        better = None
        for halving in range(HALVINGS):
            try:
                trial = evaluate_step(problem, current[0], step, kept, scale, current[1].rows, progress, 0.5**halving)
            except InvalidValueError:  # for example a negative radius
                continue
            if _cost_of(problem, trial, kept, scale) <= cost + ROUNDING * abs(cost):
                better = trial
                break
        if better is None and scale != before:  # the step was computed with weights for another scale
            current = evaluate_step(problem, current[0], None, kept, scale, progress=progress)
            continue
        if better is None:
            return Fit(*current, promised <= NEARLY, iteration)
        current = better
    return Fit(*current, promised <= NEARLY, steps)


def best_step(problem: FitProblem, state: SearchState, normal: Normal) -> tuple[Array, float]:
    """Gauss-Newton step (P,) of the internal parameters within their bounds, and predicted decrease of the squares."""
    # The step is zero along directions with neither observations nor a prior.
    scale = problem.scale
    root = problem.parameters.prior_root * scale
    downhill = scale * normal.gradient - root.T @ problem.parameters.missed(state.numbers)
    matrix = scale[:, None] * normal.matrix * scale + root.T @ root
    step = _lowest(matrix, downhill, positive=bool(np.isfinite(problem.parameters.internal_deviation).all()))
    lower = (problem.least - state.numbers) / scale
    if (step < lower).any():
        step = _lowest_within(matrix, downhill, lower)
    promised = float(2.0 * step @ downhill - step @ matrix @ step)
    return np.where(step <= lower, problem.least - state.numbers, scale * step), promised


def _lowest(matrix: Array, downhill: Array, *, positive: bool) -> Array:
    """Minimizer of x^T M x - 2 b^T x with the least norm; positive: True if `matrix` is positive definite."""
    if positive:
        try:
            return np.asarray(cho_solve(cho_factor(matrix), downhill))
        except LinAlgError:  # the readings are so informative that rounding hides the priors
            pass
    values, vectors = _significant_eigenpairs(matrix)
    return np.asarray(vectors @ ((vectors.T @ downhill) / values))


def _lowest_within(matrix: Array, downhill: Array, lower: Array) -> Array:
    """Minimizer (P,) of x^T M x - 2 b^T x under the condition x >= `lower`, where `lower` is zero or negative."""
    from scipy.optimize import lsq_linear  # imported here, because it is rarely needed and takes a quarter of a second

    values, vectors = _significant_eigenpairs(matrix)
    root = np.sqrt(values)
    found = lsq_linear(root[:, None] * vectors.T, vectors.T @ downhill / root, (lower, np.inf), method="bvls")
    return np.where(found.active_mask < 0, lower, found.x)  # exact value, without the solver's rounding


def _significant_eigenpairs(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues of `matrix` that exceed the rounding errors, and their eigenvectors as columns."""
    values, vectors = eigh(matrix)
    significant = values > SIGNIFICANT * values[-1]
    return values[significant], vectors[:, significant]


def exceeded_with(probability: Any, freedoms: Any) -> Array:
    """Value that chi squared exceeds with the (small) probability `probability`, for at least one degree of freedom."""
    return np.asarray(chdtri(np.maximum(freedoms, 1), probability))


_SMALL = 1e-4  # [rad]; for smaller angles, the first terms of the power series are sufficient


def left_jacobian(vector: Array) -> Array:
    """Matrix J with exp(v + dv) = exp(J dv) exp(v) for the rotation vector v = `vector` [rad], shape (3,)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < _SMALL:
        first, second = 0.5, 1.0 / 6.0
    else:
        first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)

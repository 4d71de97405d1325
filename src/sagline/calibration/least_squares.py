"""Least squares of a calibration: Gauss-Newton method with exact cables.

True lengths are eliminated at every pose. The objective has three sums. The sums over the poses are of ((reading -
prediction)/sigma)^2 and of ((length - reported length)/sigma_L)^2. The sum over the internal parameters is of ((value -
prior)/deviation)^2. See docs/model.md, section 14.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.spatial.transform import Rotation
from scipy.special import chdtri

from sagline.calibration.log import Sensors, reading_deviations
from sagline.calibration.observations import BLOCK, NO_LOAD, MachineTerms, WhitenedRows, whitened_rows, winch_slopes
from sagline.calibration.parameters import left_jacobian
from sagline.calibration.problem import Evaluated, Fit, FitProblem, Normal, SearchState
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress, blocks
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.terms import PoseReadings
from sagline.kinematics.forward_rows import solve_forward_rows
from sagline.robot.robot import Robot

SIGNIFICANT: Final = 1e-13  # eigenvalues that are smaller, relative to the largest, count as zero
STEPS: Final = 60
HALVINGS: Final = 12
TOLERANCE: Final = 1e-5  # relative decrease of the sum of squares; the result is within 3e-3 standard deviations
ROUNDING: Final = 1e-12  # relative rounding error of the sum of squares
QUANTILE: Final = 0.99  # quantile of chi squared: a pose with a larger sum of squares has less weight
NEARLY: Final = 1e-3  # sufficient relative decrease of the sum of squares if rounding hides further decrease
GROSS: Final = 0.1  # initial weight of a pose with a much too large sum of squares
LESS: Final = 0.9  # the weights are updated if the misfit scale falls below this share of its last value


def whitened_at(
    problem: FitProblem,
    state: SearchState,
    reported: Array,
    part: slice,
    direction: Array | None = None,
    *,
    free_of_noise: bool = False,
) -> WhitenedRows:
    """Whitened readings of some poses at a state, with their slopes; reported: lengths [m], (n, m).

    If `direction` (P,) is given, only the slopes along it are computed. With `free_of_noise`, the slopes are computed
    at the true lengths. At the reported lengths, the scale of all lengths would seem observable, because it also scales
    the noise.
    """
    log, machine = problem.log, state.machine
    if free_of_noise:
        slopes = winch_slopes(machine, state.lengths[part])
    else:
        slopes = winch_slopes(machine, reported, None if log.counts is None else log.counts[part])
    readings = PoseReadings(reported, log.cells[part], log.positions[part], log.rotations[part])
    turning = problem.parameters.where[kinds.TURN : kinds.TURN + 3, 0]
    turn = left_jacobian(state.numbers[turning]) if turning[0] >= 0 else None
    if direction is not None and turn is not None:
        direction = direction.copy()
        direction[turning] = turn @ direction[turning]
    rows = whitened_rows(machine, readings, slopes, state.poses[part], state.lengths[part], direction)
    if direction is None and turn is not None:
        rows.matrix[..., turning] = rows.matrix[..., turning] @ turn
    return rows


def _squares_of(sensors: Sensors, rows: WhitenedRows, reported: Array, lengths: Array) -> tuple[Array, Indices]:
    """Sum of squares of each pose in standard deviations, and its number of readings."""
    m = reported.shape[1]
    deviation = reading_deviations(sensors, m)
    misses = rows.residual / deviation[m:]
    there = ~np.isnan(rows.residual)
    squares = np.sum(np.where(there, misses, 0.0) ** 2, axis=1)
    squares += np.sum(((lengths - reported) / deviation[:m]) ** 2, axis=1)
    return squares, np.count_nonzero(there, axis=1)


def _limits_of(readings: Indices, scale: float) -> Array:
    """Largest sums of squares of poses with full weight, (N,): quantile of chi squared times a scale."""
    return np.asarray(scale * exceeded_with(1.0 - QUANTILE, readings))


def _pose_weights(squares: Array, readings: Indices, scale: float) -> Array:
    """Weights of poses: less than 1 if the sum of squares exceeds the 99 % quantile of chi squared times a scale."""
    if not np.isfinite(scale):
        return np.ones(len(squares))
    with np.errstate(divide="ignore", invalid="ignore"):
        weights: Array = np.minimum(1.0, _limits_of(readings, scale) / squares)
    return np.where(np.isfinite(squares), weights, 0.0)


def misfit(normal: Normal) -> float:
    """Median ratio of the sums of squares of the poses to their expected medians; infinite without poses."""
    there = np.isfinite(normal.squares)
    if not there.any():
        return np.inf
    usual = exceeded_with(0.5, normal.readings[there])
    return float(np.median(normal.squares[there] / usual))


def predict_state(
    problem: FitProblem,
    before: SearchState,
    known: WhitenedRows | None,
    step: Array,
    machine: MachineTerms,
    reported: Array,
    part: slice,
) -> tuple[Array, Array]:
    """First-order prediction of true lengths [m] and pose rows of some poses after a step of the parameters (P,).

    known: whitened readings before the step, if they were stored. machine, reported (n, m) [m]: values after the step.
    """
    if known is not None:
        off = np.einsum("nij,nj->ni", known.back, known.misfit - known.matrix @ step)
        return reported + off, before.poses[part]
    was = problem.reported_lengths(before.machine, part)
    rows = whitened_at(problem, before, was, part, step)
    off = np.einsum("nij,nj->ni", rows.back, rows.misfit - rows.matrix[..., 0])
    more = off - (before.lengths[part] - was)
    motion = rows.motion[:, -1] + np.einsum("ni,nik->nk", more, rows.motion[:, :-1])
    return reported + off, _move_poses(before.machine.robot, machine.robot, before.poses[part], motion)


def evaluate_step(
    problem: FitProblem,
    before: SearchState,
    step: Array | None,
    kept: Flags,
    scale: float = np.inf,
    known: WhitenedRows | None = None,
    progress: Progress | None = None,
) -> Evaluated:
    """One pass over the log: solve every pose after a step of the parameters, and sum the normal equations.

    Without a step, the state itself is evaluated. Poses with a sum of squares above `scale` times the expected value
    have less weight. Raises an error if the parameters are invalid for the robot.
    """
    numbers = before.numbers if step is None else np.maximum(before.numbers + step, problem.least)
    machine = before.machine if step is None else problem.machine_at(numbers)
    count, width = len(before.poses), len(numbers)
    lengths = before.lengths if step is None else np.empty(before.lengths.shape)
    after = SearchState(numbers, machine, lengths, before.poses.copy())
    matrix, gradient = np.zeros((width, width)), np.zeros(width)
    squares, readings, weights = np.full(count, np.inf), np.zeros(count, dtype=np.int64), np.zeros(count)
    for part in blocks(count, BLOCK, progress):
        reported, starts = problem.reported_lengths(machine, part), before.poses[part]
        if step is not None:
            after.lengths[part], starts = predict_state(problem, before, known, step, machine, reported, part)
        lengths = after.lengths[part]
        lost = ~(kept[part] & np.isfinite(lengths).all(axis=1) & (lengths > 0.0).all(axis=1))
        asked = locked(np.where(lost[:, None], np.nan, lengths))
        solved = solve_forward_rows(machine.robot, problem.model, asked, locked(starts.copy()), NO_LOAD)
        there = solved.stable & ~lost
        after.poses[part][there] = solved.poses[there]
        rows = whitened_at(problem, after, reported, part)
        there &= ~np.isnan(rows.misfit).any(axis=1)
        found, number = _squares_of(machine.sensors, rows, reported, lengths)
        squares[part], readings[part] = np.where(there, found, np.inf), number
        weights[part] = np.where(there, _pose_weights(squares[part], number, scale), 0.0)
        share, flat, misses = np.sqrt(weights[part]), rows.matrix, rows.misfit
        if not (share == 1.0).all():
            flat, misses = flat[there] * share[there, None, None], misses[there] * share[there, None]
        flat = flat.reshape(-1, width)
        matrix += flat.T @ flat
        gradient += flat.T @ misses.reshape(-1)
    return after, Normal(matrix, gradient, squares, readings, weights, rows if count <= BLOCK else None)


def _cost_of(problem: FitProblem, current: Evaluated, kept: Flags, scale: float) -> float:
    """Value of the objective function; infinite if one of the used poses has no equilibrium."""
    state, normal = current
    squares = normal.squares[kept]
    if np.isfinite(scale):
        limit = _limits_of(normal.readings[kept], scale)
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = np.where(squares <= limit, squares, limit * (1.0 + np.log(squares / limit)))
    missed = problem.missed(state.numbers)
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
    """Gauss-Newton steps from a state; each step is halved until the sum of squares falls.

    The search has converged if the predicted decrease is below the tolerance. With `robust`, poses that fit worse than
    the others have less weight; the scale of the misfit is updated after each step.
    """
    scale = np.inf
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
        better = None
        for halving in range(HALVINGS):
            try:
                trial = evaluate_step(problem, current[0], step * 0.5**halving, kept, scale, current[1].rows, progress)
            except InvalidValueError:  # for example a negative radius
                continue
            if _cost_of(problem, trial, kept, scale) <= cost + ROUNDING * abs(cost):
                better = trial
                break
        if better is None:
            return Fit(*current, promised <= NEARLY, iteration)
        current = better
    return Fit(*current, False, steps)


def best_step(problem: FitProblem, state: SearchState, normal: Normal) -> tuple[Array, float]:
    """Gauss-Newton step of the internal parameters (P,) within their lower bounds, and the predicted decrease.

    The step is zero along directions with neither observations nor a prior.
    """
    scale = problem.scale
    root = problem.prior_root * scale
    downhill = scale * normal.gradient - root.T @ problem.missed(state.numbers)
    matrix = scale[:, None] * normal.matrix * scale + root.T @ root
    step = _lowest(matrix, downhill, positive=bool(np.isfinite(problem.prior_deviation).all()))
    lower = (problem.least - state.numbers) / scale
    if (step < lower).any():
        step = _lowest_within(matrix, downhill, lower)
    promised = float(2.0 * step @ downhill - step @ matrix @ step)
    return np.where(step <= lower, problem.least - state.numbers, scale * step), promised


def _lowest(matrix: Array, downhill: Array, *, positive: bool) -> Array:
    """Least-norm minimizer of x^T M x - 2 b^T x."""
    if positive:
        try:
            return np.asarray(cho_solve(cho_factor(matrix), downhill))
        except LinAlgError:  # the readings are so informative that rounding hides the priors
            pass
    values, vectors = _significant_eigenpairs(matrix)
    return np.asarray(vectors @ ((vectors.T @ downhill) / values))


def _lowest_within(matrix: Array, downhill: Array, lower: Array) -> Array:
    """Minimizer of x^T M x - 2 b^T x with x >= lower (P,); lower is zero or negative."""
    from scipy.optimize import lsq_linear  # imported here, because it is rarely needed and takes a quarter of a second

    values, vectors = _significant_eigenpairs(matrix)
    root = np.sqrt(values)
    found = lsq_linear(root[:, None] * vectors.T, vectors.T @ downhill / root, (lower, np.inf), method="bvls")
    return np.where(found.active_mask < 0, lower, found.x)  # exactly at the bound


def _significant_eigenpairs(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues above rounding, with their eigenvectors as columns."""
    values, vectors = eigh(matrix)
    significant = values > SIGNIFICANT * values[-1]
    return values[significant], vectors[:, significant]


def exceeded_with(probability: Any, freedoms: Any) -> Array:
    """Value that chi squared exceeds with a (small) probability, for at least one degree of freedom."""
    return np.asarray(chdtri(np.maximum(freedoms, 1), probability))


def _move_poses(before: Robot, after: Robot, poses: Array, motion: Array) -> Array:
    """Pose rows after small motions of the center of mass (N, 6) [m, rad]; the robots may have different centers."""
    turned = Rotation.from_quat(poses[:, 3:])
    turning = Rotation.from_rotvec(motion[:, 3:]) * turned
    first, last = (np.array(robot.center_of_mass) for robot in (before, after))  # scipy needs writable arrays
    shift = motion[:, :3] + turned.apply(first) - turning.apply(last)
    free = before.freedom[:, :3]
    return np.hstack((poses[:, :3] + shift @ free.T @ free, turning.as_quat()))

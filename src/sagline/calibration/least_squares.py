"""The least squares of a calibration: Gauss-Newton on exact cables, the true lengths eliminated pose by pose.

What is made small is the sum over the poses of ((reading - prediction)/sigma)^2 and ((length - what the winches say of
it)/sigma_L)^2, and over the numbers of ((value - prior)/its deviation)^2; docs/model.md, section 14.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.spatial.transform import Rotation
from scipy.special import chdtr, chdtrc, chdtri

from sagline.calibration.log import Sensors, reading_deviations
from sagline.calibration.observations import BLOCK, NO_LOAD, Machine, Observed, counts_of, whitened_rows, winch_slopes
from sagline.calibration.parameters import left_jacobian
from sagline.calibration.problem import Evaluated, Fit, Normal, Problem, State, machine_at, reported_lengths
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress, blocks
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.terms import Readings
from sagline.kinematics.forward_rows import solve_rows
from sagline.robot.robot import Robot

STEPS: Final = 60
HALVINGS: Final = 12
TOLERANCE: Final = (
    1e-5  # of the sum of squares: a step that promises less is within 3e-3 standard deviations of the best
)
ROUNDING: Final = 1e-12  # of the sum of squares
QUANTILE: Final = 0.99  # of chi squared of a pose: beyond it a pose counts less
NEARLY: Final = 1e-3  # of the sum of squares: as near is near enough where rounding hides the rest
GROSS: Final = 0.1  # weight of a pose that would spoil the first step
LESS: Final = 0.9  # of the scale of misfits, where it is worth another look


def whitened_at(
    problem: Problem,
    state: State,
    said: Array,
    part: slice,
    direction: Array | None = None,
    *,
    free_of_noise: bool = False,
) -> Observed:
    """What the readings of some poses say at a state.

    Args:
        problem: The problem.
        state: The state.
        said: The lengths that the winches say there [m], (n, m).
        part: Which poses.
        direction: Of a step of the numbers (P,), if slopes along it alone are wanted.
        free_of_noise: Whether slopes are those where the winches say the true lengths: what scales all lengths alike
            would else seem to be told, by the noise that it scales too.
    """
    log, parameters, machine = problem.log, problem.parameters, state.machine
    counts, along = (None if log.counts is None else log.counts[part]), said
    if free_of_noise and machine.drums is not None:
        along = state.lengths[part]
        counts = counts_of(machine.drums, along)
    paid = winch_slopes(machine.robot, parameters, counts, along)
    readings = Readings(said, log.cells[part], log.positions[part], log.rotations[part])
    turning = parameters.where[kinds.TURN : kinds.TURN + 3, 0]
    turn = left_jacobian(state.numbers[turning]) if turning[0] >= 0 else None
    if direction is not None and turn is not None:
        direction = direction.copy()
        direction[turning] = turn @ direction[turning]
    rows = whitened_rows(machine, parameters, readings, paid, state.poses[part], state.lengths[part], direction)
    if direction is None and turn is not None:
        rows.matrix[..., turning] = rows.matrix[..., turning] @ turn
    return rows


def squares_of(sensors: Sensors, rows: Observed, said: Array, lengths: Array) -> tuple[Array, Indices]:
    """Sum of squares of each pose in standard deviations, and how many readings it has."""
    m = said.shape[1]
    deviation = reading_deviations(sensors, m)
    misses = rows.residual / deviation[m:]
    there = ~np.isnan(rows.residual)
    squares = np.sum(np.where(there, misses, 0.0) ** 2, axis=1)
    squares += np.sum(((lengths - said) / deviation[:m]) ** 2, axis=1)
    return squares, np.count_nonzero(there, axis=1)


def limits_of(readings: Indices, scale: float) -> Array:
    """Sums of squares beyond which poses count less, (N,); scale: how much larger than chance has it they may be."""
    limits: Array = scale * exceeded_with(1.0 - QUANTILE, readings)
    return limits


def pose_weights(squares: Array, readings: Indices, scale: float) -> Array:
    """With which weights poses count: less where they fit worse than all but a hundredth of their like."""
    if not np.isfinite(scale):
        return np.ones(len(squares))
    with np.errstate(divide="ignore", invalid="ignore"):
        weights: Array = np.minimum(1.0, limits_of(readings, scale) / squares)
    return np.where(np.isfinite(squares), weights, 0.0)


def misfit(normal: Normal) -> float:
    """How many times larger than chance has it the sum of squares of the middle pose is; infinite without poses."""
    there = np.isfinite(normal.squares)
    if not there.any():
        return np.inf
    usual = exceeded_with(0.5, normal.readings[there])
    return float(np.median(normal.squares[there] / usual))


def moved(
    problem: Problem, before: State, known: Observed | None, step: Array, machine: Machine, said: Array, part: slice
) -> tuple[Array, Array]:
    """True lengths [m] of some poses after a step of the numbers, to first order, and pose rows near those there.

    Args:
        problem: The problem.
        before: The state to step from.
        known: What all readings say there, where it was kept.
        step: Of the numbers, internal (P,).
        machine: With the numbers after it.
        said: What the winches say after it [m], (n, m).
        part: Which poses.
    """
    if known is not None:
        off = np.einsum("nij,nj->ni", known.back, known.misfit - known.matrix @ step)
        return said + off, before.poses[part]
    was = reported_lengths(problem, before.machine, part)
    rows = whitened_at(problem, before, was, part, step)
    off = np.einsum("nij,nj->ni", rows.back, rows.misfit - rows.matrix[..., 0])
    more = off - (before.lengths[part] - was)
    motion = rows.motion[:, -1] + np.einsum("ni,nik->nk", more, rows.motion[:, :-1])
    return said + off, carried(before.machine.robot, machine.robot, before.poses[part], motion)


def evaluate_step(
    problem: Problem,
    before: State,
    step: Array | None,
    kept: Flags,
    scale: float = np.inf,
    known: Observed | None = None,
    progress: Progress | None = None,
) -> Evaluated:
    """One pass over the log: every pose solved after a step of the numbers, and what they all say there.

    Args:
        problem: The problem.
        before: The state to step from.
        step: Of the numbers, internal (P,); None for the state itself.
        kept: Which poses count, (N,).
        scale: Times what chance has it, beyond which a pose counts less; infinite where all count alike.
        known: What all readings say at the state, where it was kept.
        progress: Told how many poses are done, of how many.

    Raises:
        InvalidValueError: If the robot cannot have these numbers.
    """
    numbers = before.numbers if step is None else np.maximum(before.numbers + step, problem.least)
    machine = before.machine if step is None else machine_at(problem, numbers)
    count, width = len(before.poses), len(numbers)
    room = before.lengths if step is None else np.empty(before.lengths.shape)
    after = State(numbers, machine, room, before.poses.copy())
    matrix, gradient = np.zeros((width, width)), np.zeros(width)
    squares, readings, weights = np.full(count, np.inf), np.zeros(count, dtype=np.int64), np.zeros(count)
    for part in blocks(count, BLOCK, progress):
        said, starts = reported_lengths(problem, machine, part), before.poses[part]
        if step is not None:
            after.lengths[part], starts = moved(problem, before, known, step, machine, said, part)
        lengths = after.lengths[part]
        lost = ~(kept[part] & np.isfinite(lengths).all(axis=1) & (lengths > 0.0).all(axis=1))
        asked = locked(np.where(lost[:, None], np.nan, lengths))
        solved = solve_rows(machine.robot, problem.model, asked, locked(starts.copy()), NO_LOAD)
        there = solved.stable & ~lost
        after.poses[part][there] = solved.poses[there]
        rows = whitened_at(problem, after, said, part)
        there &= ~np.isnan(rows.misfit).any(axis=1)
        found, number = squares_of(machine.sensors, rows, said, lengths)
        squares[part], readings[part] = np.where(there, found, np.inf), number
        weights[part] = np.where(there, pose_weights(squares[part], number, scale), 0.0)
        share, flat, misses = np.sqrt(weights[part]), rows.matrix, rows.misfit
        if not (share == 1.0).all():
            flat, misses = flat[there] * share[there, None, None], misses[there] * share[there, None]
        flat = flat.reshape(-1, width)
        matrix += flat.T @ flat
        gradient += flat.T @ misses.reshape(-1)
    return after, Normal(matrix, gradient, squares, readings, weights, rows if count <= BLOCK else None)


def cost_of(problem: Problem, begun: Evaluated, kept: Flags, scale: float) -> float:
    """What is made small; infinite where a pose that counts finds no equilibrium."""
    state, normal = begun
    squares = normal.squares[kept]
    if np.isfinite(scale):
        limit = limits_of(normal.readings[kept], scale)
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = np.where(squares <= limit, squares, limit * (1.0 + np.log(squares / limit)))
    missed = problem.missed(state.numbers)
    return float(squares.sum() + missed @ missed)


def solve(
    problem: Problem,
    begun: Evaluated,
    kept: Flags,
    *,
    robust: bool,
    steps: int = STEPS,
    settled: float = TOLERANCE,
    progress: Progress | None = None,
) -> Fit:
    """Gauss-Newton from a state, steps halved until the sum of squares falls.

    Poses count less that fit worse than the others do: how badly those fit is seen anew after each step.

    Args:
        problem: The problem.
        begun: Where to begin, with what the poses say there.
        kept: Which poses count, (N,).
        robust: Whether poses count less that do not fit.
        steps: How many are taken at most.
        settled: Of the sum of squares, where a step promises no more.
        progress: Told of every pass.

    Returns:
        How it ended.
    """
    scale = np.inf
    if robust and pose_weights(begun[1].squares, begun[1].readings, max(misfit(begun[1]), 1.0))[kept].min() < GROSS:
        scale = max(misfit(begun[1]), 1.0)
        begun = evaluate_step(problem, begun[0], None, kept, scale, progress=progress)
    for iteration in range(steps):
        before = scale
        if robust and (now := max(misfit(begun[1]), 1.0)) < LESS * scale:
            scale = now
        step, promised = best_step(problem, *begun)
        if promised <= settled and scale == before:
            return Fit(*begun, True, iteration)
        cost = cost_of(problem, begun, kept, scale)
        better = None
        for halving in range(HALVINGS):
            try:
                trial = evaluate_step(problem, begun[0], step * 0.5**halving, kept, scale, begun[1].rows, progress)
            except InvalidValueError:  # a negative radius, say
                continue
            if cost_of(problem, trial, kept, scale) <= cost + ROUNDING * abs(cost):
                better = trial
                break
        if better is None:
            return Fit(*begun, promised <= NEARLY, iteration)
        begun = better
    return Fit(*begun, False, steps)


OPEN: Final = 1e-13  # of the largest: smaller eigenvalues are rounding


def best_step(problem: Problem, state: State, normal: Normal) -> tuple[Array, float]:
    """The Gauss-Newton step, internal (P,), and what it promises of the sum of squares.

    Along directions that neither data nor priors tell there is no step, and none leads below the least that a number
    may be: where it would, the others go where they fit best beside that.
    """
    scale, deviation = problem.scale, problem.prior_deviation
    known = np.where(np.isfinite(deviation), scale / deviation, 0.0) ** 2
    missed = (state.numbers - problem.prior) / scale
    downhill = scale * normal.gradient - known * missed
    matrix = scale[:, None] * normal.matrix * scale + np.diag(known)
    step = _lowest(matrix, downhill, positive=bool(known.all()))
    room = (problem.least - state.numbers) / scale
    if (step < room).any():
        step = _lowest_within(matrix, downhill, room)
    promised = float(2.0 * step @ downhill - step @ matrix @ step)
    return np.where(step <= room, problem.least - state.numbers, scale * step), promised


def _lowest(matrix: Array, downhill: Array, *, positive: bool) -> Array:
    """Where x^T M x - 2 b^T x is least; zero along what is not told."""
    if positive:
        try:
            return np.asarray(cho_solve(cho_factor(matrix), downhill))
        except LinAlgError:  # what priors tell is rounding beside the readings
            pass
    values, vectors = _significant_eigenpairs(matrix)
    return np.asarray(vectors @ ((vectors.T @ downhill) / values))


def _lowest_within(matrix: Array, downhill: Array, room: Array) -> Array:
    """The same of all x >= room (P,), which are zero or less."""
    from scipy.optimize import lsq_linear  # of use to few, and a quarter of a second to load

    values, vectors = _significant_eigenpairs(matrix)
    root = np.sqrt(values)
    found = lsq_linear(root[:, None] * vectors.T, vectors.T @ downhill / root, (room, np.inf), method="bvls")
    return np.where(found.active_mask < 0, room, found.x)  # there, not near there


def _significant_eigenpairs(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues that are more than rounding, and their vectors: columns."""
    values, vectors = eigh(matrix)
    told = values > OPEN * values[-1]
    return values[told], vectors[:, told]


def below(squares: Any, freedoms: Any) -> Array:
    """Probability that chance has no more."""
    return np.asarray(chdtr(freedoms, squares))


def above(squares: Any, freedoms: Any) -> Array:
    """Probability that chance has more."""
    return np.asarray(chdtrc(freedoms, squares))


def exceeded_with(probability: Any, freedoms: Any) -> Array:
    """What chance exceeds with a probability, small ones kept to the last digit; of no freedoms, as of one."""
    return np.asarray(chdtri(np.maximum(freedoms, 1), probability))


def carried(before: Robot, after: Robot, poses: Array, motion: Array) -> Array:
    """Pose rows after a motion about the center of mass, which may be elsewhere in the platform then.

    Args:
        before: The robot.
        after: The same with another center of mass.
        poses: Pose rows (N, POSE_COLUMNS).
        motion: Of the center of mass and about it, world axes [m, rad], (N, 6).

    Returns:
        Pose rows; they have moved along the motions alone that the robot is free to make.
    """
    turned = Rotation.from_quat(poses[:, 3:])
    turning = Rotation.from_rotvec(motion[:, 3:]) * turned
    first, last = (np.array(robot.center_of_mass) for robot in (before, after))  # scipy takes no locked array
    shift = motion[:, :3] + turned.apply(first) - turning.apply(last)
    free = before.freedom[:, :3]
    return np.hstack((poses[:, :3] + shift @ free.T @ free, turning.as_quat()))

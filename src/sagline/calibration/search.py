"""Search for the least-squares solution of a calibration, and cross-validation."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.calibration.findings import CrossValidation, Omission
from sagline.calibration.least_squares import evaluate_step, exceeded_with, solve
from sagline.calibration.log import load_cells_of
from sagline.calibration.observations import BLOCK, NO_LOAD, MachineTerms
from sagline.calibration.outliers import EXAMINED, outliers_in
from sagline.calibration.problem import Evaluated, Fit, FitProblem, SearchState, held_lengths, start_of
from sagline.core.arrays import Array, Flags, Indices, Progress, blocks, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.calibration import kinds
from sagline.kinematics.forward import search
from sagline.kinematics.forward_rows import solve_forward_rows
from sagline.robot.pose import Pose

STRANGE: Final = 1e-9  # smallest probability of a misfit that may be due to noise
FEW: Final = 0.1  # if a larger share of the poses does not fit, single cables are not the cause
# first steps with equal weights: few poses with frequencies show errors of EA, and would count as outliers
FIRST_STEPS: Final = 10
FAR: Final = 0.03  # [m], a pose farther from the forward kinematics of the reported lengths is another equilibrium


def search_from_priors(
    problem: FitProblem,
    commanded: Pose | None,
    other: SearchState | None = None,
    *,
    robust: bool,
    progress: Progress | None = None,
) -> tuple[Fit, Flags, dict[Omission, Indices]]:
    """Search from the priors. A pose that converges to another equilibrium is restarted once, then omitted."""
    # If the initial state `other` has smaller squares, the search starts there. Returns the last fit, the flags of the
    # used poses (N,), and the indices of the omitted poses by reason.
    state = start_of(problem, commanded)
    kept = np.ones(len(state.poses), dtype=np.bool_)
    current = evaluate_step(problem, state, None, kept)
    if other is not None:
        current = min(
            current, evaluate_step(problem, other, None, kept), key=lambda one: _initial_squares(problem, one)
        )
    left_out: dict[Omission, Indices] = {}
    if (lost := _without_equilibrium(current)).any() and not problem.straight:
        current = evaluate_step(problem, _restart(problem, current[0], lost), None, kept)
    if (lost := _without_equilibrium(current)).any():
        left_out[Omission.NO_EQUILIBRIUM] = locked(np.flatnonzero(lost))
        kept &= ~lost
    if not kept.any():
        step = "Correct the lengths, or the robot: its anchors, and the zeros of its lengths."
        raise InvalidValueError("log", "without a pose at which this robot is in equilibrium", "at least one", step)
    if robust and problem.log.frequencies is not None:
        begun = solve(problem, current, kept, robust=False, steps=FIRST_STEPS, progress=progress)
        current = begun.state, begun.normal
    fit = solve(problem, current, kept, robust=robust, progress=progress)
    if problem.straight:  # there is no other equilibrium
        return fit, kept, left_out
    if (improbable := _improbable(fit, kept)).any():
        current = evaluate_step(problem, _restart(problem, fit.state, improbable), None, kept)
        if (current[1].squares[improbable] < fit.normal.squares[improbable]).any():
            fit = solve(problem, current, kept, robust=robust, progress=progress)
            improbable = _improbable(fit, kept)
        elsewhere = _other_equilibrium(problem, fit.state, improbable)
        if robust:
            elsewhere &= ~_single_cable_outliers(problem, fit.state, elsewhere & np.isfinite(fit.normal.squares))
        if elsewhere.any():
            left_out[Omission.OTHER_EQUILIBRIUM] = locked(np.flatnonzero(elsewhere))
            kept &= ~elsewhere
            if not kept.any():
                step = "Check that the log is of this robot, check lengths and load cells, or give better anchors."
                raise InvalidValueError("log", "without a pose that explains the readings", "at least one", step)
            current = evaluate_step(problem, fit.state, None, kept)
            fit = solve(problem, current, kept, robust=robust, progress=progress)
    return fit, kept, left_out


def _initial_squares(problem: FitProblem, current: Evaluated) -> tuple[int, float]:
    """Number of poses without an equilibrium, and sum of squares of the other poses and of the priors."""
    state, normal = current
    there, missed = np.isfinite(normal.squares), problem.parameters.missed(state.numbers)
    return int(np.count_nonzero(~there)), float(normal.squares[there].sum() + missed @ missed)


def _without_equilibrium(current: Evaluated) -> Flags:
    """True for each pose without an equilibrium, (N,)."""
    return np.asarray(~np.isfinite(current[1].squares))


def _improbable(fit: Fit, kept: Flags) -> Flags:
    """True for each pose with a misfit that noise does not explain, (N,)."""
    limit = exceeded_with(STRANGE, fit.normal.readings)
    return np.asarray(kept & (fit.normal.squares > limit))


def _restart(problem: FitProblem, state: SearchState, which: Flags) -> SearchState:
    """State in which the poses `which` are replaced by the forward kinematics of the reported lengths."""
    machine = state.machine
    reported = problem.reported_lengths(machine)
    found = search(machine.robot, problem.model, locked(reported[which].copy()), NO_LOAD, None)
    poses, lengths = state.poses.copy(), state.lengths.copy()
    poses[which] = np.where(found.stable[:, None], found.poses, poses[which])
    lengths[which] = held_lengths(problem, machine, poses, reported)[which]
    return state._replace(poses=poses, lengths=lengths)


def _single_cable_outliers(problem: FitProblem, state: SearchState, which: Flags) -> Flags:
    """True for each pose of `which` that an error of single cables explains; all False if `which` has many poses."""
    rows, slipped = np.flatnonzero(which), np.zeros(len(which), dtype=np.bool_)
    if 0 < len(rows) <= min(EXAMINED, FEW * len(which)):
        found = outliers_in(problem, state, rows, rows, count=len(which))
        slipped[[one.row for one in found if one.cable is not None]] = True
    return slipped


def _other_equilibrium(problem: FitProblem, state: SearchState, which: Flags) -> Flags:
    """True for each pose of `which` that is far from the forward kinematics of the reported lengths, (N,)."""
    reported = problem.reported_lengths(state.machine)[which]
    found = search(state.machine.robot, problem.model, locked(reported), NO_LOAD, None)
    far = which.copy()
    far[which] = np.linalg.norm(found.poses[:, :3] - state.poses[which, :3], axis=1) > FAR
    return far


def cross_validate(
    problem: FitProblem, found: Fit, kept: Flags, folds: int, *, robust: bool, progress: Progress | None = None
) -> CrossValidation | None:
    """Cross-validation: calibrate without a part of the poses and predict the readings of this part, for each part."""
    # A part consists of consecutive poses, so that all sets of tensions at one pose are in one part. Returns None if
    # there are fewer than two poses.
    places = np.flatnonzero(kept)
    folds = min(folds, len(places))
    if folds < 2:
        return None
    now, before = np.zeros((2, 4))
    nominal = problem.machine_at(problem.prior)
    for part in np.array_split(places, folds):
        left = np.zeros(len(kept), dtype=np.bool_)
        left[part] = True
        rest = kept & ~left
        current = evaluate_step(problem, found.state, None, rest, progress=progress)
        fit = solve(problem, current, rest, robust=robust, progress=progress)
        whole = slice(int(part[0]), int(part[-1]) + 1)
        now += _prediction_errors(problem, fit.state.machine, found.state.poses, left, whole)
        before += _prediction_errors(problem, nominal, found.state.poses, left, whole)
    tension, position = _root_mean_squares(now)
    tension_before, position_before = _root_mean_squares(before)
    if (problem.parameters.where[kinds.SHIFT : kinds.TARGET + 3, 0] >= 0).any():
        position_before = np.nan  # before the calibration, the pose of the measuring system was unknown
    return CrossValidation(folds, tension, position, tension_before, position_before)


def _root_mean_squares(sums: Array) -> tuple[float, float]:
    """Root mean square errors of load cells [N] and positions [m], from the result of `_prediction_errors`."""
    cells, cell_count, positions, position_count = sums.tolist()
    tension = float(np.sqrt(cells / cell_count)) if cell_count else np.nan
    return tension, float(np.sqrt(positions / position_count)) if position_count else np.nan


def _prediction_errors(problem: FitProblem, machine: MachineTerms, starts: Array, which: Flags, whole: slice) -> Array:
    """Sum and number of squared prediction errors, first for load cells, then for positions, (4,)."""
    sums = np.zeros(4)
    for own in blocks(whole.stop - whole.start, BLOCK):
        part = slice(whole.start + own.start, whole.start + own.stop)
        try:
            reported = problem.reported_lengths(machine, part)
        except InvalidValueError:  # the drum data have such large errors that lengths are invalid
            continue
        there = which[part] & np.isfinite(reported).all(axis=1) & (reported > 0.0).all(axis=1)
        asked = locked(np.where(there[:, None], reported, np.nan))
        solved = solve_forward_rows(machine.robot, problem.model, asked, locked(starts[part].copy()), NO_LOAD)
        there &= solved.stable | ((solved.pose_status == codes.FORWARD_FITTED) & problem.straight)
        tension = solved.solution(
            machine.robot, problem.model, np.zeros(6), (len(reported),)
        ).state.cables.frame_end_tension
        sensors, (gain, bias) = machine.sensors, load_cells_of(machine.robot)
        cells = (problem.log.cells[part] - (gain * tension + bias))[there]
        cells = cells[~np.isnan(cells)]
        turned = Rotation.from_quat(solved.poses[there, 3:]).apply(sensors.target.copy())
        point = solved.poses[there, :3] + turned - sensors.frame.position
        apart = np.linalg.norm(problem.log.positions[part][there] - point @ sensors.frame.matrix, axis=1)
        apart = apart[~np.isnan(apart)]
        sums += [float(cells @ cells), cells.size, float(apart @ apart), apart.size]
    return sums

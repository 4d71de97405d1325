"""The search of a calibration: poses that end in another equilibrium get a second chance, or are left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from sagline.calibration.chi_squared import exceeded_with
from sagline.calibration.least_squares import passed, solve
from sagline.calibration.observing import NO_LOAD
from sagline.calibration.outliers import EXAMINED, outliers_in
from sagline.calibration.problem import Begun, Fit, Problem, State, said_lengths
from sagline.calibration.start import held_lengths, start_of
from sagline.calibration.status import Omission
from sagline.core.arrays import Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress
from sagline.kinematics.start import search
from sagline.robot.pose import Pose

STRANGE: Final = 1e-9  # probability of a sum of squares that no noise reaches
FEW: Final = 0.1  # of the poses: where more are elsewhere, it is not that a cable slipped
FAR: Final = 0.03  # m from where the lengths that were read put it: another equilibrium


class Found(NamedTuple):
    """How the search for all numbers ended.

    Attributes:
        fit: The last of them.
        kept: Which poses count, (N,).
        left_out: Why, and which do not.
    """

    fit: Fit
    kept: Flags
    left_out: Mapping[Omission, Indices]


def found_from(problem: Problem, commanded: Pose | None, *, robust: bool, progress: Progress | None = None) -> Found:
    """Search from the priors; poses that end elsewhere get a second chance, and are left out if they do not take it.

    Args:
        problem: The problem.
        commanded: Poses that were commanded, one a row, or None.
        robust: Whether poses count less that do not fit.
        progress: Told of every pass.

    Raises:
        InvalidValueError: If the robot rests nowhere at the lengths of the log, or at none of its poses as it was read,
            or needs data that it lacks.
    """
    state = start_of(problem, commanded)
    kept = np.ones(len(state.poses), dtype=np.bool_)
    begun = passed(problem, state, None, kept)
    left_out: dict[Omission, Indices] = {}
    if (lost := _lost(begun)).any():
        begun = passed(problem, _again(problem, state, lost), None, kept)
    if (lost := _lost(begun)).any():
        left_out[Omission.NO_EQUILIBRIUM] = locked(np.flatnonzero(lost))
        kept &= ~lost
    if not kept.any():
        step = "Correct the lengths, or the robot: its anchors, and the zeros of its lengths."
        raise InvalidValueError("log", "without a pose at which this robot rests", "one at least", step)
    fit = solve(problem, begun, kept, robust=robust, progress=progress)
    if (strange := _strange(fit, kept)).any():
        begun = passed(problem, _again(problem, fit.state, strange), None, kept)
        if (begun[1].squares[strange] < fit.normal.squares[strange]).any():
            fit = solve(problem, begun, kept, robust=robust, progress=progress)
            strange = _strange(fit, kept)
        elsewhere = _elsewhere(problem, fit.state, strange)
        if robust:
            elsewhere &= ~_slipped(problem, fit.state, elsewhere)
        if elsewhere.any():
            left_out[Omission.OTHER_EQUILIBRIUM] = locked(np.flatnonzero(elsewhere))
            kept &= ~elsewhere
            if not kept.any():
                step = "Check that it is this robot's log, its lengths and load cells, or begin with better anchors."
                raise InvalidValueError("log", "without a pose at which this robot reads so", "one at least", step)
            begun = passed(problem, fit.state, None, kept)
            fit = solve(problem, begun, kept, robust=robust, progress=progress)
    return Found(fit, kept, left_out)


def _lost(begun: Begun) -> Flags:
    """Which poses find no equilibrium, (N,)."""
    lost: Flags = ~np.isfinite(begun[1].squares)
    return lost


def _strange(fit: Fit, kept: Flags) -> Flags:
    """Which poses fit so badly that no noise does it, (N,)."""
    limit = exceeded_with(STRANGE, fit.normal.readings)
    strange: Flags = kept & (fit.normal.squares > limit)
    return strange


def _again(problem: Problem, state: State, which: Flags) -> State:
    """A state in which some poses begin anew, where the lengths that the winches say put the platform."""
    machine = state.machine
    said = said_lengths(problem, machine, slice(None))
    found = search(machine.robot, problem.model, locked(said[which].copy()), NO_LOAD, None)
    poses, lengths = state.poses.copy(), state.lengths.copy()
    poses[which] = np.where(found.stable[:, None], found.poses, poses[which])
    lengths[which] = held_lengths(problem, machine, poses, said)[which]
    return state._replace(poses=poses, lengths=lengths)


def _slipped(problem: Problem, state: State, which: Flags) -> Flags:
    """Which of some poses, if they are few, are as they were read but for single cables: outliers that count little."""
    rows, slipped = np.flatnonzero(which), np.zeros(len(which), dtype=np.bool_)
    if 0 < len(rows) <= min(EXAMINED, FEW * len(which)):
        found = outliers_in(problem, state, rows, rows, count=len(which))
        slipped[[one.row for one in found if one.cable is not None]] = True
    return slipped


def _elsewhere(problem: Problem, state: State, which: Flags) -> Flags:
    """Which of some poses are far from where the lengths that the winches say put the platform, (N,)."""
    said = said_lengths(problem, state.machine, slice(None))[which]
    found = search(state.machine.robot, problem.model, locked(said), NO_LOAD, None)
    far = which.copy()
    far[which] = np.linalg.norm(found.poses[:, :3] - state.poses[which, :3], axis=1) > FAR
    return far

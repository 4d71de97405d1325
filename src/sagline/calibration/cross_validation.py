"""How well poses are predicted that a calibration did not see."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.calibration.findings import CrossValidation
from sagline.calibration.least_squares import passed, solve
from sagline.calibration.observing import BLOCK, NO_LOAD, Machine
from sagline.calibration.problem import Problem, machine_at, said_lengths
from sagline.calibration.search import Found
from sagline.calibration.sensors import load_cells_of
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress, blocks
from sagline.kernels.calibration import kinds
from sagline.kinematics.forward_rows import solve_rows


class Missed(NamedTuple):
    """What was read less what the lengths that were read predict, squares of it summed.

    Attributes:
        cells: Of load cells [N^2].
        cell_count: How many of them.
        positions: Of positions [m^2].
        position_count: How many of them.
    """

    cells: float = 0.0
    cell_count: int = 0
    positions: float = 0.0
    position_count: int = 0

    def plus(self, other: Missed) -> Missed:
        """Both together."""
        cells, positions = self.cells + other.cells, self.positions + other.positions
        return Missed(cells, self.cell_count + other.cell_count, positions, self.position_count + other.position_count)

    @property
    def tension(self) -> float:
        """Root of the mean square of a load cell [N]."""
        return float(np.sqrt(self.cells / self.cell_count)) if self.cell_count else np.nan

    @property
    def position(self) -> float:
        """Root of the mean square of the distance from a measured position [m]."""
        return float(np.sqrt(self.positions / self.position_count)) if self.position_count else np.nan


def cross_validated(
    problem: Problem, found: Found, folds: int, *, robust: bool, progress: Progress | None = None
) -> CrossValidation | None:
    """Calibrate without each part of the poses, and predict what was read there by the lengths that were read.

    The parts are runs of poses that follow each other, so that rows of one pose with several tensions stay together,
    but for those where a part ends.
    Each calibration begins where that of all poses ended, and so it ends where it would from anywhere near.

    Args:
        problem: The problem.
        found: How the calibration by all poses ended.
        folds: How many parts, >= 2.
        robust: Whether poses count less that do not fit.
        progress: Told of every pass.

    Returns:
        Errors, of poses that fit and those that do not; None where there are fewer than two poses to part.
    """
    places = np.flatnonzero(found.kept)
    folds = min(folds, len(places))
    if folds < 2:
        return None
    now, before = Missed(), Missed()
    drawn = machine_at(problem, problem.prior)
    for part in np.array_split(places, folds):
        left = np.zeros(len(found.kept), dtype=np.bool_)
        left[part] = True
        rest = found.kept & ~left
        begun = passed(problem, found.fit.state, None, rest, progress=progress)
        fit = solve(problem, begun, rest, robust=robust, progress=progress)
        whole = slice(int(part[0]), int(part[-1]) + 1)
        now = now.plus(missed_by(problem, fit.state.machine, found.fit.state.poses, left, whole))
        before = before.plus(missed_by(problem, drawn, found.fit.state.poses, left, whole))
    # nobody knew then where the system stood that measured
    unplaced = (problem.parameters.where[kinds.SHIFT : kinds.TARGET + 3, 0] >= 0).any()
    there = np.nan if unplaced else before.position
    return CrossValidation(folds, now.tension, now.position, before.tension, there)


def missed_by(problem: Problem, machine: Machine, starts: Array, which: Flags, whole: slice) -> Missed:
    """What a robot's predictions miss at some poses; poses at which it finds no equilibrium are not among them.

    Args:
        problem: What was read.
        machine: The robot and its sensors.
        starts: Pose rows near which it stands, (N, POSE_COLUMNS).
        which: The poses, (N,).
        whole: Where they are among all.
    """
    found = Missed()
    for own in blocks(whole.stop - whole.start, BLOCK):
        part = slice(whole.start + own.start, whole.start + own.stop)
        try:
            said = said_lengths(problem, machine, part)
        except InvalidValueError:  # counts run off drums that are too wrong
            continue
        there = which[part] & np.isfinite(said).all(axis=1) & (said > 0.0).all(axis=1)
        asked = locked(np.where(there[:, None], said, np.nan))
        solved = solve_rows(machine.robot, problem.model, asked, locked(starts[part].copy()), NO_LOAD)
        there &= solved.stable
        tension = solved.solution(
            machine.robot, problem.model, np.zeros(6), (len(said),)
        ).state.cables.frame_end_tension
        sensors, (gain, bias) = machine.sensors, load_cells_of(machine.robot)
        cells = (problem.log.cells[part] - (gain * tension + bias))[there]
        cells = cells[~np.isnan(cells)]
        turned = Rotation.from_quat(solved.poses[there, 3:]).apply(sensors.target.copy())
        point = solved.poses[there, :3] + turned - sensors.frame.position
        apart = np.linalg.norm(problem.log.positions[part][there] - point @ sensors.frame.matrix, axis=1)
        apart = apart[~np.isnan(apart)]
        found = found.plus(Missed(float(cells @ cells), cells.size, float(apart @ apart), apart.size))
    return found

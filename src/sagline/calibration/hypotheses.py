"""Hypotheses about mistakes in a log that no robot similar to the given robot fits, and tests on some of its rows."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.calibration.least_squares import best_step, evaluate_step, solve
from sagline.calibration.log import WinchLog
from sagline.calibration.observations import Readings
from sagline.calibration.parameters import Unknown, parameters_of
from sagline.calibration.problem import Evaluated, FitProblem, SearchState, start_of
from sagline.core.arguments import evenly_spaced
from sagline.core.arrays import Array, Indices
from sagline.robot.drum import Drums
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

MOST_ROWS: Final = 24  # number of rows for the test of a hypothesis: about three load cell readings per unknown
STEPS: Final = 12  # largest number of least-squares iterations; a log without mistakes needs half of them
TOLERANCE: Final = 1.0  # the fit stops if the predicted decrease of the sum of squares is below this value
FEWEST_ROWS: Final = 8  # number of rows for the test of a hypothesis if the log has no commanded poses
# Prior deviations. They are larger than usual, so that any similar robot may fit. They are relative to the value where
# its logarithm is estimated.
_WIDE: Final = {
    "frame_anchors": 0.3,
    "platform_anchors": 0.05,
    "length_zero": 0.5,
    "drum_radius": 0.03,
    "length_scale": 0.05,  # one value for all cables
    "axial_stiffness": 0.5,
    "linear_density": 0.5,
    "mass": 0.2,
    "center_of_mass": 0.2,
}


CELL_UNITS: Final = {"": 1.0, "kgf": 9.80665, "lbf": 4.4482216152605}  # [N]
LENGTH_UNITS: Final = {"": 1.0, "ft": 0.3048, "in": 0.0254}  # [m]
# Corrections of an inclinometer: the column that is read as pitch and as roll, 0: beta, 1: gamma, and its sign.
TILTS: Final = {
    "": ((0, 1.0), (1, 1.0)),
    "change the sign of gamma": ((0, 1.0), (1, -1.0)),
    "change the sign of beta": ((0, -1.0), (1, 1.0)),
    "change the signs of beta and gamma": ((0, -1.0), (1, -1.0)),
    "exchange beta and gamma": ((1, 1.0), (0, 1.0)),
    "exchange beta and gamma, and change the sign of gamma": ((1, 1.0), (0, -1.0)),
    "exchange beta and gamma, and change the sign of beta": ((1, -1.0), (0, 1.0)),
    "exchange beta and gamma, and change both signs": ((1, -1.0), (0, -1.0)),
}


class Hypothesis(NamedTuple):
    """Hypothesis about a mistake: a change that would correct the readings of a log."""

    lengths: tuple[int, int] | None = None  # two cables with exchanged lengths or counts, or None
    cells: tuple[int, int] | None = None  # two cables with exchanged load cells, or None
    flipped: int | None = None  # a cable with an encoder that counts backward, or None
    moved: tuple[int, ...] = ()  # cables with zeros that are computed from the commanded poses
    late: int = 0  # number of rows by which the load cells lag behind the encoders
    behind: int = 0  # number of rows by which the encoders lag behind the load cells and the commanded poses
    cell_unit: str = ""  # unit of the load cells in `CELL_UNITS`; "" for newtons
    length_unit: str = ""  # unit of the lengths in `LENGTH_UNITS`; "" for meters
    tilt: str = ""  # correction of an inclinometer in `TILTS`; "" for none


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Tests of hypotheses about mistakes in a log."""

    robot: Robot  # the robot before the calibration
    model: CableModel
    log: WinchLog  # the whole log
    rows: Indices  # indices of the rows that the tests may use
    # poses by forward kinematics for each tested change of the lengths and each number of rows
    found: dict[tuple[Hypothesis, int], Pose] = field(default_factory=dict)

    def result(self, change: Hypothesis) -> tuple[float, float, Array]:
        """Fit of a similar robot to the changed readings: quality, departure, and errors of the zeros [m], (m,)."""
        # The quality is the sum of squares per reading, as a median over the rows: about 1 if a robot fits within the
        # deviations of the sensors, infinite if no robot fits. The departure is the mean square of the distance of the
        # parameters from their priors, in prior deviations.
        problem, poses, moved = self._problem(change, MOST_ROWS)
        try:
            state, normal = _fitted(problem, start_of(problem, poses))
        except (ValueError, np.linalg.LinAlgError):  # the search diverges if the readings are inconsistent
            return np.inf, np.inf, moved
        quality = float(np.median(normal.squares / np.maximum(normal.readings, 1)))
        off = state.numbers - problem.prior
        zeros = np.array([name == "length_zero" for name in problem.parameters.names])
        departure = float(np.mean((off / problem.parameters.internal_deviation) ** 2))
        return quality, departure, moved + off[zeros]

    def promise(self, change: Hypothesis, steps: int) -> float:
        """Predicted sum of squares per row after `steps` + 1 least-squares steps; infinite without a fit."""
        most = FEWEST_ROWS if self.log.commanded is None else MOST_ROWS
        problem, poses, _ = self._problem(change, most)
        kept, step = np.ones(len(problem.log.cells), dtype=np.bool_), None
        try:
            state = start_of(problem, poses)
            for _ in range(steps + 1):
                state, normal = evaluate_step(problem, state, step, kept)
                kept = kept & np.isfinite(normal.squares)
                step, gain = best_step(problem, state, normal)
        except (ValueError, np.linalg.LinAlgError):
            return np.inf
        there = int(np.count_nonzero(kept))
        return float(normal.squares[kept].sum() - gain) / there if 2 * there > len(kept) else np.inf

    def most_promising(self, changes: Iterable[Hypothesis], steps: int, most: int) -> list[Hypothesis]:
        """At most `most` of the `changes` with a smaller predicted misfit than the unchanged log, best first."""
        promises = {change: self.promise(change, steps) for change in changes}
        limit = self.promise(Hypothesis(), steps)
        return sorted((change for change in promises if promises[change] < limit), key=promises.__getitem__)[:most]

    def offsets(self) -> tuple[Array, Array]:
        """Differences between reported and commanded lengths [m]: median and median absolute deviation, both (m,)."""
        problem, poses, _ = self._problem(Hypothesis(), MOST_ROWS)
        return _offsets(problem, poses)

    def measured_points(self) -> tuple[Array, Array]:
        """Positions (N, 3) of the target [m] according to commanded poses or lengths, and measured positions (N, 3)."""
        problem, poses, _ = self._problem(Hypothesis(), MOST_ROWS)
        sensors, measured = self.log.sensors, problem.log.positions
        if poses is None:
            return measured[:0], measured[:0]
        turned = poses.rotation.apply(np.array(sensors.target))
        return poses.position + turned, sensors.frame.position + measured @ sensors.frame.matrix.T

    def _problem(self, change: Hypothesis, most: int) -> tuple[FitProblem, Pose | None, Array]:
        """Least-squares problem for at most `most` rows, the initial poses of the rows, and shifts of the zeros [m]."""
        log, late, m = self.log, change.late, self.robot.cable_count
        read_at = self.rows + late + change.behind  # either `late` or `behind` is zero
        rows = self.rows[(read_at >= 0) & (read_at < len(log))]
        rows = rows[evenly_spaced(len(rows), most)]
        given = Readings.of(log.rows(rows))._replace(swivels=None, frequencies=None)
        sensors = log.sensors.replace(swivel_deviation=None, frequency_deviation=None)
        read = LENGTH_UNITS[change.length_unit] * _swap_columns(log.readings[rows + change.behind], change.lengths)
        if log.load_cells is not None:
            cells = CELL_UNITS[change.cell_unit] * log.load_cells[rows + late]
            given = given._replace(cells=_swap_columns(cells, change.cells))
        counted, winches = log.counts is not None, self.robot.winches
        if (cable := change.flipped) is not None:
            zero = winches.count_zero[cable] if counted and winches is not None else read[:, cable].max()
            read[:, cable] = 2.0 * zero - read[:, cable]
        given = given._replace(**{"counts" if counted else "lengths": read})
        if change.tilt:
            given = given._replace(rotations=_changed_tilt(given.rotations, TILTS[change.tilt]))
        wide = [
            Unknown(name, shared=True if name == "length_scale" else None, deviation=width)
            for name, width in _WIDE.items()
            if self._has(name, counted)
        ]
        parameters = parameters_of(self.robot, wide, sensors, counted=counted)
        problem = FitProblem(self.robot, self.model, sensors, parameters, given)
        poses = self._poses(problem, change, most) if log.commanded is None else log.commanded[rows]
        moved = np.zeros(m)
        shifted = list(change.moved)
        if change.flipped is not None and not counted:  # the length at zero counts of a reversed encoder is unknown
            shifted.append(change.flipped)
        if shifted and poses is not None:
            moved[shifted] = -_offsets(problem, poses)[0][shifted]
            read += moved * (self._counts_of_length() if counted else 1.0)
        return problem, poses, moved

    def _poses(self, problem: FitProblem, change: Hypothesis, most: int) -> Pose | None:
        """Poses by forward kinematics of the lengths; None if the forward kinematics of any row fails."""
        key = change._replace(cells=None, cell_unit="", tilt=""), most
        if key not in self.found:
            rows = start_of(problem, None).poses
            if not np.isfinite(rows).all():
                return None
            self.found[key] = Pose.from_quaternion(rows[:, :3], rows[:, 3:])
        return self.found[key]

    def _has(self, name: str, counted: bool) -> bool:
        """True if the robot has the parameter `name`."""
        if name == "drum_radius":
            return counted
        if name == "length_scale":
            return not counted and self.log.position is not None
        return name != "linear_density" or bool((self.robot.cables.linear_density > 0.0).all())

    def _counts_of_length(self) -> Array:
        """Encoder counts (m,) per meter of cable that leaves the lowest layer of each drum [1/m]."""
        drums = Drums(self.robot)
        rate = drums.zero_and_rate()[1]
        _, travel = drums.turns(drums.starts[:, :1].T)
        return np.asarray(rate / np.abs(travel[0]))


def _fitted(problem: FitProblem, state: SearchState) -> Evaluated:
    """State after at most `STEPS` least-squares steps, and the normal equations at this state."""
    begun = evaluate_step(problem, state, None, np.ones(len(state.poses), dtype=np.bool_))
    fit = solve(problem, begun, np.isfinite(begun[1].squares), robust=False, steps=STEPS, tolerance=TOLERANCE)
    return fit.state, fit.normal


def _offsets(problem: FitProblem, poses: Pose | None) -> tuple[Array, Array]:
    state = start_of(problem, poses)
    off = problem.reported_lengths(problem.machine_at(problem.prior)) - state.lengths
    middle = np.median(off, axis=0)
    return middle, np.median(np.abs(off - middle), axis=0)


def _swap_columns(values: Array, two: tuple[int, int] | None) -> Array:
    values = values.copy()
    if two is not None:
        values[:, list(two)] = values[:, list(two[::-1])]
    return values


def _changed_tilt(rotations: Array, correction: tuple[tuple[int, float], tuple[int, float]]) -> Array:
    """Quaternions (N, 4) whose pitch and roll are changed; rows of NaN stay."""
    found, read = rotations.copy(), ~np.isnan(rotations).any(axis=1)
    yaw, *tilt = Rotation.from_quat(rotations[read]).as_euler("ZYX").T
    (pitch, one), (roll, other) = correction
    found[read] = Rotation.from_euler("ZYX", np.stack((yaw, one * tilt[pitch], other * tilt[roll]), axis=1)).as_quat()
    return found

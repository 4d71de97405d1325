"""Estimation problem of a calibration, its initial state, and the states of the search for a solution."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.calibration.further import circular_mean, swivel_angles
from sagline.calibration.log import Sensors, load_cells_of, measures_yaw
from sagline.calibration.observations import NO_LOAD, MachineTerms, Readings, WhitenedRows, lengths_at_counts
from sagline.calibration.parameters import Parameters, sensors_with, with_values
from sagline.calibration.straight import lines_at
from sagline.core.arrays import Array, Flags, locked
from sagline.kernels import codes
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.observe import starting_lengths
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward import centered_positions, search
from sagline.robot.batch import has_slanted_axes
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows

_PAIRS: Final = 3  # smallest number of measured points that determine the axes of a measuring system
_LINE: Final = 1e-3  # points are collinear if their distance from a line is less than this share of their extent
_NONNEGATIVE: Final = ("pulley_radius", "dead_cable")  # kinds with a lower bound of zero, which is also a typical value


class FitProblem(NamedTuple):
    """The estimation problem: robot, cable model, sensors, unknown parameters and readings."""

    robot: Robot  # the robot before the calibration
    model: CableModel
    sensors: Sensors
    parameters: Parameters
    log: Readings

    @property
    def prior(self) -> Array:
        """Prior values (P,) of the internal parameters."""
        return self.parameters.internal(self.parameters.prior)

    @property
    def relative(self) -> bool:
        """True if reported lengths have unknown zeros without a prior, so that they say nothing before the fit."""
        zeros = self.parameters.where[kinds.ZERO]
        wide = np.isinf(self.parameters.prior_deviation[zeros]) & (zeros >= 0)
        return not self.parameters.counted and bool(wide.any())

    @property
    def from_level(self) -> bool:
        """True if the initial rotations are level, because reported lengths are too inaccurate for a search."""
        placed = not np.isnan(self.log.positions).any(axis=1).all()
        return self.relative or (self.straight and (placed or has_slanted_axes(self.robot)))

    @property
    def straight(self) -> bool:
        """True for straight cables: poses are fitted to lengths, without a force balance."""
        return self.model.code == codes.STRAIGHT

    def readings(self, reported: Array, part: slice) -> Readings:
        """Readings at the poses `part` with the reported lengths `reported` (n, m) [m]."""
        log = self.log
        further = (None if read is None else read[part] for read in (log.swivels, log.frequencies))
        return Readings(reported, log.cells[part], log.positions[part], log.rotations[part], *further)

    @property
    def scale(self) -> Array:
        """Scale (P,) of each internal parameter: its prior deviation or its usual deviation, whichever is smaller."""
        # With a larger scale, rounding errors would hide the sums of squares of well-observed parameters.
        return np.asarray(np.fmin(self.parameters.internal_deviation, self.parameters.usual_deviation))

    @property
    def least(self) -> Array:
        """Lower bounds of the internal parameters, (P,)."""
        return np.array([0.0 if name in _NONNEGATIVE else -np.inf for name in self.parameters.names])

    def machine_at(self, numbers: Array) -> MachineTerms:
        """Robot and sensors with the internal parameters `numbers` (P,); raises an error if the robot rejects them."""
        parameters = self.parameters
        values = parameters.external(numbers)
        robot, sensors = with_values(self.robot, parameters, values), sensors_with(self.sensors, parameters, values)
        offset, scale = parameters.length_offset(values), parameters.of_cables(values, kinds.SCALE, 1.0)
        late, turned = (parameters.of_cables(values, row, 0.0) for row in (kinds.CLOCK, kinds.SWIVEL))
        return MachineTerms(robot, self.model, parameters, sensors, offset, scale, late, turned)

    def reported_lengths(self, machine: MachineTerms, part: slice = slice(None)) -> Array:
        """Lengths (n, m) [m] that the winches report at the poses `part`."""
        late = 0.0
        if self.log.motion is not None:
            speed, acceleration = self.log.motion[:, part]
            late = machine.late * (speed + 0.5 * machine.late * acceleration)
        if self.log.counts is not None and machine.drums is not None:
            return lengths_at_counts(machine.drums, self.log.counts[part]) + late
        return np.asarray(machine.scale * (self.log.lengths[part] + late) + machine.offset)

    def winch_slopes(self, machine: MachineTerms, lengths: Array, part: slice, *, counted: bool = True) -> Array:
        """Derivatives (5, n, m) of the reported lengths (n, m) [m] at the poses `part`; counted: at the read counts."""
        counts = self.log.counts[part] if counted and self.log.counts is not None else None
        slopes = machine.winch_slopes(lengths, counts)
        if self.log.motion is not None:
            speed, acceleration = self.log.motion[:, part]
            slopes[4] = machine.scale * (speed + machine.late * acceleration)
        return slopes


class SearchState(NamedTuple):
    """State of the search: parameter values with lengths and poses in equilibrium."""

    numbers: Array  # internal parameters, (P,)
    machine: MachineTerms  # the robot with these parameters
    lengths: Array  # true lengths [m], (N, m)
    poses: Array  # pose rows, (N, POSE_COLUMNS)


class Normal(NamedTuple):
    """Normal equations of the least-squares problem at a state."""

    matrix: Array  # J^T W J of all poses, without the prior, (P, P)
    gradient: Array  # J^T W y of all poses, without the prior, (P,)
    squares: Array  # sum of squares of each pose, (N,); infinite for a pose without an equilibrium
    readings: NDArray[np.int16]  # number of readings at each pose, (N,); small integers save memory
    weights: Array  # weights of the poses, (N,)
    # whitened readings of all poses; None for a log longer than one block, which would need too much memory
    rows: WhitenedRows | None


class Fit(NamedTuple):
    """Result of the least-squares search."""

    state: SearchState  # last state
    normal: Normal  # normal equations at this state
    converged: bool  # True if the tolerance is met
    iterations: int  # number of steps


Evaluated = tuple[SearchState, Normal]


def start_of(problem: FitProblem, commanded: Pose | None) -> SearchState:
    """Initial state: prior values, and poses that are measured, commanded or computed from the reported lengths."""
    # The true lengths are computed from these poses and the measured tensions. The reported lengths would give wrong
    # tensions, because an anchor error of one millimeter changes the tension of a steel cable by about 90 N.
    numbers = problem.prior
    offset = problem.parameters.length_offset(problem.parameters.prior)
    machine = MachineTerms(problem.robot, problem.model, problem.parameters, problem.sensors, offset)
    reported = problem.reported_lengths(machine)
    poses = _poses(problem, machine, reported, commanded)
    if problem.straight:
        lengths = lines_at(machine, problem.readings(reported, slice(None)), poses).lengths
    else:  # with the reported lengths, noise makes cables slack, which the measured rotations then contradict
        sensors = problem.sensors
        lone = sensors.rotation_deviation is not None and sensors.position_deviation is None
        balanced = lone and sensors.tension_deviation is None
        lengths = held_lengths(problem, machine, poses, reported, balanced=balanced)
    aligned = _aligned(problem, numbers, poses)
    if problem.relative:
        aligned = aligned.copy() if aligned is numbers else aligned
        zeros, off = problem.parameters.where[kinds.ZERO], np.nanmedian(lengths - reported, axis=0)
        for at in np.unique(zeros):
            aligned[at] += off[zeros == at].mean()
    aligned = with_swivel_zeros(problem, aligned, poses)
    return SearchState(aligned, machine if aligned is numbers else problem.machine_at(aligned), lengths, poses)


def with_swivel_zeros(problem: FitProblem, numbers: Array, poses: Array) -> Array:
    """Parameters whose unknown zeros of swivel angles are the mean differences to the directions of the cables."""
    zeros = problem.parameters.where[kinds.SWIVEL]
    if problem.log.swivels is None or (zeros < 0).all():
        return numbers
    found, off = numbers.copy(), problem.log.swivels - swivel_angles(problem.robot, poses)
    for at in np.unique(zeros[zeros >= 0]):
        found[at] += circular_mean(off[:, zeros == at] - found[at])
    return found


def held_lengths(
    problem: FitProblem, machine: MachineTerms, poses: Array, reported: Array, *, balanced: bool = False
) -> Array:
    """Unstrained lengths [m] from poses and measured tensions; the reported length where a tension is missing."""
    # With `balanced`, or if reported lengths are relative, a missing tension is the cable's share of the weight or its
    # lower limit, whichever is larger.
    balanced = balanced or problem.relative
    if problem.sensors.tension_deviation is None and not balanced:
        return reported.copy()
    robot, cells = machine.robot, problem.log.cells
    gain, bias = load_cells_of(robot)
    tension = np.maximum((cells - bias) / gain, 0.0)
    read = ~np.isnan(tension)
    usual = np.sum(np.where(read, tension, 0.0), axis=1) / np.maximum(np.count_nonzero(read, axis=1), 1)
    share = np.maximum(robot.tension_min, robot.mass * robot.gravity / robot.cable_count)
    tension = np.where(read, tension, np.where(usual[:, None] > 0.0, usual[:, None], share))
    lengths = np.empty(reported.shape)
    starting_lengths(
        problem.model.terms(robot.gravity),
        robot.freedom,
        cable_table(robot, slanted=True)[0],
        body_table(robot)[0],
        locked(poses.view()),
        locked(tension),
        memory_for(robot.cable_count),
        lengths,
    )
    held = np.isfinite(lengths) & (np.any(read, axis=1, keepdims=True) | balanced)
    return np.where(held, lengths, reported)


def _poses(problem: FitProblem, machine: MachineTerms, reported: Array, commanded: Pose | None) -> Array:
    """Initial pose rows: measured poses if available, else commanded poses, else poses by the reported lengths."""
    if commanded is not None:
        poses = np.array(pose_rows(commanded))
        poses = np.broadcast_to(poses, (len(reported), poses.shape[1])).copy()
    elif problem.from_level:
        level = np.array([0.0, 0.0, 0.0, 1.0])
        poses = np.tile(np.append(centered_positions(machine.robot, level), level), (len(reported), 1))
    else:
        found = search(machine.robot, problem.model, locked(reported.view()), NO_LOAD, None)
        poses = found.poses.copy()
    if np.any(problem.parameters.where[kinds.SHIFT : kinds.TARGET + 3, 0] >= 0):
        return poses  # measured poses cannot be used before the pose of the measuring system is known
    sensors, log = machine.sensors, problem.log
    placed, turned = _measured(problem)
    frame = sensors.frame
    if turned.any():
        poses[turned, 3:] = (frame.rotation * Rotation.from_quat(log.rotations[turned])).as_quat()
    both = placed & (turned | problem.from_level | (commanded is not None and problem.straight))
    if both.any():
        target = frame.position + log.positions[both] @ frame.matrix.T
        moved = target - Rotation.from_quat(poses[both, 3:]).apply(sensors.target.copy())
        if problem.from_level or problem.straight:  # a planar platform stays in its plane
            free = machine.robot.freedom[:, :3]
            moved = poses[both, :3] + (moved - poses[both, :3]) @ free.T @ free
        poses[both, :3] = moved
    return poses


def _measured(problem: FitProblem) -> tuple[Flags, Flags]:
    """Rows with a whole measured position, and rows with a whole measured rotation, (N,)."""
    placed, turned = (~np.isnan(read).any(axis=1) for read in (problem.log.positions, problem.log.rotations))
    return np.asarray(placed), np.asarray(turned & measures_yaw(problem.sensors))


def _aligned(problem: FitProblem, numbers: Array, poses: Array) -> Array:
    """Parameters after alignment of an unknown measuring system to `poses`; unchanged if there are too few readings."""
    where = problem.parameters.where[kinds.SHIFT : kinds.TURN + 3, 0]
    if where[0] < 0:
        return numbers
    frame, log, platform = problem.sensors.frame, problem.log, Rotation.from_quat(poses[:, 3:])
    placed, turned = _measured(problem)
    read = log.positions[placed]
    there = poses[placed, :3] + platform[placed].apply(problem.sensors.target.copy())
    if turned.any():
        turn = (platform[turned] * Rotation.from_quat(log.rotations[turned]).inv()).mean()
    elif _spans(read):
        turn, _ = Rotation.align_vectors(there - there.mean(axis=0), read - read.mean(axis=0))
    else:
        return numbers
    found = numbers.copy()
    found[where[3:]] = (turn * frame.rotation.inv()).as_rotvec()
    if placed.any():
        found[where[:3]] = (there - turn.apply(read)).mean(axis=0)
    return found


def _spans(points: Array) -> bool:
    """True if points (N, 3) are not collinear, so that they determine a rotation."""
    if len(points) < _PAIRS:
        return False
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[1] > _LINE * sizes[0])

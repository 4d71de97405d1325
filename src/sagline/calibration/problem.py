"""The estimation problem of a calibration, its initial state, and the states of its search."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.calibration.log import Sensors, WinchLog, load_cells_of
from sagline.calibration.observations import NO_LOAD, MachineTerms, WhitenedRows, lengths_at_counts, machine_of
from sagline.calibration.parameters import (
    KINDS,
    Parameters,
    external,
    internal,
    offset_with,
    prior_root,
    sensors_with,
    with_values,
)
from sagline.core.arrays import Array, Indices, locked
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.observe import starting_lengths
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward import search
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows

_PAIRS: Final = 3  # number of measured points that are required to align a measuring system
_LINE: Final = 1e-3  # points count as collinear if their distance from a line is less than this share of their extent
_NONNEGATIVE: Final = ("pulley_radius", "dead_cable")  # kinds with a typical value of zero


class ReadingsTable(NamedTuple):
    """Readings at N poses, NaN if missing."""

    counts: Array | None  # encoder counts, (N, m), or None
    lengths: Array | None  # reported lengths [m], (N, m), or None; exactly one of counts and lengths is given
    cells: Array  # load cell readings [N], (N, m)
    positions: Array  # measured positions [m], (N, 3)
    rotations: Array  # measured rotations as unit quaternions, (N, 4)


def readings_table(log: WinchLog) -> ReadingsTable:
    """Readings of a log with NaN in place of missing columns."""
    count, m = log.readings.shape
    columns = ((log.load_cells, m), (log.position, 3), (log.rotation, 4))
    tables = (np.broadcast_to(np.nan, (count, width)) if read is None else read for read, width in columns)
    return ReadingsTable(log.counts, log.unstrained_length, *tables)


class FitProblem(NamedTuple):
    """The estimation problem."""

    robot: Robot  # the robot before the calibration
    model: CableModel
    sensors: Sensors
    parameters: Parameters
    log: ReadingsTable

    @property
    def prior(self) -> Array:
        """Prior of the internal parameters, (P,)."""
        return internal(self.parameters, self.parameters.prior)

    @property
    def prior_deviation(self) -> Array:
        """Standard deviation of the prior, (P,)."""
        known, prior = self.parameters.prior_deviation, self.parameters.prior
        return np.asarray(known / np.where(self.parameters.logarithmic, prior, 1.0))

    def missed(self, numbers: Array) -> Array:
        """Internal parameters minus their prior, in prior standard deviations, (P,)."""
        return np.asarray(self.prior_root @ (numbers - self.prior))

    @property
    def prior_root(self) -> Array:
        """Root of the prior information: a matrix W, (P, P); W^T W is the inverse of the prior covariance."""
        return np.asarray(prior_root(self.parameters) / self.prior_deviation)

    @property
    def scale(self) -> Array:
        """Scale of each internal parameter (P,): the smaller of its prior and its usual deviation.

        With larger scales, rounding would hide the sums of squares of well-observed parameters.
        """
        usual = np.array([KINDS[name].assumed for name in self.parameters.names])
        return np.asarray(np.fmin(self.prior_deviation, usual))

    @property
    def least(self) -> Array:
        """Lower bounds of the internal parameters, (P,)."""
        return np.array([0.0 if name in _NONNEGATIVE else -np.inf for name in self.parameters.names])

    def machine_at(self, numbers: Array) -> MachineTerms:
        """Robot and sensors with internal parameters (P,); an error if they are invalid for the robot."""
        values, parameters = external(self.parameters, numbers), self.parameters
        robot = with_values(self.robot, parameters, values)
        sensors, offset = sensors_with(self.sensors, parameters, values), offset_with(self.robot, parameters, values)
        return machine_of(robot, self.model, parameters, sensors, offset)

    def reported_lengths(self, machine: MachineTerms, part: slice = slice(None)) -> Array:
        """Lengths reported by the winches [m], (n, m), for some of the poses."""
        if self.log.counts is not None and machine.drums is not None:
            return lengths_at_counts(machine.drums, self.log.counts[part])
        assert self.log.lengths is not None
        return np.asarray(self.log.lengths[part] + machine.offset)


class SearchState(NamedTuple):
    """A state of the search."""

    numbers: Array  # internal parameters, (P,)
    machine: MachineTerms  # the robot with these parameters
    lengths: Array  # true lengths [m], (N, m)
    poses: Array  # pose rows, (N, POSE_COLUMNS)


class Normal(NamedTuple):
    """Normal equations of all poses at a state."""

    matrix: Array  # J^T W J of all poses, without the prior, (P, P)
    gradient: Array  # J^T W y, (P,)
    squares: Array  # sum of squares of each pose, (N,); infinite for a pose without an equilibrium
    readings: Indices  # number of readings at each pose, (N,)
    weights: Array  # weights of the poses, (N,)
    # whitened readings if the log has one block; None for a longer log, because storing them takes too much memory
    rows: WhitenedRows | None


class Fit(NamedTuple):
    """Result of the least squares."""

    state: SearchState  # last state
    normal: Normal  # normal equations at this state
    converged: bool  # True if the tolerance is met
    iterations: int  # number of steps


Evaluated = tuple[SearchState, Normal]


def start_of(problem: FitProblem, commanded: Pose | None) -> SearchState:
    """Initial state: the priors, with the platform at commanded poses or at poses from the reported lengths.

    The true lengths follow from these poses and the measured tensions. One millimeter of a steel cable changes its
    tension by 90 N. Reported lengths therefore do not determine the tensions as long as the anchors are inaccurate.
    """
    numbers = problem.prior
    offset = offset_with(problem.robot, problem.parameters, problem.parameters.prior)
    machine = machine_of(problem.robot, problem.model, problem.parameters, problem.sensors, offset)
    reported = problem.reported_lengths(machine)
    poses = _poses(problem, machine, reported, commanded)
    lengths = held_lengths(problem, machine, poses, reported)
    aligned = _aligned(problem, numbers, poses)
    return SearchState(aligned, machine if aligned is numbers else problem.machine_at(aligned), lengths, poses)


def held_lengths(problem: FitProblem, machine: MachineTerms, poses: Array, reported: Array) -> Array:
    """Unstrained lengths [m] from the measured tensions at poses; the reported length where no tension is measured."""
    if problem.sensors.tension_deviation is None:
        return reported.copy()
    robot, cells = machine.robot, problem.log.cells
    gain, bias = load_cells_of(robot)
    tension = np.maximum((cells - bias) / gain, 0.0)
    read = ~np.isnan(tension)
    usual = np.sum(np.where(read, tension, 0.0), axis=1) / np.maximum(np.count_nonzero(read, axis=1), 1)
    tension = np.where(read, tension, usual[:, None])
    lengths = np.empty(reported.shape)
    starting_lengths(
        problem.model.terms(robot.gravity),
        robot.freedom,
        cable_table(robot)[0],
        body_table(robot)[0],
        locked(poses.view()),
        locked(tension),
        memory_for(robot.cable_count),
        lengths,
    )
    held = np.isfinite(lengths) & np.any(read, axis=1, keepdims=True)
    return np.where(held, lengths, reported)


def _poses(problem: FitProblem, machine: MachineTerms, reported: Array, commanded: Pose | None) -> Array:
    """Initial pose rows: measured poses; otherwise commanded poses; otherwise poses from the reported lengths."""
    if commanded is not None:
        poses = np.array(pose_rows(commanded))
        poses = np.broadcast_to(poses, (len(reported), poses.shape[1])).copy()
    else:
        found = search(machine.robot, problem.model, locked(reported.view()), NO_LOAD, None)
        poses = found.poses.copy()
    if np.any(problem.parameters.where[kinds.SHIFT : kinds.TARGET + 3, 0] >= 0):
        return poses  # the position of the measuring system is not known yet
    sensors, log = machine.sensors, problem.log
    turned = ~np.isnan(log.rotations).any(axis=1)
    placed = ~np.isnan(log.positions).any(axis=1)
    frame = sensors.frame
    if turned.any():
        poses[turned, 3:] = (frame.rotation * Rotation.from_quat(log.rotations[turned])).as_quat()
    both = placed & turned
    if both.any():
        target = frame.position + log.positions[both] @ frame.matrix.T
        poses[both, :3] = target - Rotation.from_quat(poses[both, 3:]).apply(sensors.target.copy())
    return poses


def _aligned(problem: FitProblem, numbers: Array, poses: Array) -> Array:
    """Parameters after alignment of the measuring system to the poses, if it is unknown and has enough readings."""
    where = problem.parameters.where[kinds.SHIFT : kinds.TURN + 3, 0]
    if where[0] < 0:
        return numbers
    frame, log, platform = problem.sensors.frame, problem.log, Rotation.from_quat(poses[:, 3:])
    placed, turned = ~np.isnan(log.positions).any(axis=1), ~np.isnan(log.rotations).any(axis=1)
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
    """True if points (N, 3) determine a rotation, because they are not collinear."""
    if len(points) < _PAIRS:
        return False
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[1] > _LINE * sizes[0])

"""Where the platform is to be expected around a commanded pose, after a calibration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.calibration import summary
from sagline.calibration.findings import Findings
from sagline.calibration.log import Sensors
from sagline.calibration.observations import unwhitened_slopes
from sagline.calibration.parameters import Parameters
from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, locked, numbers
from sagline.core.numbers import counted, n
from sagline.core.results import Result, Saved
from sagline.kinematics.forward import forward
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PoseError(Result):
    """Expected errors of poses, single or with a leading axis N.

    They are those of the platform where a calibrated robot's lengths for a commanded pose are paid out: of all numbers
    that were found, and of lengths that are off by the winches' own deviation.

    Attributes:
        pose: The commanded poses.
        covariance: Of the displacement of the platform frame's origin and its rotation vector, world axes, shape
            (..., 6, 6) [m^2, m rad, rad^2].
        own_covariance: The same but for a shift of the world and a turn about the vertical that the poses of the log
            have in common: what a robot that need not agree with anything outside itself is off.
    """

    pose: Pose
    covariance: Array
    own_covariance: Array

    def __str__(self) -> str:
        """Errors in a line, root mean squares over the poses that the robot can hold."""
        held = ~np.isnan(self.position)
        world, own, turn = (
            n(float(np.sqrt(np.mean(one[held] ** 2))), ".3g", unit) if held.any() else "–"
            for one, unit in ((self.position, "m"), (self.own_position, "m"), (self.rotation, "rad"))
        )
        poses = counted(int(np.count_nonzero(held)), "pose")
        return f"Errors to expect of {poses}: {world} in the world, {own} for itself, {turn}"

    @property
    def position(self) -> Array:
        """Root of the mean square of the distance from the commanded position [m], shape (...)."""
        return _root_of_trace(self.covariance[..., :3, :3])

    @property
    def own_position(self) -> Array:
        """The same by own_covariance [m], shape (...)."""
        return _root_of_trace(self.own_covariance[..., :3, :3])

    @property
    def rotation(self) -> Array:
        """Root of the mean square of the angle [rad], shape (...)."""
        return _root_of_trace(self.covariance[..., 3:, 3:])


def _root_of_trace(covariance: Array) -> Array:
    return locked(np.asarray(np.sqrt(np.trace(covariance, axis1=-2, axis2=-1))))


MOST = 300  # poses of a log that say what all of them have in common
_NOTHING = 1e-12  # of the largest slope: what so little follows does not follow
_OUTSIDE = ("measuring_frame", "target", "load_cell_gain", "load_cell_bias")  # which move no platform


class Known(NamedTuple):
    """What a calibration knows.

    Attributes:
        robot: The calibrated robot.
        model: Cable model.
        parameters: The unknowns.
        covariance: Of their values, (P, P).
        length_deviation: Of the lengths that the winches pay out [m], (m,).
    """

    robot: Robot
    model: CableModel
    parameters: Parameters
    covariance: Array
    length_deviation: Array


class Moved(NamedTuple):
    """How the platform frame's origin moves and turns, at N equilibria.

    Attributes:
        by_values: By the values of the parameters, lengths following, (N, 6, P) [m or rad].
        by_length: By the lengths, (N, 6, m).
    """

    by_values: Array
    by_length: Array


def known_of(
    robot: Robot,
    model: CableModel,
    parameters: Parameters,
    covariance: Array,
    sensors: Sensors,
) -> Known:
    """What a calibration knows.

    Args:
        robot: The calibrated robot.
        model: Cable model.
        parameters: The unknowns.
        covariance: Of their values, (P, P).
        sensors: What read.
    """
    spread = np.broadcast_to(sensors.length_deviation, (robot.cable_count,))
    return Known(robot, model, parameters, covariance, spread)


def moved_at(known: Known, poses: Array, lengths: Array) -> Moved:
    """How the platform moves at equilibria.

    Args:
        known: What the calibration knows.
        poses: Pose rows (N, POSE_COLUMNS).
        lengths: All cable off the drums there [m], (N, m).
    """
    m = known.robot.cable_count
    slopes = unwhitened_slopes(known.robot, known.model, known.parameters, Sensors(), poses, lengths)
    outside = np.isin(known.parameters.names, _OUTSIDE)
    by_values = np.where(outside, 0.0, slopes.by_values[:, m:])
    return Moved(by_values, slopes.by_length[:, m:])


def common_motion(known: Known, poses: Array, lengths: Array) -> Array:
    """Shift of the world and turn about the vertical that poses have in common, by the values: (4, P) [m and rad].

    Args:
        known: What the calibration knows.
        poses: Pose rows of the log, (N, POSE_COLUMNS).
        lengths: True lengths there [m], (N, m).
    """
    chosen = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), MOST)).round().astype(np.int64))
    by_values = moved_at(known, poses[chosen], lengths[chosen]).by_values[:, :3]
    there = ~np.isnan(by_values).any(axis=(1, 2))
    width = by_values.shape[-1]
    motions = _carried(poses[chosen][there])[:, :3].reshape(-1, 4)
    return np.asarray(np.linalg.lstsq(motions, by_values[there].reshape(-1, width), rcond=None)[0])


def _carried(poses: Array) -> Array:
    """What a shift of the world and a turn about the vertical do to poses, (N, 6, 4)."""
    carried = np.zeros((len(poses), 6, 4))
    carried[:, :3, :3] = np.eye(3)
    carried[:, 0, 3], carried[:, 1, 3] = -poses[:, 1], poses[:, 0]
    carried[:, 5, 3] = 1.0
    return carried


def scatter_of(known: Known, moved: Moved) -> Array:
    """Covariance of origin and rotation vector, the numbers and lengths as wrong as they are known to be, (N, 6, 6).

    Infinite along the diagonal where it follows a number that nothing tells.
    """
    lost = np.isinf(np.diagonal(known.covariance))
    told = np.where(lost[:, None] | lost, 0.0, known.covariance)
    by_length = moved.by_length * known.length_deviation
    scatter = moved.by_values @ told @ np.swapaxes(moved.by_values, 1, 2) + by_length @ np.swapaxes(by_length, 1, 2)
    if lost.any():
        size = np.abs(moved.by_values).max(axis=(1, 2), keepdims=True)
        open_rows = (np.abs(moved.by_values[:, :, lost]) > _NOTHING * size).any(axis=2)
        which, row = np.nonzero(open_rows)
        scatter[which, row, row] = np.inf
    return np.asarray(scatter)


def expected_at(known: Known, log_poses: Array, log_lengths: Array, pose: Pose) -> tuple[Array, Array]:
    """Covariances of the pose where a calibrated robot's lengths for a commanded one are paid out.

    Args:
        known: What the calibration knows.
        log_poses: Pose rows of the log, (N, POSE_COLUMNS).
        log_lengths: True lengths there [m], (N, m).
        pose: Commanded poses.

    Returns:
        Covariance, and that beside what the log's poses have in common, of shape (..., 6, 6); NaN where the robot
        cannot hold the pose.
    """
    rows = pose_rows(pose)
    plan = inverse(known.robot, pose, model=known.model)
    lengths = np.atleast_2d(plan.unstrained_length)
    whole, own = np.full((2, len(rows), 6, 6), np.nan)
    there = np.isfinite(lengths).all(axis=1)
    if there.any():
        moved = moved_at(known, rows[there], lengths[there])
        whole[there] = scatter_of(known, moved)
        common = common_motion(known, log_poses, log_lengths)
        own[there] = scatter_of(known, moved._replace(by_values=moved.by_values - _carried(rows[there]) @ common))
    return whole.reshape(*pose.shape, 6, 6), own.reshape(*pose.shape, 6, 6)


def about_center(scatter: Array, robot: Robot, pose: Pose) -> Array:
    """Covariances of the motion of the center of mass of those of the origin's, both (..., 6, 6).

    Infinite along the diagonal of what follows something infinite.
    """
    reach = pose.matrix @ robot.center_of_mass
    carried = np.zeros((*scatter.shape[:-2], 6, 6))
    carried[...] = np.eye(6)
    for axis, unit in enumerate(np.eye(3)):
        carried[..., :3, 3 + axis] = np.cross(unit, reach)
    lost = np.isinf(np.diagonal(scatter, axis1=-2, axis2=-1))
    told = np.where(lost[..., :, None] | lost[..., None, :], 0.0, scatter)
    found = np.asarray(carried @ told @ np.swapaxes(carried, -1, -2))
    which = np.arange(6)
    follows = ((carried != 0.0) & lost[..., None, :]).any(axis=-1)
    found[..., which, which] = np.where(follows, np.inf, found[..., which, which])
    return found


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(Findings, Saved):
    """Result of `calibrate`: P numbers found from the readings at N poses.

    Attributes:
        robot: The robot with what was found.
        before: The robot as it was.
        sensors: The sensors with what was found of the measuring system.
        length_offset: To be added to lengths that the machine believes [m], shape (m,); zero where counts were read.
        status: How it ended.
        parameters: What the numbers are, and their priors.
        values: What was found, in the units of the parameters, (P,).
        covariance: Of the values, (P, P); of what no datum and no prior tells it is infinite along the diagonal.
        chi_squared: Sum of squares of all residuals in standard deviations, priors included.
        degrees_of_freedom: Readings and lengths less what they determine: what chi_squared is to be compared with.
        rows: Rows of the log that were used, (N,).
        left_out: Why, and which rows of the log were not.
        poses: Where the platform stood, N of them.
        unstrained_length: The true lengths of the cables there [m], (N, m).
        residuals: Readings less predictions: lengths [m], load cells [N], position [m], rotation [rad], shape
            (N, 2 m + 6); NaN where nothing was read.
        chi_squared_of_pose: (N,).
        weights: Of the poses: less than 1 for one that does not fit the rest, (N,).
        outliers: Which do not fit, and by how much.
        gauge: Directions that the data leave open, where the priors have them.
        cannot_tell_apart: Directions that they hardly tell.
        cross_validation: Error at poses left out; None where it was not asked for.
        iterations: Of the least squares.
        model: Cable model.
        log: Where the readings come from.
        date: When it was done, ISO 8601.
    """

    def value_of(self, label: str) -> tuple[float, float]:
        """A number that was found and its standard error, both in the unit of its parameter.

        Args:
            label: As `parameters.labels` has it: "frame_anchors[3].x", "mass".

        Raises:
            InvalidValueError: If nothing is called so.
        """
        k = self.parameters.labels.index(choice(label, "label", self.parameters.labels))
        return float(self.values[k]), float(self.standard_error[k])

    def __str__(self) -> str:
        """What was found and how far it is to be trusted, in lines of 80 columns, the verdict first."""
        return summary.in_words(self)

    def pose_error(self, pose: Pose) -> PoseError:
        """How far from a commanded pose the platform is to be expected, with this calibration.

        The lengths that `inverse` gives the calibrated robot are paid out by the true one: what the calibration does
        not know moves the platform, and what the winches' lengths are off, `sensors.length_deviation`.

        Args:
            pose: One, or N.

        Returns:
            PoseError; NaN where the robot cannot hold the pose, infinite where it follows what nothing tells.

        Raises:
            InvalidValueError: If it is no pose, or one outside the motions of the robot's pattern.
        """
        poses, lengths = pose_rows(self.poses), np.atleast_2d(self.unstrained_length)
        whole, own = expected_at(self._known(), poses, lengths, instance(pose, Pose, "pose"))
        return PoseError(pose, locked(whole), locked(own))

    def forward(self, unstrained_length: ArrayLike, start: Pose | None = None) -> ForwardSolution:
        """Where the platform rests at lengths that the machine believes, with the covariance of that.

        Args:
            unstrained_length: [m], shape (m,) or (N, m); `length_offset` is added to them.
            start: As of `forward`.

        Returns:
            ForwardSolution of the calibrated robot; `covariance` is that of what the calibration does not know and of
            `sensors.length_deviation` together, NaN where there is no solution.

        Raises:
            InvalidValueError: As of `forward`.
        """
        believed = numbers(unstrained_length, "unstrained_length", "m")
        lengths = believed if believed.shape[-1:] != self.length_offset.shape else believed + self.length_offset
        found = forward(self.robot, lengths, start, self.model)
        rows, shape = np.atleast_2d(found.state.unstrained_length), found.pose.shape
        there = np.isfinite(rows).all(axis=1) & np.atleast_1d(found.stable)
        scatter = np.full((len(rows), 6, 6), np.nan)
        known = self._known()
        scatter[there] = scatter_of(known, moved_at(known, pose_rows(found.pose)[there], rows[there]))
        covariance = about_center(scatter.reshape(*shape, 6, 6), self.robot, found.pose)
        return replace(found, covariance=locked(covariance))

    def _known(self) -> Known:
        return known_of(self.robot, self.model, self.parameters, self.covariance, self.sensors)

    def table(self) -> str:
        """Every number with its standard error, what was there before, and how far it has moved, one a line."""
        return summary.table(self)

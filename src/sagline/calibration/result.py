"""Result of a calibration, and the expected errors of commanded poses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from sagline.calibration import findings, summary
from sagline.calibration.findings import Findings, SensorDeviation
from sagline.calibration.log import Sensors
from sagline.calibration.observations import MachineTerms, unwhitened_slopes
from sagline.calibration.straight import slopes_of_poses
from sagline.core.arguments import choice, evenly_spaced, flag
from sagline.core.arrays import Array, locked, numbers
from sagline.core.numbers import counted, n
from sagline.core.results import Result, Saved
from sagline.kernels import codes
from sagline.kernels.calibration import kinds
from sagline.kinematics.forward import forward
from sagline.kinematics.forward_rows import ForwardSolution
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.statics.tables import pose_rows


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PoseError(Result):
    """Expected errors of the platform at one commanded pose, or at N commanded poses with a leading axis N.

    At a commanded pose, the winches have the lengths that the calibrated robot needs. The errors are computed from the
    covariance of all parameters and the standard deviation of the lengths.

    Attributes:
        pose: The commanded poses.
        covariance: Covariance of the displacement of the platform frame's origin and of its rotation vector, world
            axes, shape (..., 6, 6) [m^2, m rad, rad^2].
        own_covariance: As `covariance`, but without a shift of the robot and a rotation of the robot about the vertical
            that are common to all poses of the log.
    """

    pose: Pose
    covariance: Array
    own_covariance: Array

    def __str__(self) -> str:
        """Text of the errors in one line, as root mean squares over the feasible poses."""
        held = ~np.isnan(self.position)
        world, own, turn = (
            n(float(np.sqrt(np.mean(one[held] ** 2))), ".3g", unit) if held.any() else "–"
            for one, unit in ((self.position, "m"), (self.own_position, "m"), (self.rotation, "rad"))
        )
        poses = counted(int(np.count_nonzero(held)), "pose")
        return f"Expected errors of {poses}: {world} in the world, {own} in its own frame, {turn}"

    @property
    def position(self) -> Array:
        """Expected distance from the commanded position [m], as a root mean square, shape (...)."""
        return _root_of_trace(self.covariance[..., :3, :3])

    @property
    def own_position(self) -> Array:
        """Expected distance [m] according to `own_covariance`, as a root mean square, shape (...)."""
        return _root_of_trace(self.own_covariance[..., :3, :3])

    @property
    def rotation(self) -> Array:
        """Expected angle between actual and commanded rotation [rad], as a root mean square, shape (...)."""
        return _root_of_trace(self.covariance[..., 3:, 3:])


def _root_of_trace(covariance: Array) -> Array:
    return locked(np.asarray(np.sqrt(np.trace(covariance, axis1=-2, axis2=-1))))


MOST = 300  # largest number of poses for the computation of the motion that is common to all poses
_NEGLIGIBLE = 1e-12  # a slope is zero if it is less than this share of the largest slope
# kinds without an effect on poses
_WITHOUT_MOTION = (
    *("measuring_frame", "target", "load_cell_gain", "load_cell_bias"),
    *("clock_offset", "swivel_zero", "inertia"),
)


def _motion_slopes(machine: MachineTerms, poses: Array, lengths: Array) -> tuple[Array, Array]:
    """Derivatives of the pose (origin, rotation vector) [m, rad]: (N, 6, P) by values and (N, 6, m) by lengths."""
    if machine.model.code == codes.STRAIGHT:
        by_values, by_length = slopes_of_poses(machine, machine.winch_slopes(lengths), poses)
        by_values = by_values / machine.slopes
    else:
        by_values, by_length = (slopes[:, lengths.shape[1] :] for slopes in unwhitened_slopes(machine, poses, lengths))
    return np.where(np.isin(machine.parameters.names, _WITHOUT_MOTION), 0.0, by_values), by_length


def _common_motions(poses: Array) -> Array:
    """Derivatives (N, 6, 4) of poses by three shifts of the world and a rotation about the vertical."""
    slopes = np.zeros((len(poses), 6, 4))
    slopes[:, :3, :3] = np.eye(3)
    slopes[:, 0, 3], slopes[:, 1, 3] = -poses[:, 1], poses[:, 0]
    slopes[:, 5, 3] = 1.0
    return slopes


def _transformed_covariance(slopes: Array, covariance: Array, negligible: Array | float = 0.0) -> Array:
    """Covariance (..., k, k) after a linear map `slopes` (..., k, P); infinite where infinite variances have effect."""
    infinite = np.isinf(np.diagonal(covariance, axis1=-2, axis2=-1))
    finite = np.where(infinite[..., :, None] | infinite[..., None, :], 0.0, covariance)
    found = np.asarray(slopes @ finite @ np.swapaxes(slopes, -1, -2))
    depends = ((np.abs(slopes) > negligible) & infinite[..., None, :]).any(axis=-1)
    axes = np.arange(slopes.shape[-2])
    found[..., axes, axes] = np.where(depends, np.inf, found[..., axes, axes])
    return found


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(Findings, Saved):
    """Result of `calibrate`: P parameters, estimated from the readings at N poses.

    Attributes:
        robot: The calibrated robot.
        before: The robot before the calibration.
        sensors: The sensors with the calibrated measuring system.
        length_offset: Offset of reported lengths [m], shape (m,); zero where counts were read.
        status: Status of the calibration.
        parameters: The parameters and their priors.
        values: Values of the parameters, in their units, (P,).
        covariance: Covariance of the values, (P, P); infinite on the diagonal without observations and a prior. It
            includes the effect of the tolerances of parameters that were not estimated.
        chi_squared: Sum of squares of all residuals in standard deviations, priors included.
        degrees_of_freedom: Expected value of `chi_squared`: number of readings and priors minus estimated parameters.
        rows: Indices of the rows of the log that were used, (N,).
        left_out: Indices of the omitted rows of the log, for each reason.
        poses: Poses of the platform, N of them.
        unstrained_length: True lengths of the cables [m], (N, m).
        residuals: Readings minus predictions: lengths [m], load cells [N], position [m], rotation [rad], shape (N, 2 m
            + 6); swivel angles [rad] and natural frequencies [Hz] follow, if they are read. NaN if missing.
        chi_squared_of_pose: Chi squared of each pose, (N,).
        weights: Weights of the poses, (N,); less than 1 for a pose that does not fit the other poses.
        outliers: Readings that do not fit.
        gauge: Unobservable directions; only the priors determine the values along these directions.
        cannot_tell_apart: Weakly identifiable directions.
        criticisms: Parameters that were not estimated, although the readings contradict their values.
        cross_validation: Errors of predictions at poses that a calibration did not use; None without cross-validation.
        iterations: Number of iterations of the least squares.
        model: Cable model.
        log: Origin of the readings.
        date: Date of the calibration, ISO 8601.
    """

    def value_of(self, label: str) -> tuple[float, float]:
        """Value and standard error of a parameter, in its unit.

        Args:
            label: One of `parameters.labels`: "frame_anchors[3].x", "mass".

        Raises:
            InvalidValueError: If the label does not exist.
        """
        k = self.parameters.labels.index(choice(label, "label", self.parameters.labels))
        return float(self.values[k]), float(self.standard_error[k])

    def __str__(self) -> str:
        """Text with verdict, values, standard errors and diagnostics, in lines of at most 80 characters."""
        return summary.calibration_text(self)

    def pose_error(self, pose: PoseLike) -> PoseError:
        """Expected error of the platform at a commanded pose after this calibration.

        The true robot has the lengths that `inverse` computes for the calibrated robot. Errors of the calibration and
        errors of the winches' lengths (`sensors.length_deviation`) displace the platform.

        Args:
            pose: A single pose or N.

        Returns:
            PoseError; NaN for an infeasible pose, infinite for a pose that depends on an unobserved parameter.

        Raises:
            InvalidValueError: If `pose` is not a pose, or is outside the motion pattern of the robot.
        """
        rows, shape = pose_rows(pose := pose_of(pose)), pose.shape
        lengths = np.atleast_2d(inverse(self.robot, pose, model=self.model).unstrained_length)
        whole, own = np.full((2, len(rows), 6, 6), np.nan)
        held = np.isfinite(lengths).all(axis=1)
        if held.any():
            by_values, by_length = self._slopes(rows[held], lengths[held])
            whole[held] = self._covariance(by_values, by_length)
            own[held] = self._covariance(by_values - _common_motions(rows[held]) @ self._common_motion(), by_length)
        return PoseError(pose, locked(whole.reshape(*shape, 6, 6)), locked(own.reshape(*shape, 6, 6)))

    def forward(self, unstrained_length: ArrayLike, start: PoseLike | None = None) -> ForwardSolution:
        """Forward kinematics at reported lengths: pose of the platform, and covariance of the pose.

        Args:
            unstrained_length: Reported lengths [m], shape (m,) or (N, m); they are multiplied by `length_scale`, then
                `length_offset` is added.
            start: Initial pose, as in `forward`.

        Returns:
            ForwardSolution of the calibrated robot, with a `covariance` that includes the errors of the parameters and
            `sensors.length_deviation`; NaN without a solution.

        Raises:
            InvalidValueError: In the cases in which the function `forward` raises this error.
        """
        lengths = numbers(unstrained_length, "unstrained_length", "m")
        if lengths.shape[-1:] == self.length_offset.shape:
            lengths = self.length_scale * lengths + self.length_offset
        found = forward(self.robot, lengths, start, self.model)
        rows, shape = np.atleast_2d(found.state.unstrained_length), found.pose.shape
        there = np.isfinite(rows).all(axis=1) & np.atleast_1d(found.stable)
        covariance = np.full((len(rows), 6, 6), np.nan)
        covariance[there] = self._covariance(*self._slopes(pose_rows(found.pose)[there], rows[there]))
        reach = np.reshape(found.pose.matrix @ self.robot.center_of_mass, (-1, 3))
        of_center = np.tile(np.eye(6), (len(rows), 1, 1))  # motion of the center of mass by motion of the origin
        for axis, unit in enumerate(np.eye(3)):
            of_center[:, :3, 3 + axis] = np.cross(unit, reach)
        covariance = _transformed_covariance(of_center, covariance)
        return replace(found, covariance=locked(covariance.reshape(*shape, 6, 6)))

    @property
    def length_scale(self) -> Array:
        """Scale of reported lengths, shape (m,); 1 where it was not estimated."""
        return self.parameters.of_cables(self.values, kinds.SCALE, 1.0)

    @property
    def swivel_zero(self) -> Array:
        """Readings of swivel angles of cables along x [rad], shape (m,); 0 where they were not estimated."""
        return self.parameters.of_cables(self.values, kinds.SWIVEL, 0.0)

    def _slopes(self, poses: Array, lengths: Array) -> tuple[Array, Array]:
        reported = self.length_offset, self.length_scale
        machine = MachineTerms(self.robot, self.model, self.parameters, Sensors(), *reported)
        return _motion_slopes(machine, poses, lengths)

    def _covariance(self, by_values: Array, by_length: Array) -> Array:
        """Covariance (N, 6, 6) of origin and rotation vector, due to errors of the values and of the winch lengths."""
        size = np.abs(by_values).max(axis=(1, 2), keepdims=True)
        by_length = by_length * self.sensors.length_deviation
        known = _transformed_covariance(by_values, self.covariance, _NEGLIGIBLE * size)
        return np.asarray(known + by_length @ np.swapaxes(by_length, 1, 2))

    def _common_motion(self) -> Array:
        """Derivatives (4, P) of the common shift and vertical rotation of all poses of the log by the values."""
        poses = pose_rows(self.poses)
        part = evenly_spaced(len(poses), MOST)
        by_values = self._slopes(poses[part], np.atleast_2d(self.unstrained_length)[part])[0][:, :3]
        there = ~np.isnan(by_values).any(axis=(1, 2))
        motions = _common_motions(poses[part][there])[:, :3].reshape(-1, 4)
        right = by_values[there].reshape(-1, by_values.shape[-1])
        return np.asarray(np.linalg.lstsq(motions, right, rcond=None)[0])

    def sensor_deviations(self, *, per_cable: bool = False) -> tuple[SensorDeviation, ...]:
        """Standard deviations of the sensors from the residuals, by restricted maximum likelihood (REML).

        If the model is right, the results can be used in `Sensors`. A wrong model increases the results.

        Args:
            per_cable: True for a separate result for each length sensor and each load cell.

        Returns:
            One standard deviation per kind of sensor, or per sensor; empty if lengths are the only readings.
        """
        return findings.sensor_deviations(self, per_cable=flag(per_cable, "per_cable"))

    def table(self) -> str:
        """Text with one line per value: the value, its standard error, its prior and its change."""
        return summary.table(self)

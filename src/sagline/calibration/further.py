"""Readings that the kernel does not know: swivel angles of pulleys; their predictions, derivatives and whitening.

A reading depends on the pose of the platform and on the parameters. The derivatives of the pose follow from the force
balance by the implicit function theorem. The readings are added to the whitened readings of the kernel like the
measurements of a later time in a Kalman filter; see docs/model.md, section 14.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Indices
from sagline.kernels.calibration import kinds
from sagline.robot.robot import Robot


class FurtherReadings(NamedTuple):
    """Readings at N poses."""

    swivels: Array | None  # swivel angles [rad], (N, m), NaN if missing; None for readings that equal the predictions


class FurtherRows(NamedTuple):
    """Residuals and derivatives of E readings at N poses."""

    residual: Array  # readings minus predictions at the given lengths, (N, E); NaN if missing
    slopes: Array  # derivatives by the P internal parameters, at equilibrium, (N, E, P)
    by_length: Array  # derivatives by the true lengths, at equilibrium, (N, E, m)


def swivel_angles(robot: Robot, poses: Array) -> Array:
    """Swivel angles (N, m) [rad] at pose rows: angle of the plane of each cable about its vertical swivel axis.

    The angle of a cable along x is 0. A positive angle is a positive rotation about the swivel axis.
    """
    reach = _reach(robot, poses)[0]
    return np.asarray(swivel_senses(robot) * np.arctan2(reach[..., 1], reach[..., 0]))


def swivel_senses(robot: Robot) -> Array:
    """Signs (m,): 1 for a swivel axis that points up, -1 for an axis that points down."""
    axis = np.array([0.0, 0.0, 1.0]) if robot.winches is None else robot.winches.swivel_axis
    return np.where(np.broadcast_to(axis, (robot.cable_count, 3))[:, 2] < 0.0, -1.0, 1.0)


def _reach(robot: Robot, poses: Array) -> tuple[Array, Array, Array]:
    """Vectors from frame anchors to platform ends, vectors from the origin to the ends (N, m, 3) [m], and rotations."""
    matrix = Rotation.from_quat(poses[:, 3:]).as_matrix()
    levers = robot.platform_anchors @ np.swapaxes(matrix, 1, 2)
    return poses[:, None, :3] + levers - robot.frame_anchors, levers, matrix


def swivel_rows(
    robot: Robot,
    zeros: Array,
    readings: Array | None,
    poses: Array,
    where: Indices,
    scale: Array,
    motion: tuple[Array, Array],
) -> FurtherRows:
    """Residuals and derivatives of swivel angles.

    zeros: `swivel_zero` of the cables (m,) [rad]. where, scale: as in `kernels.calibration.terms.Unknowns`. motion:
    derivatives of origin and rotation vector of the platform by the parameters (N, 6, P) and by the lengths (N, 6, m).
    """
    (reach, levers, matrix), m = _reach(robot, poses), robot.cable_count
    square = reach[..., 0] ** 2 + reach[..., 1] ** 2
    by_end = np.zeros(reach.shape)
    by_end[..., 0], by_end[..., 1] = -reach[..., 1] / square, reach[..., 0] / square
    by_end *= swivel_senses(robot)[:, None]
    by_pose = np.concatenate((by_end, np.cross(levers, by_end)), axis=2)
    slopes, by_length = by_pose @ motion[0], by_pose @ motion[1]
    by_anchor = by_end @ matrix
    for i in range(m):
        direct: list[tuple[int, Array | float]] = [(kinds.SWIVEL, 1.0)]
        direct += [(kinds.FRAME + axis, -by_end[:, i, axis]) for axis in range(3)]
        direct += [(kinds.PLATFORM + axis, by_anchor[:, i, axis]) for axis in range(3)]
        for row, change in direct:
            if where[row, i] >= 0:
                slopes[:, i, where[row, i]] += scale[row, i] * change
    residual = np.zeros(reach.shape[:2])
    if readings is not None:
        residual = wrapped(readings - swivel_angles(robot, poses) - zeros)
    return FurtherRows(residual, slopes, by_length)


def wrapped(angles: Array) -> Array:
    """Angles between -pi and pi [rad] that differ from `angles` by full turns."""
    return np.asarray(np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi)


def circular_mean(angles: Array) -> float:
    """Mean direction of angles [rad]; 0 without a number."""
    known = angles[~np.isnan(angles)]
    return float(np.angle(np.exp(1j * known).sum())) if known.size else 0.0


def whitened_further(
    rows: FurtherRows, deviation: Array, off: Array, variance: Array, before: tuple[Array, Array, Array]
) -> tuple[Array, Array, Array]:
    """Whitened slopes (N, E, P), misfit (N, E) and effect on true lengths (N, m, E) of further readings.

    deviation: standard deviations (E,). off: reported minus true lengths (N, m) [m]; variance: of reported lengths (m,)
    [m^2]. before: whitened slopes, misfit and effect on true lengths of the other readings.
    """
    matrix, misfit, back = before
    read = ~np.isnan(rows.residual) & ~np.isnan(misfit).any(axis=1, keepdims=True)
    by_length = np.where(read[..., None], rows.by_length, 0.0)
    slopes = np.where(read[..., None], rows.slopes, 0.0)
    known = np.where(np.isnan(back), 0.0, back)
    left = np.eye(len(variance)) * variance - known @ np.swapaxes(known, 1, 2)  # covariance of the true lengths
    across = left @ np.swapaxes(by_length, 1, 2)
    covariance = by_length @ across + np.eye(len(deviation)) * np.where(read, deviation**2, 1.0)[:, None]
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    best = np.einsum("nij,nj->ni", known, np.where(np.isnan(misfit), 0.0, misfit))
    missed = np.where(read, rows.residual, 0.0) - np.einsum("nij,nj->ni", by_length, off + best)
    reduced = slopes - by_length @ (known @ np.where(np.isnan(matrix), 0.0, matrix))
    missed = np.where(np.isnan(misfit).any(axis=1, keepdims=True), np.nan, np.einsum("nij,nj->ni", whiten, missed))
    return whiten @ reduced, missed, across @ np.swapaxes(whiten, 1, 2)

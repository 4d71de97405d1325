"""Where the platform is to be expected, by the covariance of a calibration: in arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.plain_slopes import plain_slopes
from sagline.calibration.sensors import Sensors
from sagline.calibration.unknowns import Parameters
from sagline.core.arrays import Array
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows

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
    slopes = plain_slopes(known.robot, known.model, known.parameters, Sensors(), poses, lengths)
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

"""Readings of a robot with straight cables, without a force balance; the pose of each row is fitted and eliminated.

A reported length is the length of the straight cable from the platform end over the pulley to the drum, plus noise.
Rows are projected on the complement of their derivatives with respect to the pose; docs/model.md, section 14.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.calibration.log import measures_yaw, reading_deviations
from sagline.calibration.observations import MachineTerms, Readings, WhitenedRows
from sagline.core.arrays import Array, Flags
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.calibration import kinds
from sagline.robot.robot import Robot

ITERATIONS: Final = 40  # of the fit of a pose; a good start needs three
TOLERANCE: Final = 1e-9  # largest decrease of the sum of squares of a pose that is still to be gained
DAMPING: Final = 1e-4  # first damping after a step that increases the squares, relative to the largest singular value
SEEN: Final = 1e-9  # a motion is observed if its singular value exceeds this share of the largest one
# Largest component normal to its plane of the cables of a planar robot, for which anchors keep their place along the
# normal: this place affects the lengths only in the second order.
IN_PLANE: Final = 0.05


class _Lines(NamedTuple):
    """Straight cables at N poses, and readings that the pose predicts."""

    lengths: Array  # [m], (N, m)
    residual: Array  # readings minus predictions [m, m, rad]: lengths, position, rotation, (N, m + 6); NaN if missing
    by_pose: Array  # derivatives of the predictions by the free motions of the center of mass, (N, m + 6, n)
    along: Array  # unit vectors from the frame ends to the platform ends, (N, m, 3)
    turned: Array  # rotation matrices from platform to world, (N, 3, 3)
    point: Array  # position of the target relative to the measuring system, world axes [m], (N, 3)
    wrap: Array  # wrap angles minus their sines: derivatives of the lengths by the pulley radius, (N, m)


def lines_at(machine: MachineTerms, readings: Readings, poses: Array) -> _Lines:
    """Straight cables and residuals at pose rows (N, POSE_COLUMNS)."""
    robot, sensors, cables = machine.robot, machine.sensors, machine.cables[0]
    count, m = len(poses), robot.cable_count
    rows = np.empty((count, g.GEOMETRY_ROWS, m))
    with np.errstate(all="ignore"):
        g.cable_geometries(machine.cables, machine.body, np.ascontiguousarray(poses), np.empty((3, 3)), rows)
    cosine = rows[:, g.COSINE]
    along = np.stack((rows[:, g.AZIMUTH_X] * cosine, rows[:, g.AZIMUTH_Y] * cosine, rows[:, g.SINE]), axis=-1)
    sine, upward = cosine, cables[:, tables.ENTRY] * rows[:, g.SINE]  # of the wrap angle: sine, cosine
    if cables.shape[1] > tables.CABLE_COLUMNS:
        axes_of_pulleys = cables[:, tables.AXIS_X : tables.AXIS_Z + 1]
        sine, upward = np.linalg.norm(np.cross(along, axes_of_pulleys), axis=2), np.sum(along * axes_of_pulleys, axis=2)
    wrap = np.arctan2(sine, upward)
    lengths = rows[:, g.CHORD] + cables[:, tables.PULLEY_RADIUS] * wrap + cables[:, tables.DEAD_CABLE]
    lever = np.moveaxis(rows[:, g.LEVER_X : g.LEVER_Z + 1], 1, 2)
    platform, axes = Rotation.from_quat(poses[:, 3:]), sensors.frame.matrix
    turned = platform.as_matrix()
    reach = turned @ (sensors.target - robot.center_of_mass)
    point = poses[:, :3] + turned @ sensors.target - sensors.frame.position
    residual = np.full((count, m + 6), np.nan)
    residual[:, :m] = readings.lengths - lengths
    residual[:, m : m + 3] = readings.positions - point @ axes
    there = ~np.isnan(readings.rotations).any(axis=1)
    if there.any():
        seen = sensors.frame.rotation.inv() * platform if measures_yaw(sensors) else platform
        off = Rotation.from_quat(readings.rotations[there]) * seen[there].inv()
        if not measures_yaw(sensors):  # a rotation about the vertical in front of this rotation makes its yaw zero
            _, _, z, w = off.as_quat().T
            off = Rotation.from_rotvec(np.outer(-2.0 * np.arctan2(z, w), (0.0, 0.0, 1.0))) * off
        residual[there, m + 3 :] = off.as_rotvec()
    motion = np.zeros((count, m + 6, 6))
    motion[:, :m, :3], motion[:, :m, 3:] = along, np.cross(lever, along)
    motion[:, m : m + 3, :3] = axes.T
    motion[:, m + 3 :, 3:] = axes.T if measures_yaw(sensors) else np.eye(3)
    motion[:, m : m + 3, 3:] = np.cross(reach[:, None], axes.T)
    return _Lines(lengths, residual, motion @ robot.freedom.T, along, turned, point, wrap - sine)


def _deviations(machine: MachineTerms) -> Array:
    """Standard deviations of lengths, position and rotation (m + 6,), without load cells."""
    m = machine.robot.cable_count
    return np.delete(reading_deviations(machine.sensors, m), slice(m, 2 * m))


def _weights(machine: MachineTerms, lines: _Lines) -> Array:
    """Inverse standard deviations of the readings (N, m + 6); 0 for a missing reading."""
    # Rotations that the platform cannot make are not used.
    m = machine.robot.cable_count
    used = ~np.isnan(lines.residual)
    used[:, m + 3 :] &= lines.by_pose[:, m + 3 :].any(axis=2)
    return np.where(used, 1.0 / _deviations(machine), 0.0)


def rotation_error(machine: MachineTerms, readings: Readings, poses: Array) -> float:
    """Standard error of the rotation at a typical pose, about the axis with the largest error [rad]."""
    free = machine.robot.freedom
    if not (turns := free[:, 3:].any(axis=1)).any():
        return 0.0
    lines = lines_at(machine, readings, poses)
    whole = np.nan_to_num(lines.by_pose) * _weights(machine, lines)[..., None]
    _, sizes, right = np.linalg.svd(whole, full_matrices=False)
    with np.errstate(divide="ignore"):
        part = right[:, :, turns] / sizes[..., None]
    return float(np.median(np.linalg.norm(part, axis=1).max(axis=1)))


class _Fitted(NamedTuple):
    """Readings of N poses in the directions that the pose explains, and in the other directions."""

    lines: _Lines
    left: Array  # orthonormal directions of the whitened readings as columns, (N, m + 6, m + 6); the first n: the pose
    sizes: Array  # singular values of the derivatives by the pose, (N, n); 0 if not observed
    right: Array  # motions as rows, (N, n, n)
    misfit: Array  # whitened readings minus predictions along `left`, (N, m + 6)
    squares: Array  # sums of squares, (N,); infinite if a platform end is inside a pulley

    @property
    def promised(self) -> Array:
        """Predicted decrease (N,) of the sums of squares by the best motions of the platform."""
        return np.asarray(np.sum((self.misfit[:, : self.sizes.shape[1]] * (self.sizes > 0.0)) ** 2, axis=1))

    def motion(self, free: Array, damping: Array) -> Array:
        """Best motions (N, 6) of the center of mass [m, rad]; `damping`: (N,), 0 for the full step."""
        large = damping[:, None] * self.sizes[:, :1] ** 2
        shares = np.divide(self.sizes, self.sizes**2 + large, out=np.zeros_like(self.sizes), where=self.sizes > 0.0)
        along = shares * self.misfit[:, : self.sizes.shape[1]]
        return np.asarray(np.einsum("nk,nkj,ji->ni", along, self.right, free))


def _fitted_at(machine: MachineTerms, readings: Readings, poses: Array) -> _Fitted:
    lines = lines_at(machine, readings, poses)
    weights = _weights(machine, lines)
    whole = np.where(np.isfinite(lines.by_pose), lines.by_pose, 0.0) * weights[..., None]
    left, sizes, right = np.linalg.svd(whole)
    sizes = np.where(sizes > SEEN * sizes[:, :1], sizes, 0.0)
    misfit = np.einsum("nij,ni->nj", left, np.where(weights > 0.0, lines.residual, 0.0) * weights)
    lost = np.isnan(lines.lengths).any(axis=1)
    return _Fitted(lines, left, sizes, right, misfit, np.where(lost, np.inf, np.sum(misfit**2, axis=1)))


def fit_poses(machine: MachineTerms, readings: Readings, poses: Array) -> tuple[Array, Array]:
    """Pose rows with the least squares of all readings, and their lengths (N, m) [m] (Levenberg-Marquardt)."""
    robot, poses = machine.robot, poses.copy()
    best, damping = _fitted_at(machine, readings, poses), np.zeros(len(poses))
    for _ in range(ITERATIONS):
        going = np.isfinite(best.squares) & (best.promised > TOLERANCE)
        if not going.any():
            break
        motion = np.where(going[:, None], best.motion(robot.freedom, damping), 0.0)
        moved = move_poses(robot, robot, poses, motion)
        trial = _fitted_at(machine, readings, moved)
        better = going & (trial.squares < best.squares)
        damping = np.where(better, 0.1 * damping, np.maximum(10.0 * damping, DAMPING))
        poses[better] = moved[better]
        lines = _Lines(*(np.where(_by_row(better, a), a, b) for a, b in zip(trial.lines, best.lines, strict=True)))
        rest = (np.where(_by_row(better, a), a, b) for a, b in zip(trial[1:], best[1:], strict=True))
        best = _Fitted(lines, *rest)
    return poses, best.lines.lengths


def _by_row(flags: Flags, array: Array) -> Flags:
    """Flags (N,) in the shape that broadcasts to `array` (N, ...)."""
    return flags.reshape(-1, *(1,) * (array.ndim - 1))


def _slopes(machine: MachineTerms, lines: _Lines, reported: Array) -> Array:
    """Derivatives (N, m + 6, P) of the residuals by the unknowns, at constant poses."""
    # reported: derivatives of reported lengths (5, N, m) from `winch_slopes`.
    m, where = machine.robot.cable_count, machine.parameters.where
    found = np.zeros((*lines.residual.shape, len(machine.slopes)))
    free = machine.robot.freedom[:, :3]
    in_plane = lines.along @ free.T @ free
    flat = np.abs(lines.along - in_plane).max(initial=0.0) < IN_PLANE
    for row, values in _by_cable(lines, in_plane if flat else lines.along, reported):
        which = np.flatnonzero(where[row] >= 0)
        found[:, which, where[row, which]] += values[:, which]
    axes = machine.sensors.frame.matrix
    for k, unit in enumerate(np.eye(3)):
        place, turn = slice(m, m + 3), slice(m + 3, m + 6)
        for first, part, values in (
            (kinds.SHIFT, place, -axes[k]),
            (kinds.TURN, place, np.cross(lines.point, unit) @ axes),
            (kinds.TURN, turn, -axes[k] * measures_yaw(machine.sensors)),
            (kinds.TARGET, place, lines.turned[..., k] @ axes),
        ):
            if (at := where[first + k, 0]) >= 0:
                found[:, part, at] += values
    return found * machine.slopes


def _by_cable(lines: _Lines, along: Array, reported: Array) -> Iterator[tuple[int, Array]]:
    """Rows of `kinds`, and derivatives (N, m) of lengths minus reported lengths; along: directions of the cables."""
    for k in range(3):
        yield kinds.FRAME + k, -along[..., k]
        yield kinds.PLATFORM + k, np.einsum("nmi,ni->nm", along, lines.turned[..., k])
    for row, slope in zip((kinds.ZERO, kinds.DRUM, kinds.STIFFNESS, kinds.SCALE, kinds.CLOCK), reported, strict=True):
        yield row, -slope
    yield kinds.RADIUS, lines.wrap
    yield kinds.DEAD, np.ones(lines.wrap.shape)


def straight_rows(machine: MachineTerms, readings: Readings, reported: Array, poses: Array) -> WhitenedRows:
    """Whitened rows at the poses; zero along the directions that the pose explains, which are eliminated."""
    # reported: derivatives of reported lengths (5, N, m) from `winch_slopes`. `back` are the directions of the rows,
    # (N, m + 6, m + 6), and `motion` is empty.
    fitted = _fitted_at(machine, readings, poses)
    count, size = fitted.misfit.shape
    m, weights = machine.robot.cable_count, _weights(machine, fitted.lines)
    kept = np.ones((count, size), dtype=np.bool_)
    kept[:, : fitted.sizes.shape[1]] = fitted.sizes == 0.0
    left = fitted.left * kept[:, None]
    slopes = np.where(weights[..., None] > 0.0, _slopes(machine, fitted.lines, reported), 0.0) * weights[..., None]
    residual = np.concatenate((np.full((count, m), np.nan), fitted.lines.residual[:, m:]), axis=1)
    residual[:, m:][weights[:, m:] == 0.0] = np.nan
    lost = np.where(np.isfinite(fitted.squares), 0.0, np.nan)[:, None]
    return WhitenedRows(
        np.swapaxes(left, 1, 2) @ slopes,
        np.where(kept, fitted.misfit, 0.0) + lost,
        residual,
        left,
        np.empty((0, m + 1, 6)),
        m - np.count_nonzero(fitted.sizes, axis=1),
    )


def whitened_errors(
    machine: MachineTerms, reported: Array, poses: Array, residuals: Array
) -> tuple[Array, Array, Array]:
    """Whitened slopes (N, R, P), effects of errors (N, R, 2 m + 6) and misfit (N, R) of the residuals (N, 2 m + 6)."""
    count, m = len(poses), machine.robot.cable_count
    off = np.delete(residuals, slice(m, 2 * m), axis=1)
    there = np.where(np.isnan(off), np.nan, 0.0)  # the slopes depend only on which readings exist
    level = np.fmax.reduce(there[:, m + 3 :], axis=1)[:, None] + np.array([0.0, 0.0, 0.0, 1.0])
    readings = Readings(there[:, :m], np.full((count, m), np.nan), there[:, m : m + 3], level)
    rows = straight_rows(machine, readings, reported, poses)
    noise = np.swapaxes(rows.back, 1, 2) * ~np.isnan(off)[:, None]
    misfit = np.einsum("nij,nj->ni", noise, np.nan_to_num(off / _deviations(machine)))
    cells = np.zeros((count, noise.shape[1], m))
    return rows.matrix, np.concatenate((noise[..., :m], cells, noise[..., m:]), axis=2), misfit


def slopes_of_poses(machine: MachineTerms, reported: Array, poses: Array) -> tuple[Array, Array]:
    """Derivatives of position and rotation by the unknowns (N, 6, P) and by the lengths (N, 6, m) that fit the pose."""
    count, m = len(poses), machine.robot.cable_count
    nothing = Readings(*(np.full((count, width), np.nan) for width in (m, m, 3, 4)))
    lines = lines_at(machine, nothing, poses)
    slopes = _slopes(machine, lines, reported)
    by_length = lines.by_pose[:, m:] @ np.linalg.pinv(lines.by_pose[:, :m])
    return slopes[:, m:] - by_length @ slopes[:, :m], by_length


def move_poses(before: Robot, after: Robot, poses: Array, motion: Array) -> Array:
    """Pose rows after a small motion (N, 6) [m, rad] of the center of mass and a change of the robot's parameters."""
    turned = Rotation.from_quat(poses[:, 3:])
    turning = Rotation.from_rotvec(motion[:, 3:]) * turned
    first, last = (np.array(robot.center_of_mass) for robot in (before, after))  # scipy needs writable arrays
    shift = motion[:, :3] + turned.apply(first) - turning.apply(last)
    free = before.freedom[:, :3]
    return np.hstack((poses[:, :3] + shift @ free.T @ free, turning.as_quat()))

"""Swivel angles of pulleys and natural frequencies, which the kernel does not know: predictions and whitening.

They are added to the whitened readings of the kernel like the measurements of a later time in a Kalman filter; see
docs/model.md, section 14.
"""

from __future__ import annotations

from typing import Final, NamedTuple, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Indices, locked
from sagline.kernels import tables
from sagline.kernels.cable.swivel import DATA
from sagline.kernels.calibration import kinds
from sagline.kernels.forward.forward import forward_poses
from sagline.kernels.forward.platform import ForwardTerms
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward_rows import ForwardRows, new_chain
from sagline.robot.robot import Robot
from sagline.statics.slopes import KernelStates
from sagline.statics.stiffness import natural_frequency
from sagline.statics.tables import body_table

# Residuals and derivatives of E readings at N poses: readings minus predictions at the given lengths, (N, E), NaN if
# missing; derivatives by the P internal parameters (N, E, P) and by the true lengths (N, E, m), at equilibrium.
FurtherRows: TypeAlias = tuple[Array, Array, Array]


def swivel_axes(robot: Robot) -> Array:
    """Unit vectors (m, 3) of the swivel axes, in the directions in which the cables enter the pulleys."""
    axis = np.array([0.0, 0.0, 1.0]) if robot.winches is None else robot.winches.swivel_axis
    return np.broadcast_to(axis, (robot.cable_count, 3))


def _zero_directions(robot: Robot) -> Array:
    """Unit vectors normal to the swivel axes at the angles 0 and 90 degrees, (2, m, 3)."""
    # A cable at angle 0 is on the side of x of its axis; for an axis within 45 degrees of x, it is on the upper side.
    axes = swivel_axes(robot)
    toward = np.where(axes[:, :1] ** 2 > 0.5, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    first = toward - np.sum(toward * axes, axis=1, keepdims=True) * axes
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack((first, np.cross(axes, first)))


def swivel_angles(robot: Robot, poses: Array) -> Array:
    """Swivel angles (N, m) [rad] at pose rows: angle of the half-plane of each swivel axis and platform end."""
    # A positive angle is a positive rotation about the swivel axis. A cable with a vertical axis is in this half-plane;
    # with another axis, the weight of the cable turns the pulley a little.
    return _angles_about(_reach(robot, poses)[0], _zero_directions(robot))


def _angles_about(vectors: Array, zero: Array) -> Array:
    """Angles (N, m) [rad] of vectors (N, m, 3) about the swivel axes."""
    along, across = (np.sum(vectors * direction, axis=2) for direction in zero)
    return np.asarray(np.arctan2(across, along))


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
    paid: Array,
    turned: Array | None,
) -> FurtherRows:
    """Residuals and derivatives of swivel angles."""
    # zeros: `swivel_zero` of the cables (m,) [rad]. where, scale: as in `kernels.calibration.terms.Unknowns`. motion:
    # derivatives of origin and rotation vector of the platform by the parameters (N, 6, P) and by the lengths (N, 6,
    # m). paid: derivatives of the lengths by the parameters (N, m, P). turned: result of `swivel_readings`, None if all
    # axes are vertical.
    (reach, levers, matrix), m, zero = _reach(robot, poses), robot.cable_count, _zero_directions(robot)
    if turned is None:
        along, across = (np.sum(reach * direction, axis=2)[..., None] for direction in zero)
        by_end = (along * zero[1] - across * zero[0]) / (along**2 + across**2)
        by_data = np.zeros((*along.shape[:2], DATA))
    else:
        reach, by_end, by_data = turned[..., :3], turned[..., 3:6], turned[..., 6:]
    by_pose = np.concatenate((by_end, np.cross(levers, by_end)), axis=2)
    slopes, by_length = by_pose @ motion[0], by_pose @ motion[1]
    if turned is not None:
        slopes += by_data[..., :1] * paid
        by_length += by_data[..., :1] * np.eye(m)
    by_anchor = by_end @ matrix
    for i in range(m):
        direct: list[tuple[int, Array | float]] = [(kinds.SWIVEL, 1.0)]
        direct += [(kinds.FRAME + axis, -by_end[:, i, axis]) for axis in range(3)]
        direct += [(kinds.PLATFORM + axis, by_anchor[:, i, axis]) for axis in range(3)]
        direct += [(kinds.DENSITY + k, by_data[:, i, 1 + k]) for k in range(DATA - 1)]
        for row, change in direct:
            if where[row, i] >= 0:
                slopes[:, i, where[row, i]] += scale[row, i] * change
    residual = np.zeros(reach.shape[:2])
    if readings is not None:
        off = readings - _angles_about(reach, zero) - zeros
        residual = np.remainder(off + np.pi, 2.0 * np.pi) - np.pi  # between -pi and pi
    return residual, slopes, by_length


LENGTH_STEP: Final = 1e-6  # step of the true lengths for difference quotients of frequencies [m]
_CABLE_COLUMNS: Final = (  # first row of `kinds`, column of the cable_table, number of components
    (kinds.FRAME, tables.FRAME_X, 3),
    (kinds.PLATFORM, tables.PLATFORM_X, 3),
    (kinds.DENSITY, tables.DENSITY, 1),
    (kinds.STIFFNESS, tables.STIFFNESS, 1),
    (kinds.RADIUS, tables.PULLEY_RADIUS, 1),
    (kinds.DEAD, tables.DEAD_CABLE, 1),
)
_BODY_COLUMNS: Final = ((kinds.MASS, tables.MASS, 1), (kinds.CENTER, tables.CENTER_X, 3))


class _PlatformArrays(NamedTuple):
    """Robots and states of B samples, for the computation of natural frequencies."""

    cables: Array  # cable_table, (B, m, CABLE_COLUMNS)
    bodies: Array  # body_table, (B, BODY_COLUMNS)
    inertia: Array  # about the center of mass, platform frame [kg m^2], (B, 3, 3)
    poses: Array  # pose rows, (B, POSE_COLUMNS)
    lengths: Array  # true lengths [m], (B, m)


def _natural_frequencies(terms: ForwardTerms, freedom: Array, at: _PlatformArrays) -> Array:
    """Natural frequencies (B, n) [Hz] of platforms on massless cables, ascending; NaN for an unstable motion."""
    (count, m), size = at.lengths.shape, tables.RESULT_ROWS if terms[-1] else tables.BARE_ROWS
    size = tables.SWIVEL_ROWS if at.cables.shape[2] > tables.CABLE_COLUMNS else size
    robots, memory = (freedom, locked(at.bodies), locked(at.cables)), memory_for(m)
    found = ForwardRows(
        np.empty((count, tables.POSE_COLUMNS)),
        np.empty((size, count, m)),
        np.empty((count, m), dtype=np.int8),
        np.empty((count, tables.FORWARD_NUMBERS)),
        np.empty(count, dtype=np.int8),
    )
    given = (*robots, locked(at.lengths), locked(at.poses), locked(np.zeros((1, 6))))
    forward_poses(terms, False, given, new_chain(m, len(freedom)), memory, found.arrays)
    matrix = KernelStates.of_rows(terms, robots, locked(found.poses), found.results).describe().found[0]
    matrix = np.where(found.stable[:, None, None], matrix, np.nan)
    turn, mass = Rotation.from_quat(found.poses[:, 3:]).as_matrix(), np.zeros((count, 6, 6))
    mass[:, :3, :3] = at.bodies[:, tables.MASS, None, None] * np.eye(3)
    mass[:, 3:, 3:] = turn @ at.inertia @ np.swapaxes(turn, 1, 2)
    inverse = np.linalg.inv(np.linalg.cholesky(freedom @ mass @ freedom.T))
    scaled = inverse @ (freedom @ (0.5 * (matrix + np.swapaxes(matrix, 1, 2))) @ freedom.T) @ np.swapaxes(inverse, 1, 2)
    lost = np.asarray(np.isnan(scaled).any(axis=(1, 2), keepdims=True))
    return np.where(lost[..., 0], np.nan, natural_frequency(np.linalg.eigvalsh(np.where(lost, 0.0, scaled))))


def frequency_rows(
    robot: Robot,
    terms: ForwardTerms,
    cables: Array,
    readings: Array,
    poses: Array,
    lengths: Array,
    where: Indices,
    scale: Array,
    paid: Array,
    steps: Array,
) -> FurtherRows:
    """Residuals and derivatives of the K lowest natural frequencies, matched with the readings by their order."""
    # The derivatives are central differences between equilibria. paid: derivatives of the lengths by the parameters (N,
    # m, P). steps: of the P parameters. cables: cable_table. Other arguments: as in `swivel_rows`.
    (count, modes), m, width = readings.shape, lengths.shape[1], paid.shape[2]
    rows = np.flatnonzero(~np.isnan(readings).all(axis=1) & np.isfinite(lengths).all(axis=1))
    residual, by_values = np.full((count, modes), np.nan), np.zeros((count, modes, width))
    by_length = np.zeros((count, modes, m))
    if not rows.size:
        return residual, by_values, by_length
    sizes = np.concatenate((steps, np.full(m, LENGTH_STEP)))
    longer = np.concatenate((paid, np.broadcast_to(np.eye(m), (count, m, m))), axis=2)[rows] * sizes
    samples = len(rows) * (1 + 2 * len(sizes))
    longer = np.concatenate((np.zeros((len(rows), m, 1)), longer, -longer), axis=2).transpose(2, 0, 1).reshape(-1, m)
    at = _PlatformArrays(
        np.tile(cables, (samples, 1, 1)),
        np.tile(body_table(robot), (samples, 1)),
        np.tile(robot.inertia, (samples, 1, 1)),
        np.tile(poses[rows], (1 + 2 * len(sizes), 1)),
        np.tile(lengths[rows], (1 + 2 * len(sizes), 1)) + longer,
    )
    _change_data(robot, at, where, scale, steps, len(rows), len(sizes))
    values = _natural_frequencies(terms, robot.freedom, at)[:, :modes].reshape(1 + 2 * len(sizes), len(rows), modes)
    slopes = (values[1 : 1 + len(sizes)] - values[1 + len(sizes) :]) / (2.0 * sizes[:, None, None])
    residual[rows] = readings[rows] - values[0]
    by_values[rows] = slopes[:width].transpose(1, 2, 0)
    by_length[rows] = slopes[width:].transpose(1, 2, 0)
    return residual, by_values, by_length


def _second_moments(inertia: Array) -> Array:
    """Second moments of the mass (3, 3) [kg m^2] from the inertia (3, 3), both about the center of mass."""
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def with_inertia(robot: Robot, change: Array) -> Robot:
    """Robot with changed inertia. change: logarithms of factors of the second moments of the mass, (3,)."""
    factors = np.exp(0.5 * change)
    second = factors[:, None] * _second_moments(robot.inertia) * factors
    return robot.replace(inertia=np.trace(second) * np.eye(3) - second)


def _change_data(
    robot: Robot, at: _PlatformArrays, where: Indices, scale: Array, steps: Array, rows: int, count: int
) -> None:
    """Change the data of the samples, which are `rows` without a change, then with positive and negative steps."""
    for table, columns in ((at.cables, _CABLE_COLUMNS), (at.bodies[:, None], _BODY_COLUMNS)):
        for first, column, components in columns:
            for axis in range(components):
                for i in range(table.shape[1]):
                    q = int(where[first + axis, i])
                    for sign, begin in ((1.0, 1), (-1.0, 1 + count)) if q >= 0 else ():
                        part = slice((begin + q) * rows, (begin + q + 1) * rows)
                        table[part, i, column + axis] += sign * steps[q] * scale[first + axis, i]
    moments = _second_moments(robot.inertia)
    for axis in range(3):
        q = int(where[kinds.INERTIA + axis, 0])
        half = np.zeros((3, 3))
        half[axis] = 0.5 * steps[q] * scale[kinds.INERTIA + axis, 0] * moments[axis]
        change = np.trace(half + half.T) * np.eye(3) - (half + half.T)
        for sign, begin in ((1.0, 1), (-1.0, 1 + count)) if q >= 0 else ():
            at.inertia[(begin + q) * rows : (begin + q + 1) * rows] += sign * change


def circular_mean(angles: Array) -> float:
    """Mean direction of angles [rad]; 0 without a number."""
    known = angles[~np.isnan(angles)]
    return float(np.angle(np.exp(1j * known).sum())) if known.size else 0.0


def whitened_further(
    rows: FurtherRows, deviation: Array, off: Array, variance: Array, before: tuple[Array, Array, Array]
) -> tuple[Array, Array, Array]:
    """Whitened slopes (N, E, P), misfit (N, E) and effect on true lengths (N, m, E) of further readings."""
    # deviation: standard deviations (E,). off: reported minus true lengths (N, m) [m]; variance: of reported lengths
    # (m,) [m^2]. before: whitened slopes, misfit and effect on true lengths of the other readings.
    (residual, slopes, by_length), (matrix, misfit, back) = rows, before
    read = ~np.isnan(residual) & ~np.isnan(misfit).any(axis=1, keepdims=True)
    by_length = np.where(read[..., None], by_length, 0.0)
    slopes = np.where(read[..., None], slopes, 0.0)
    known = np.where(np.isnan(back), 0.0, back)
    left = np.eye(len(variance)) * variance - known @ np.swapaxes(known, 1, 2)  # covariance of the true lengths
    across = left @ np.swapaxes(by_length, 1, 2)
    covariance = by_length @ across + np.eye(len(deviation)) * np.where(read, deviation**2, 1.0)[:, None]
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    best = np.einsum("nij,nj->ni", known, np.where(np.isnan(misfit), 0.0, misfit))
    missed = np.where(read, residual, 0.0) - np.einsum("nij,nj->ni", by_length, off + best)
    reduced = slopes - by_length @ (known @ np.where(np.isnan(matrix), 0.0, matrix))
    missed = np.where(np.isnan(misfit).any(axis=1, keepdims=True), np.nan, np.einsum("nij,nj->ni", whiten, missed))
    return whiten @ reduced, missed, across @ np.swapaxes(whiten, 1, 2)

"""Structure matrix, inertial wrench and the article's force balance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import instance
from sagline.core.arrays import Array, checked, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import structure_matrices
from sagline.kernels.cable import geometry as rows
from sagline.robot.batch import Robots, first_of, one_a_pose, robot_fields
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.robot import Robot
from sagline.statics.tables import chord_geometry, refuse_missing_chords


def inertial_wrench(robot: Robot | Sequence[Robot], pose: PoseLike, twist: ArrayLike, twist_rate: ArrayLike) -> Array:
    """Inertial (d'Alembert) wrench that a motion causes on the platform.

    Args:
        robot: Robot with mass, center of mass and inertia; or a sequence of N robots, one per pose.
        pose: A batch of N poses.
        twist: Velocity of the platform origin [m/s] and angular velocity [rad/s], world axes, shape (N, 6).
        twist_rate: Time derivatives of the twist [m/s^2, rad/s^2], shape (N, 6).

    Returns:
        Force -M p_c'' [N] and moment -(Gamma w' + w x Gamma w) [N m] about the center of mass, shape (N, 6).

    Raises:
        InvalidValueError: If `robot` is a sequence with another length than N, or with robots that cannot be in one
            batch; if the numbers of poses, twists and twist rates differ.

    Examples:
        >>> import sagline as sl
        >>> robot, path = sl.load_robot("cogiro"), sl.article_path()
        >>> sl.inertial_wrench(robot, path.pose, path.twist, path.twist_rate).shape
        (6001, 6)

    Source:
        Newton and Euler; docs/model.md, section 4. The equations use the angular velocity, not Euler-angle rates.
    """
    pose = pose_of(pose)
    if not pose.shape:
        raise InvalidValueError("pose", "a single pose", "a batch of N poses", "Take Pose(position[None], rotation).")
    mass, center, own = robot_fields(one_a_pose(robot, len(pose)), "mass", "center_of_mass", "inertia")
    twist = exactly(twist, "twist", "m/s or rad/s", (len(pose), 6))
    twist_rate = exactly(twist_rate, "twist_rate", "m/s^2 or rad/s^2", (len(pose), 6))
    spin, spin_rate = twist[:, 3:], twist_rate[:, 3:]
    wrench = np.empty((len(twist), 6))
    wrench[:, :3] = twist_rate[:, :3]
    wrench[:, 3:] = 0.0
    if np.any(spin) or np.any(spin_rate):
        rotation = pose.matrix
        lever = (rotation @ center[..., None])[..., 0]
        wrench[:, :3] += np.cross(spin_rate, lever) + np.cross(spin, np.cross(spin, lever))
        inertia = rotation @ own @ np.swapaxes(rotation, 1, 2)
        momentum = np.einsum("nij,nj->ni", inertia, spin)
        wrench[:, 3:] = -np.einsum("nij,nj->ni", inertia, spin_rate) - np.cross(spin, momentum)
    wrench[:, :3] *= -mass[..., None]
    return locked(wrench)


def external_wrench(wrench: ArrayLike | None, count: int | None) -> Array:
    """Checked external wrench, (6,) or (N, 6) [N, N m]; None becomes zeros."""
    if wrench is None:
        return locked(np.zeros(6))
    array = checked(wrench, "wrench", "N or N m", shape=(6,))
    if array.ndim == 1 or array.shape == (count, 6):
        return array
    allowed = "shape (6,)" if count is None else f"shape (6,) or ({count}, 6)"
    raise InvalidValueError("wrench", f"of shape {array.shape}", allowed, "Give one wrench, or one wrench per pose.")


class ArticleBalance(NamedTuple):
    """Linear system H t_x + b = [F; tau] of the article, with force F and moment tau about the center of mass.

    Attributes:
        h: Matrix H of equation (50), shape (..., 6, m).
        b: Vector b of equation (51), in which the platform's weight is included once, shape (..., 6).
    """

    h: Array
    b: Array


def _geometry(robot: Robots, pose: Pose) -> Array:
    """Chord geometry of every pose, shape (N, GEOMETRY_ROWS, m); raises an error if a cable has no chord."""
    geometry = chord_geometry(robot, pose)
    refuse_missing_chords(robot, pose, geometry)
    return geometry


def structure_matrix(robot: Robot | Sequence[Robot], pose: PoseLike) -> Array:
    """Structure matrix J. A column is the wrench of a unit chord tension about the center of mass, in world axes.

    Args:
        robot: The robot; or a sequence of N robots, one per pose, as in `inverse`.
        pose: One pose or a batch of N.

    Returns:
        Matrix of shape (n, m) or (N, n, m). Column i has the components of (u_i; r_i x u_i) along the free motions.

    Raises:
        InvalidValueError: If `robot` is a sequence with another length than N, or with robots that cannot be in one
            batch.
        CableGeometryError: If both ends of a cable coincide, or its platform end is inside its pulley. The message
            names pose and cable.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> sl.structure_matrix(robot, pose).shape
        (6, 8)

    Source:
        docs/model.md, section 1.
    """
    pose = pose_of(pose)
    shape = pose.shape
    checked = one_a_pose(robot, shape[0] if shape else None)
    shared = first_of(checked)
    geometry = _geometry(checked, pose)
    out = np.empty((len(geometry), 6, shared.cable_count))
    structure_matrices(geometry, out)
    return locked((shared.freedom @ out).reshape(*shape, shared.degrees_of_freedom, shared.cable_count))


def article_balance(robot: Robot, pose: PoseLike, k_h: float = 4.845) -> ArticleBalance:
    """Matrix H and vector b of the article's force balance, in which the unknowns are horizontal tensions t_x.

    The levers of the article are b_i = B_i - P, measured from the center of mass. The sign of b_pi is corrected
    (erratum 1), and gravity is counted once (erratum 2). H and b are infinite directly under an anchor (erratum 8).
    Compare with `structure_matrix`.

    Args:
        robot: The robot.
        pose: One pose or a batch of N.
        k_h: Intercept constant of equation (28) [m/s^2].

    Returns:
        ArticleBalance with H of shape (6, m) or (N, 6, m), and b of shape (6,) or (N, 6).

    Raises:
        InvalidValueError: If `robot` or `pose` has a wrong type, or `k_h` is not a number.
        CableGeometryError: If both ends of a cable coincide, or its platform end is inside its pulley. The message
            names pose and cable.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 1.5), 0.0, 0.0, 0.0)
        >>> [each.shape for each in sl.article_balance(robot, pose)]
        [(6, 8), (6,)]

    Source:
        Gia Luan & Truong Thinh 2020, equations (26), (27), (50), (51).
    """
    instance(robot, Robot, "robot")
    k_h = number(k_h, "k_h", "m/s^2")
    pose = pose_of(pose)
    geometry = np.moveaxis(_geometry(robot, pose), 1, 0)
    cosine, sine = geometry[rows.AZIMUTH_X], geometry[rows.AZIMUTH_Y]
    bx, by, bz = geometry[rows.LEVER_X], geometry[rows.LEVER_Y], geometry[rows.LEVER_Z]
    pull = k_h * robot.cables.linear_density * geometry[rows.CHORD]
    with np.errstate(divide="ignore", invalid="ignore"):  # 0 lever * infinite slope = NaN
        slope = geometry[rows.RISE] / geometry[rows.SPAN]
        h = -np.stack(
            (cosine, sine, slope, by * slope - bz * sine, bz * cosine - bx * slope, bx * sine - by * cosine), axis=-2
        )
    zero = np.zeros(len(pull))
    weight = robot.mass * robot.gravity
    b = -np.stack((zero, zero, pull.sum(-1) + weight, (by * pull).sum(-1), -(bx * pull).sum(-1), zero), axis=-1)
    return ArticleBalance(locked(h.reshape(*pose.shape, 6, robot.cable_count)), locked(b.reshape(*pose.shape, 6)))

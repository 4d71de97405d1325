"""The balance of the platform as matrices: ours in chord tensions, and the article's in horizontal ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked, number
from sagline.kernels.balance.wrench import structure_matrices
from sagline.kernels.cable import geometry as rows
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.several import Robots, first_of, one_a_pose
from sagline.statics.chords import chord_geometry, refuse_missing_chords


class ArticleBalance(NamedTuple):
    """The article's system H t_x + b = [F; tau], force and moment about the center of mass without gravity.

    Attributes:
        h: The matrix H of (50), shape (..., 6, m).
        b: The vector b of (51), the platform's weight included once, shape (..., 6).
    """

    h: Array
    b: Array


def _geometry(robot: Robots, pose: Pose) -> Array:
    """Geometry rows of every pose, shape (N, GEOMETRY_ROWS, m); refused where a cable has no chord."""
    geometry = chord_geometry(robot, pose)
    refuse_missing_chords(robot, pose, geometry)
    return geometry


def structure_matrix(robot: Robot | Sequence[Robot], pose: Pose) -> Array:
    """J: the wrench of unit chord tensions, about the center of mass, in world axes.

    Args:
        robot: The robot; or a sequence of N that fit together (see `inverse`), one a pose.
        pose: One pose or a batch of N.

    Returns:
        Columns (u_i; r_i x u_i) along the platform's free motions, shape (n, m) or (N, n, m).

    Raises:
        InvalidValueError: If several robots are not one a pose, or do not fit together.
        CableGeometryError: If both ends of a cable coincide, or one is inside its pulley; the message names pose and
            cable.

    Source:
        docs/model.md, section 1.
    """
    shape = instance(pose, Pose, "pose").shape
    checked = one_a_pose(robot, shape[0] if shape else None)
    shared = first_of(checked)
    geometry = _geometry(checked, pose)
    out = np.empty((len(geometry), 6, shared.cable_count))
    structure_matrices(geometry, out)
    return locked((shared.freedom @ out).reshape(*shape, shared.degrees_of_freedom, shared.cable_count))


def article_balance(robot: Robot, pose: Pose, k_h: float = 4.845) -> ArticleBalance:
    """The article's own H and b, in the horizontal tensions t_x, for comparison.

    Written from its equations with the levers b_i = B_i - P from the center of mass and the sign of b_pi
    corrected (erratum 1) and gravity counted once (erratum 2); infinite under an anchor (erratum 8).

    Args:
        robot: The robot.
        pose: One pose or a batch of N.
        k_h: The intercept constant of (28).

    Returns:
        H of shape (6, m) or (N, 6, m), b of shape (6,) or (N, 6).

    Raises:
        InvalidValueError: If robot or pose are none, or k_h is no number.
        CableGeometryError: If both ends of a cable coincide, or one is inside its pulley; the message names pose and
            cable.

    Source:
        Gia Luan & Truong Thinh 2020, equations (26), (27), (50), (51).
    """
    instance(robot, Robot, "robot")
    k_h = number(k_h, "k_h", "m/s^2")
    geometry = np.moveaxis(_geometry(robot, instance(pose, Pose, "pose")), 1, 0)
    cosine, sine = geometry[rows.AZIMUTH_X], geometry[rows.AZIMUTH_Y]
    bx, by, bz = geometry[rows.LEVER_X], geometry[rows.LEVER_Y], geometry[rows.LEVER_Z]
    pull = k_h * robot.cables.linear_density * geometry[rows.CHORD]
    with np.errstate(divide="ignore", invalid="ignore"):  # infinite, times a lever of zero
        slope = geometry[rows.RISE] / geometry[rows.SPAN]
        h = -np.stack(
            (cosine, sine, slope, by * slope - bz * sine, bz * cosine - bx * slope, bx * sine - by * cosine), axis=-2
        )
    zero = np.zeros(len(pull))
    weight = robot.mass * robot.gravity
    b = -np.stack((zero, zero, pull.sum(-1) + weight, (by * pull).sum(-1), -(bx * pull).sum(-1), zero), axis=-1)
    return ArticleBalance(locked(h.reshape(*pose.shape, 6, robot.cable_count)), locked(b.reshape(*pose.shape, 6)))

"""Robots and their poses in the form in which kernels take them."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.robot.batch import Robots, first_of, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


def cable_table(robot: Robots) -> Array:
    """Anchors, material and limits of the cables, columns as in kernels.tables.

    Returns (1 or N, m, CABLE_COLUMNS).
    """
    robots = (robot,) if isinstance(robot, Robot) else robot
    return locked(np.array([_cable_rows(one) for one in robots]))


def body_table(robot: Robots) -> Array:
    """Mass, gravity and center of mass of the platform, columns as in kernels.tables.

    Returns (1 or N, BODY_COLUMNS).
    """
    robots = (robot,) if isinstance(robot, Robot) else robot
    return locked(np.array([[one.mass, one.gravity, *one.center_of_mass] for one in robots]))


def pose_rows(pose: Pose) -> Array:
    """Positions and quaternions of a pose or a batch.

    Returns (N, POSE_COLUMNS).
    """
    rows = np.concatenate((np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion)), axis=1)
    return locked(rows)


def robot_terms(robot: Robots) -> tuple[Array, Array, Array]:
    """A robot, or several, as kernels take it.

    Returns (n, 6).
    """
    return first_of(robot).freedom, body_table(robot), cable_table(robot)


def _cable_rows(robot: Robot) -> Array:
    """One robot's rows of `cable_table`, (m, CABLE_COLUMNS)."""
    columns = (
        robot.frame_anchors,
        robot.platform_anchors,
        robot.cables.linear_density[:, None],
        robot.cables.axial_stiffness[:, None],
        robot.tension_min[:, None],
        robot.tension_max[:, None],
        _behind(robot),
    )
    return np.hstack(columns)


def _behind(robot: Robot) -> Array:
    """Data behind the frame anchors: pulley radius, entry, dead cable and its rise, (m, 4)."""
    none = np.zeros(robot.cable_count)
    run = (none, none) if robot.winches is None else (robot.winches.dead_cable, robot.winches.dead_rise)
    return np.stack((*pulleys_of(robot), *run), axis=1)

"""A robot and its poses in the form in which kernels take them."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array, locked
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


def cable_table(robot: Robot) -> Array:
    """Anchors, material and limits of the cables.

    Args:
        robot: The robot.

    Returns:
        Shape (1, m, CABLE_COLUMNS); columns as in kernels.tables.
    """
    columns = (
        robot.frame_anchors,
        robot.platform_anchors,
        robot.cables.linear_density[:, None],
        robot.cables.axial_stiffness[:, None],
        robot.tension_min[:, None],
        robot.tension_max[:, None],
    )
    return locked(np.hstack(columns)[None])


def body_table(robot: Robot) -> Array:
    """Mass, gravity and center of mass of the platform.

    Args:
        robot: The robot.

    Returns:
        Shape (1, BODY_COLUMNS); columns as in kernels.tables.
    """
    return locked(np.array([[robot.mass, robot.gravity, *robot.center_of_mass]]))


def pose_rows(pose: Pose) -> Array:
    """Positions and quaternions of a pose or a batch.

    Args:
        pose: One pose or a batch of N.

    Returns:
        Shape (N, POSE_COLUMNS); N = 1 for a single pose.
    """
    rows = np.concatenate((np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion)), axis=1)
    return locked(rows)


def robot_terms(robot: Robot) -> tuple[Array, Array, Array]:
    """Free motions (n, 6), body_table and cable_table, as kernels take a robot."""
    return robot.freedom, body_table(robot), cable_table(robot)

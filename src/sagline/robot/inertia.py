"""Inertia of simple bodies, and copies of a robot with another mass or with fewer cables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arguments import instance, whole_number
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.robot.robot import Robot


def box_inertia(mass: float, x: float, y: float, z: float) -> Array:
    """Inertia of a solid box whose edges are along the platform axes.

    mass: mass [kg]; x, y, z: edges along the axes [m]. Returns the inertia about the center of mass [kg m^2], shape (3,
    3).
    """
    return np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * (mass / 12.0)


def cylinder_inertia(mass: float, radius: float, height: float) -> Array:
    """Inertia of a solid cylinder whose axis is along the z axis of the platform.

    mass: mass [kg]; radius: radius [m]; height: height [m]. Returns the inertia about the center of mass [kg m^2],
    shape (3, 3).
    """
    across = (3.0 * radius * radius + height * height) / 12.0
    return np.diag([across, across, 0.5 * radius * radius]) * mass


def with_mass(robot: Robot, mass: float) -> Robot:
    """Copy of a robot with another mass; the inertia is scaled in proportion.

    mass: mass of the platform with its payload [kg], > 0.
    """
    return robot.replace(mass=mass, inertia=robot.inertia * (mass / robot.mass))


def without_cables(robot: Robot, *cables: int) -> Robot:
    """Robot after the failure of some cables. The weight of these cables on the platform is also removed.

    Args:
        robot: The robot before the failure.
        cables: Indices of the broken cables, 0 to m - 1.

    Returns:
        A robot with the remaining cables, in their order; all other data are unchanged.

    Raises:
        InvalidValueError: If an index is out of range, or no cable remains.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> sl.without_cables(robot, 3).cable_count
        7
    """
    kept = np.ones(instance(robot, Robot, "robot").cable_count, dtype=bool)
    for cable in cables:
        kept[whole_number(cable, "cable", 0, robot.cable_count - 1)] = False
    if not kept.any():
        raise InvalidValueError("cables", "all cables of the robot", "fewer", "Keep at least one cable.")
    return robot.replace(
        frame_anchors=robot.frame_anchors[kept],
        platform_anchors=robot.platform_anchors[kept],
        cables=robot.cables._part(kept, kept.shape),
        winches=None if robot.winches is None else robot.winches._part(kept),
        tension_min=robot.tension_min[kept],
        tension_max=robot.tension_max[kept],
    )

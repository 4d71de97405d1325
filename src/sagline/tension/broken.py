"""A robot some of whose cables are broken, or left out on purpose."""

from __future__ import annotations

import numpy as np

from sagline.core.arguments import instance, whole_number
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot


def without_cables(robot: Robot, *cables: int) -> Robot:
    """The robot that is left when cables break: what they weighed on the platform is left out too.

    Args:
        robot: The whole robot.
        cables: Indices of the broken cables, 0 to m - 1.

    Returns:
        A robot with the other cables, in their order; everything else unchanged.

    Raises:
        InvalidValueError: If an index names no cable, or no cable is left.

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
        raise InvalidValueError("cables", "all that the robot has", "fewer", "Leave one cable at least.")
    return robot.replace(
        frame_anchors=robot.frame_anchors[kept],
        platform_anchors=robot.platform_anchors[kept],
        cables=robot.cables._part(kept, kept.shape),
        winches=None if robot.winches is None else robot.winches._part(kept),
        tension_min=robot.tension_min[kept],
        tension_max=robot.tension_max[kept],
    )

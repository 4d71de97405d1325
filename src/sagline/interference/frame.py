"""The beams of a robot's frame, as obstacles."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import number
from sagline.interference.obstacles import Capsule
from sagline.robot.bounds import bounds
from sagline.robot.robot import Robot


def frame_beams(robot: Robot, radius: float) -> tuple[Capsule, ...]:
    """The twelve edges of a robot's frame as beams with round ends.

    The frame is as it is drawn: the robot's frame_size below its highest anchors, or what its anchors span down to the
    floor. Frame anchors are on it or near it: measure cables from some way on, `from_anchor` of `clearance`.

    Args:
        robot: The robot.
        radius: Half the beams' thickness [m], >= 0.

    Returns:
        Twelve capsules, named by where they are.

    Raises:
        InvalidValueError: If radius is negative.

    Examples:
        >>> import sagline as sl
        >>> beams = sl.frame_beams(sl.load_robot("cogiro"), radius=0.05)
        >>> len(beams), beams[0].name
        (12, 'beam along z at low x, low y')
    """
    low, high = bounds(instance(robot, Robot, "robot"))
    thick = number(radius, "radius", "m", low=0.0)
    corners = np.array(list(product((0, 1), repeat=3)))
    beams = []
    for one, other in combinations(corners, 2):
        changing = np.flatnonzero(one != other)
        if len(changing) != 1:
            continue
        axis = int(changing[0])
        where = ", ".join(f"{('low', 'high')[one[k]]} {'xyz'[k]}" for k in range(3) if k != axis)
        start, end = (low + corner * (high - low) for corner in (one, other))
        beams.append(Capsule(start, end, thick, f"beam along {'xyz'[axis]} at {where}"))
    return tuple(beams)

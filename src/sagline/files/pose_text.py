"""Poses as people write them on a command line: three or six numbers between commas."""

from __future__ import annotations

import numpy as np

from sagline.errors import InvalidValueError
from sagline.files.quantity import plain_number, within_reach
from sagline.robot.pose import Pose


def parse_pose(text: str, item: str = "--pose") -> Pose:
    """A pose from X,Y,Z in meters, or X,Y,Z,A,B,C with the angles about z, y and x in degrees.

    Args:
        text: The numbers, between commas.
        item: The name a message uses.

    Returns:
        The pose.

    Raises:
        InvalidValueError: If these are not three or six plain numbers within reach.

    Examples:
        >>> from sagline.files.pose_text import parse_pose
        >>> print(parse_pose("1, 0, 1.5").position, parse_pose("1,0,1.5,90,0,0").quaternion.round(3))
        [1.  0.  1.5] [0.    0.    0.707 0.707]
    """
    numbers = [plain_number(part) for part in text.split(",", maxsplit=6)]
    sound = [number for number in numbers if number is not None and within_reach(number)]
    if len(sound) != len(numbers) or len(sound) not in (3, 6):
        step = f"Give meters, and degrees about z, y and x: {item} 1,0,1.5 or {item} 1,0,1.5,10,0,0."
        raise InvalidValueError(item, repr(text), "three or six numbers", step)
    return Pose.from_euler(sound[:3], *np.radians(sound[3:] or (0.0, 0.0, 0.0)))

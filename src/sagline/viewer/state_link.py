"""What is shown as a text that brings another page to the same: robot=cogiro:1a2b3c4d&pose=1,0,2&drawn-sag=3."""

from __future__ import annotations

from typing import Final
from urllib.parse import parse_qsl, quote, urlencode
from zlib import crc32

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.files.robot_file import dump_robot
from sagline.files.typed import numbers
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

LONGEST: Final = 4000  # characters
STEP: Final = "Copy the link anew."
_SAFE: Final = ",:.+"  # need no escape after the number sign


def link_text(parts: dict[str, str]) -> str:
    """Parts of a state as a text."""
    return urlencode(parts, safe=_SAFE, quote_via=quote)


def parts_of(text: str) -> dict[str, str]:
    """The parts of such a text.

    Raises:
        InvalidValueError: If it is none, or tells something twice.
    """
    try:
        pairs = parse_qsl(text, keep_blank_values=True, strict_parsing=True, max_num_fields=200, errors="strict")
    except (ValueError, UnicodeError):
        pairs = []
    parts = dict(pairs)
    if len(text) > LONGEST or len(parts) != len(pairs) or "robot" not in parts:
        raise InvalidValueError("the link", repr(text[:60]), "robot=...&pose=... and so on", STEP)
    return parts


def name_of(robot: Robot) -> str:
    """A robot as a link names it: its name, and a number of all that is fixed; the load on its platform is not."""
    fixed = dump_robot(robot.replace(mass=1.0, inertia=np.eye(3)))
    return f"{robot.name}:{crc32(fixed.encode()):08x}"


def check_robot(told: str, robot: Robot) -> None:
    """Refuse a link of another robot.

    Raises:
        InvalidValueError: If it is of another, or of one that only has the same name.
    """
    name, own = told.rpartition(":")[0], name_of(robot)
    if told != own:
        what = "another robot of this name" if name == robot.name else repr(name[:60] or told[:60])
        raise InvalidValueError("the link", f"of {what}", robot.name, "Open it with the robot that it is of.")


def pose_part(pose: Pose) -> str:
    """A pose as the command line takes it, to twelve digits."""
    angles = pose.rotation.as_euler("ZYX", degrees=True)
    values = [*pose.position, *angles] if np.any(np.abs(angles) > 1e-12) else pose.position
    return listed(np.asarray(values))


def listed(values: Array) -> str:
    """Numbers between commas."""
    return ",".join(f"{value + 0.0:.12g}" for value in values)


def numbers_of(text: str, item: str, unit: str, count: int, largest: float) -> Array:
    """So many numbers between commas.

    Raises:
        InvalidValueError: If they are others, or too large.
    """
    parts = text.split(",", maxsplit=count)
    if len(parts) != count:
        raise InvalidValueError(item, repr(text[:60]), f"{count} numbers", STEP)
    return np.array(numbers(parts, item, unit, largest))

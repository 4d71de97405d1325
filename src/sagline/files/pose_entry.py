"""Poses as people write them in YAML: a position, with Euler angles, a quaternion or neither."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.files.path_table import FARTHEST, QUATERNION_TOLERANCE
from sagline.files.quantity import in_si
from sagline.files.schema import Entry
from sagline.robot.pose import Pose

UNITS_STEP: Final = "Check its unit: numbers are meters, millimeters are written as 1500 mm."


class _Euler(Entry):
    alpha: Any = 0.0
    beta: Any = 0.0
    gamma: Any = 0.0


class PoseEntry(Entry):
    """What a file says of a pose."""

    position: Any
    euler: _Euler | None = None
    quaternion: Any = None


def pose_of_entry(entry: PoseEntry, item: str) -> Pose:
    """The pose that a file means.

    Args:
        entry: What it says.
        item: What messages call it.

    Returns:
        A single pose.

    Raises:
        InvalidValueError: If it is none, or farther away than any machine.
    """
    position = numbers_of(entry.position, 3, "m", f"{item}.position")
    if (far := float(np.abs(position).max())) > FARTHEST:
        raise InvalidValueError(f"{item}.position", f"{far:g} m away", f"up to {FARTHEST:g} m", UNITS_STEP)
    if entry.quaternion is None:
        euler = entry.euler or _Euler()
        angles = [in_si(angle, "rad", f"{item}.euler.{name}") for name, angle in euler]
        return Pose.from_euler(position, *numbers_of(angles, 3, "rad", f"{item}.euler"))
    if entry.euler is not None:
        raise InvalidValueError(
            item, "given with euler and quaternion", "one of the two, or none", "Leave one of them out."
        )
    quaternion = numbers_of(entry.quaternion, 4, "", f"{item}.quaternion")
    length = float(np.linalg.norm(quaternion))
    if abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise InvalidValueError(
            f"the length of {item}.quaternion", f"{length:.6g}", f"1 to {QUATERNION_TOLERANCE:g}", f"Correct {item}."
        )
    return Pose.from_quaternion(position, quaternion / length)


def numbers_of(value: Any, count: int, unit: str, item: str) -> Array:
    """So many numbers in SI.

    Args:
        value: What a file says.
        count: How many they must be.
        unit: Their unit in SI.
        item: What messages call them.

    Returns:
        Array of shape (count,).

    Raises:
        InvalidValueError: If they are something else.
    """
    numbers = checked(in_si(value, unit, item), item, unit)
    if numbers.shape != (count,):
        raise InvalidValueError(item, f"of shape {numbers.shape}", f"a list of {count} numbers", f"Correct {item}.")
    return numbers

"""Poses and wrenches from text: on the command line, in the viewer and in YAML."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from sagline.core.arrays import FARTHEST, Array, checked
from sagline.core.errors import InvalidValueError
from sagline.files.quantity import QUATERNION_TOLERANCE, in_si, plain_number
from sagline.files.yaml_text import YamlEntry
from sagline.robot.pose import Pose

STRONGEST: Final = 1e12  # largest force and moment [N, N m]: larger than on any machine, and far below overflow
POSE_STEP: Final = "Give meters, and degrees about z, y and x: --pose 1,0,1.5 or --pose 1,0,1.5,10,0,0."
WRENCH_STEP: Final = (
    "Give newtons, and newton meters about the center of mass: --wrench 0,0,-50 or --wrench 0,0,-50,0,5,0."
)
UNITS_STEP: Final = "Check its unit: numbers are meters, millimeters are written as 1500 mm."


def decimal_numbers(parts: Sequence[str], item: str, unit: str, largest: float) -> list[float]:
    """Read plain decimal numbers from the texts `parts`."""
    found = []
    for part in parts:
        number = plain_number(part)
        if number is None or not abs(number) <= largest:  # the condition is True also for NaN
            raise InvalidValueError(item, repr(part), f"decimal numbers up to {largest:g} {unit}", f"Correct {item}.")
        found.append(number)
    return found


def pose_of_text(text: str, item: str = "--pose", step: str = POSE_STEP) -> Pose:
    """Read a pose from "X,Y,Z" in meters, or "X,Y,Z,A,B,C" with angles about z, y and x in degrees."""
    place = _three_or_six(text, item, "m or degrees", FARTHEST, step)
    return Pose.from_euler(place[:3], *np.radians(place[3:]))


def wrench_of_text(text: str | None, item: str = "--wrench", step: str = WRENCH_STEP) -> Array | None:
    """Read a wrench from "fx,fy,fz" in N or "fx,fy,fz,mx,my,mz" in N and N m; None if the text is None."""
    return None if text is None else np.array(_three_or_six(text, item, "N or N m", STRONGEST, step))


def _three_or_six(text: str, item: str, unit: str, largest: float, step: str) -> list[float]:
    """Read three or six numbers separated by commas. Three numbers are completed by three zeros."""
    parts = text.split(",", maxsplit=6)
    if len(parts) not in (3, 6):
        raise InvalidValueError(item, repr(text), "three or six numbers", step)
    whole = decimal_numbers(parts, item, unit, largest)
    return whole + [0.0] * (6 - len(whole))


class _Euler(YamlEntry):
    alpha: Any = 0.0
    beta: Any = 0.0
    gamma: Any = 0.0


class PoseEntry(YamlEntry):
    """Schema of a pose in a file."""

    position: Any
    euler: _Euler | None = None
    quaternion: Any = None

    def pose(self, item: str) -> Pose:
        """The pose. InvalidValueError if it is invalid or too far away for any machine."""
        position = _si_numbers(self.position, 3, "m", f"{item}.position")
        if (far := float(np.abs(position).max())) > FARTHEST:
            raise InvalidValueError(f"{item}.position", f"{far:g} m away", f"up to {FARTHEST:g} m", UNITS_STEP)
        if self.quaternion is None:
            euler = self.euler or _Euler()
            angles = [in_si(angle, "rad", f"{item}.euler.{name}") for name, angle in euler]
            return Pose.from_euler(position, *_si_numbers(angles, 3, "rad", f"{item}.euler"))
        if self.euler is not None:
            value, step = "given with euler and quaternion", "Leave one of them out."
            raise InvalidValueError(item, value, "one of the two, or none", step)
        quaternion = _si_numbers(self.quaternion, 4, "", f"{item}.quaternion")
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1.0) > QUATERNION_TOLERANCE:
            wrong, allowed = f"the length of {item}.quaternion", f"1 to {QUATERNION_TOLERANCE:g}"
            raise InvalidValueError(wrong, f"{length:.6g}", allowed, f"Correct {item}.")
        return Pose.from_quaternion(position, quaternion / length)


def _si_numbers(value: Any, count: int, unit: str, item: str) -> Array:
    """Convert `value` from a file to `count` numbers in SI, shape (count,)."""
    numbers = checked(in_si(value, unit, item), item, unit)
    if numbers.shape != (count,):
        raise InvalidValueError(item, f"of shape {numbers.shape}", f"a list of {count} numbers", f"Correct {item}.")
    return numbers

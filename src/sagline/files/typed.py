"""Poses and wrenches as people type them, on the command line and in the viewer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.files.quantity import plain_number
from sagline.robot.pose import Pose

FARTHEST, STRONGEST = 1e6, 1e12  # m; N and N m: beyond all machines, far below what overflows
POSE_STEP: Final = "Give meters, and degrees about z, y and x: --pose 1,0,1.5 or --pose 1,0,1.5,10,0,0."
WRENCH_STEP: Final = (
    "Give newtons, and newton meters about the center of mass: --wrench 0,0,-50 or --wrench 0,0,-50,0,5,0."
)


def numbers(parts: Sequence[str], item: str, unit: str, largest: float) -> list[float]:
    """Plain decimal numbers.

    Args:
        parts: Their texts.
        item: What they are, for the message.
        unit: Their unit, for the message.
        largest: Largest absolute value.

    Raises:
        InvalidValueError: If one is no such number, or too large.
    """
    found = []
    for part in parts:
        number = plain_number(part)
        if number is None or not abs(number) <= largest:  # NaN neither
            raise InvalidValueError(item, repr(part), f"decimal numbers up to {largest:g} {unit}", f"Correct {item}.")
        found.append(number)
    return found


def pose_of(text: str, item: str = "--pose", step: str = POSE_STEP) -> Pose:
    """A pose from X,Y,Z in meters, or X,Y,Z,A,B,C with the angles about z, y and x in degrees.

    Args:
        text: The text.
        item: What it is, for the message.
        step: What a message tells to do.

    Raises:
        InvalidValueError: If it is none.
    """
    place = _three_or_six(text, item, "m or degrees", FARTHEST, step)
    return Pose.from_euler(place[:3], *np.radians(place[3:]))


def wrench_of(text: str | None, item: str = "--wrench", step: str = WRENCH_STEP) -> Array | None:
    """A wrench from "fx,fy,fz" in N, or "fx,fy,fz,mx,my,mz" with moments in N m; None for none.

    Args:
        text: The text.
        item: What it is, for the message.
        step: What a message tells to do.

    Raises:
        InvalidValueError: If it is none.
    """
    return None if text is None else np.array(_three_or_six(text, item, "N or N m", STRONGEST, step))


def _three_or_six(text: str, item: str, unit: str, largest: float, step: str) -> list[float]:
    """Plain numbers between commas; of three, three zeros follow."""
    parts = text.split(",", maxsplit=6)
    if len(parts) not in (3, 6):
        raise InvalidValueError(item, repr(text), "three or six numbers", step)
    whole = numbers(parts, item, unit, largest)
    return whole + [0.0] * (6 - len(whole))

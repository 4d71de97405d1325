"""Numbers as the command line gives them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, cast

import numpy as np

from sagline.core.arrays import checked
from sagline.core.errors import InvalidValueError
from sagline.files.quantity import in_si
from sagline.robot.inertia import with_mass
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from sagline.dynamics.vibration.dynamic_stiffness import Damping
    from sagline.robot.robot import Robot

LAST_PORT = 65535
HEAVIEST = 1e12  # kg: beyond all machines, far below what overflows


def quantity(text: str, item: str, unit: str, *, low: float = -np.inf, above: float = -np.inf) -> float:
    """A number in SI, or a text with its unit.

    Args:
        text: Such as "20" or "20 kg".
        item: What it is, for the message.
        unit: The SI unit.
        low: Smallest value.
        above: Only larger values will do.

    Raises:
        InvalidValueError: If it is no such quantity, or out of range.
    """
    number = cast(float, in_si(text, unit, item))
    if abs(number) > HEAVIEST:
        raise InvalidValueError(item, repr(text), f"up to {HEAVIEST:g} {unit}", f"Correct {item}.")
    return float(checked(number, item, unit, shape=(), low=low, above=above))


def whole_of(text: str, item: str, least: int, most: int) -> int:
    """A whole number from its digits.

    Args:
        text: Such as "8080".
        item: What it is, for the message.
        least: Smallest that will do.
        most: Largest.

    Raises:
        InvalidValueError: If it is none of these.
    """
    if not re.fullmatch(r"[0-9]{1,20}", text) or not least <= int(text) <= most:
        raise InvalidValueError(item, repr(text), f"a whole number from {least} to {most}", "Choose another.")
    return int(text)


def port_of(text: str) -> int:
    """A TCP port from its digits; 0 for any.

    Raises:
        InvalidValueError: If it is none.
    """
    return whole_of(text, "--port", 0, LAST_PORT)


def ratio(text: str, item: str) -> float:
    """A number without unit, or one of hundred: "0.02" or "2 %".

    Args:
        text: The text.
        item: What it is, for the message.

    Raises:
        InvalidValueError: If it is no such number, or negative.
    """
    number, percent = text.strip().removesuffix("%"), text.strip().endswith("%")
    return quantity(number, item, "", low=0.0) / (100.0 if percent else 1.0)


def damping_of(loss_time: str, air_damping: str, modal_damping: str = "0") -> Damping:
    """The losses of cables and modes.

    Args:
        loss_time: Of `--loss-time`, a time.
        air_damping: Of `--air-damping`, a force on a length over a velocity.
        modal_damping: Of `--damping`, a ratio.

    Raises:
        InvalidValueError: If one is no such quantity, or negative.
    """
    from sagline.dynamics.vibration.dynamic_stiffness import Damping

    times = quantity(loss_time, "--loss-time", "s", low=0.0)
    return Damping(times, quantity(air_damping, "--air-damping", "N*s/m^2", low=0.0), ratio(modal_damping, "--damping"))


def middle_of(robot: Robot) -> Pose:
    """The middle of the poses that a robot is meant for, level.

    Raises:
        InvalidValueError: If it does not say which these are.
    """
    if robot.test_box is None:
        raise InvalidValueError("--pose", "missing", "X,Y,Z or X,Y,Z,A,B,C", "This robot names no box of poses.")
    return Pose((robot.test_box.low + robot.test_box.high) / 2, np.eye(3))


def loaded(robot: Robot, payload: str | None) -> Robot:
    """A robot whose platform carries a mass besides its own; the inertia grows in proportion.

    Args:
        robot: The robot.
        payload: Such as "20" or "20 kg"; None for nothing.

    Raises:
        InvalidValueError: If it is no mass.
    """
    if payload is None:
        return robot
    return with_mass(robot, robot.mass + quantity(payload, "--payload", "kg", low=0.0))

"""What is said to who does not see the page: the verdict in a sentence, and where the platform is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import Drawn
from sagline.viewer.readout import headline
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.view import View
from sagline.viewer.wording import number


class Spoken(NamedTuple):
    """A sentence in parts.

    Attributes:
        head: The verdict in a word or two: when it changes, it is said soon.
        text: All of it.
        place: Where the platform is.
    """

    head: str
    text: str
    place: str


def spoken(view: View) -> Spoken:
    """What there is to say of what is shown."""
    snapshot = view.snapshot
    place = place_of(snapshot.pose)
    if isinstance(snapshot, Drawn):
        head = snapshot.notice or f"As in the {'recording' if view.played is None else view.played.name}"
        return Spoken(head, _with(head, _tensions(snapshot.robot, snapshot.tension)), place)
    head = headline(snapshot)
    told = _tensions(snapshot.robot, snapshot.tension) if snapshot.feasible else snapshot.reason
    return Spoken(head, _with(head, told), place)


def described(robot: Robot) -> str:
    """What the picture shows, whatever its pose."""
    return f"{robot.name}: a platform of {number(robot.mass, '.4g')} kg on {robot.cable_count} cables"


def place_of(pose: Pose) -> str:
    """Position and, where it is turned, angles of a platform, as one says them."""
    x, y, z = (number(value, ".2f") for value in pose.position)
    angles = [number(value, ".0f") for value in pose.rotation.as_euler("ZYX", degrees=True)]
    place = f"x {x}, y {y}, z {z} m"
    return place if angles == ["0"] * 3 else f"{place}, turned {', '.join(angles)} degrees about z, y, x"


def _with(head: str, told: str) -> str:
    return f"{head}, {told}" if told else head


def _tensions(robot: Robot, tension: Array) -> str:
    known = tension[np.isfinite(tension)]
    if not known.size:
        return ""
    unit = force_unit(robot)
    form = ".0f" if unit.newtons == 1.0 else ".1f"
    low, high = (number(value / unit.newtons, form) for value in (known.min(), known.max()))
    return f"tensions {low} to {high} {unit.name}"

"""Keyboard control of the platform, and text for screen readers."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import shapes
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.player import InMotion
from sagline.viewer.readout import headline
from sagline.viewer.server import finite_numbers
from sagline.viewer.tension_scale import ForceUnit, number_text


def screen_reader_text(view: View) -> dict[str, str]:
    """Verdict, whole text and position of a view for screen readers."""
    snapshot = view.snapshot
    if isinstance(snapshot, InMotion):
        head = snapshot.notice or f"As in the {'recording' if view.played is None else view.played.name}"
        text = _tensions(snapshot.robot, snapshot.tension)
    else:
        head = headline(snapshot)
        text = _tensions(snapshot.robot, snapshot.tension) if snapshot.solved else snapshot.reason
    return {"head": head, "text": f"{head}, {text}" if text else head, "place": place_of(snapshot.pose)}


def place_of(pose: Pose) -> str:
    """Position and nonzero angles of a platform in words."""
    x, y, z = (number_text(value, ".2f") for value in pose.position)
    angles = [number_text(value, ".0f") for value in pose.rotation.as_euler("ZYX", degrees=True)]
    place = f"x {x}, y {y}, z {z} m"
    return place if angles == ["0"] * 3 else f"{place}, turned {', '.join(angles)} degrees about z, y, x"


def _tensions(robot: Robot, tension: Array) -> str:
    known = tension[np.isfinite(tension)]
    if not known.size:
        return ""
    unit = ForceUnit.of(robot)
    form = ".0f" if unit.newtons == 1.0 else ".1f"
    low, high = (number_text(value / unit.newtons, form) for value in (known.min(), known.max()))
    return f"tensions {low} to {high} {unit.name}"


STEP: Final = 0.01  # translation per key press, as a share of the robot's size
TURN: Final = np.radians(1.0)  # rotation per key press
MOST: Final = 100.0  # largest number of steps in one message, for keys that are held during a delay


class KeyboardFeature(Feature):
    """Control of the platform by keys, and text for screen readers."""

    def __init__(self, page: Page) -> None:
        """Send the description of the scene."""
        channel, robot = page.channel, page.robot
        self._channel, self._go = channel, page.go_near
        self._step = shapes.round_below(STEP * shapes.size_of(robot))
        self._pose: Pose | None = None
        what = f"{robot.name}: a platform of {number_text(robot.mass, '.4g')} kg on {robot.cable_count} cables"
        channel.send("scene", {"what": what, "step": self._step, "turn": round(float(np.degrees(TURN)), 3)})
        channel.on("nudge", self._on_nudge)
        channel.on("home", lambda *_: page.go_home())

    def follow(self, view: View) -> None:
        """Send the verdict."""
        self._pose = view.snapshot.pose
        self._channel.send("spoken", screen_reader_text(view))

    def _on_nudge(self, value: Any, _: int) -> None:
        """Move by steps along x, y, z, and rotate by steps about z, y, x."""
        steps = finite_numbers(value, 6, MOST)
        if steps is None or self._pose is None:
            return
        pose = nudged(self._pose, self._step * steps[:3], TURN * steps[:2:-1])
        try:
            self._go(pose)
        except SaglineError as error:
            self._channel.send("nudge-reply", str(error))
        else:
            self._pose = pose  # the next key press may arrive before this pose is shown
            self._channel.send("nudge-reply", None)


def nudged(pose: Pose, displacement: Array, turn: Array) -> Pose:
    """`pose`, displaced by `displacement` [m] and rotated about its origin by the rotation vector `turn` [rad]."""
    rotation = Rotation.from_rotvec(turn) * pose.rotation if turn.any() else pose.rotation
    return Pose(pose.position + displacement, rotation)

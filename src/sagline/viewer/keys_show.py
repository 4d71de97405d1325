"""The platform moved without a mouse, and what is said of it; browser/keys.js and browser/said.js are the other end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import solids
from sagline.viewer.channel import Channel
from sagline.viewer.spoken import described, spoken
from sagline.viewer.view import View

STEP: Final = 0.01  # of the robot's size: how far one key moves
TURN: Final = np.radians(1.0)  # how far one key turns
MOST: Final = 100.0  # steps at once: keys that were held while nobody listened


class KeysShow:
    """Says what is shown, and hears keys; all of it belongs to the thread that serves."""

    moving = False
    waiting = False

    def __init__(self, channel: Channel, robot: Robot, go: Callable[[Pose], None], go_home: Callable[[], None]) -> None:
        """Say what the picture is of.

        Args:
            channel: To the pages.
            robot: The robot.
            go: Puts the platform to a pose, or refuses by a `SaglineError`.
            go_home: Puts it home.
        """
        self._channel, self._go, self._go_home = channel, go, go_home
        self._step = solids.round_below(STEP * solids.size_of(robot))
        self._pose: Pose | None = None
        channel.tell("scene", {"what": described(robot), "step": self._step, "turn": round(float(np.degrees(TURN)), 3)})
        channel.on("nudge", self._nudge)
        channel.on("home", lambda *_: self._go_home())

    def follow(self, view: View) -> None:
        """Tell the verdict."""
        self._pose = view.snapshot.pose
        self._channel.tell("spoken", spoken(view)._asdict())

    def tick(self) -> None:
        """Nothing comes of time."""

    def _nudge(self, value: Any, _: int) -> None:
        """Move by steps along x, y, z, and turn by steps about z, y, x."""
        steps = _steps(value)
        if steps is None or self._pose is None:
            return
        pose = nudged(self._pose, self._step * steps[:3], TURN * steps[:2:-1])
        try:
            self._go(pose)
        except SaglineError as error:
            self._channel.tell("nudge-told", str(error))
        else:
            self._pose = pose  # more may come before this is shown
            self._channel.tell("nudge-told", None)


def nudged(pose: Pose, way: Array, turn: Array) -> Pose:
    """A pose moved along a way [m], and turned about its origin by a rotation vector in world axes [rad]."""
    rotation = Rotation.from_rotvec(turn) * pose.rotation if turn.any() else pose.rotation
    return Pose(pose.position + way, rotation)


def _steps(value: Any) -> Array | None:
    """Six numbers of a page, of a size that keys bring; None if it sent anything else."""
    if not isinstance(value, list) or len(value) != 6:
        return None
    if not all(isinstance(each, int | float) and abs(each) <= MOST for each in value):  # NaN neither
        return None
    return np.array(value, dtype=np.float64)

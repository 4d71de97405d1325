"""What a timeline plays: a run, or a simulation."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import Drawn
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.timeline_track import Track


class Played(Protocol):
    """Something that lasts, and can be looked at at any time of it."""

    @property
    def name(self) -> str:
        """What it is, in a word."""

    @property
    def robot(self) -> Robot:
        """Whose it is."""

    @property
    def home(self) -> Pose:
        """Where it begins."""

    @property
    def duration(self) -> float:
        """Time of its end [s]."""

    @property
    def still(self) -> str:
        """What to say in place of what would change the robot."""

    def sight(self, time: float) -> Snapshot | Drawn:
        """What there is to see at a time [s]."""

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Desired and actual positions (n, 3), n <= most, the error drawn some times as large; NaN in gaps."""

    def track(self) -> Track:
        """What the timeline shows of it."""


class Beside(NamedTuple):
    """Another run beside what is played, with the same clock.

    Attributes:
        played: The other one.
        names: What both are called on the timeline, what is played first.
    """

    played: Played
    names: tuple[str, str]

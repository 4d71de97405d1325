"""What a timeline plays: a run, or a simulation."""

from __future__ import annotations

from typing import Protocol

from sagline.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.course_figure import CourseFigure
from sagline.viewer.drawn import Drawn
from sagline.viewer.snapshot import Snapshot


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

    def figures(self) -> tuple[CourseFigure, ...]:
        """What there is over time."""

    def key(self) -> str:
        """HTML that says which line is which."""

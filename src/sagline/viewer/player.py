"""Samples of a run, a simulation or a log, and the player with its clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, Protocol, TypeAlias

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import Array
from sagline.robot.batch import dead_cable, pulley_radius
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import touching_angle
from sagline.viewer import shapes
from sagline.viewer.readout import cable_table_html, html_block, pose_line
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.timeline import Track


@dataclass(frozen=True, slots=True, eq=False)
class InMotion:
    """One sample of a simulation or a log; its cables are drawn from their lengths or from their nodes."""

    robot: Robot
    pose: Pose
    index: int  # index of the sample
    tension: Array  # tensions [N], shape (m,); NaN if unknown
    length: Array  # unstrained lengths off the drums [m], shape (m,); NaN if unknown
    verdict: str  # HTML of the state and of the events
    heads: tuple[str, ...]  # column heads of the table of cables
    columns: Sequence[Sequence[str]]  # columns of this table, one text per cable
    why_no_choice: str  # reason why tensions cannot be chosen
    feasible: bool = True
    rest: Pose | None = None  # second pose to show
    truth: Pose | None = None  # true pose, if known
    nodes: Array | None = None  # positions of the cables at their nodes [m], shape (m, P, 3)
    broken: list[int] = field(default_factory=list)  # numbers of the broken cables
    notice: str = ""  # label of a platform that is not feasible

    @property
    def solved(self) -> bool:
        """True if the platform is drawn as feasible, as for a `Snapshot`."""
        return self.feasible

    def numbers(self, scale: TensionScale) -> str:
        """HTML of the pose, and of the table of the cables."""
        return html_block(pose_line(self.pose) + cable_table_html(self.heads, self.columns, scale.colors(self.tension)))

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables from pulley to the other end (m, P, 3), NaN between pieces of a broken cable."""
        if self.nodes is not None:
            return shapes.resampled(self.nodes, shapes.points_per_cable(self.robot))
        # catenaries with the cables' lengths; the exit points are the same as for chords
        robot, pose = self.robot, self.pose
        ends = shapes.chords(robot, pose, shapes.wraps(robot, pose)[:, -1])
        run = ends[:, 1] - ends[:, 0]
        span, rise = np.hypot(run[:, 0], run[:, 1]), run[:, 2]
        wrapped = pulley_radius(robot) * np.nan_to_num(touching_angle(robot, pose))
        length = self.length - wrapped - dead_cable(robot)
        length = np.where(length > 0.0, length, np.hypot(span, rise))
        cables = Catenary().from_length(robot.cables, span, rise, length, robot.gravity)
        courses = shapes.courses(robot, pose, None, sag_scale, cables)
        courses[self.broken] = courses[self.broken, :1]  # a broken cable without mass is drawn as a point
        return courses

    def wheels(self) -> tuple[Array, Array]:
        """Centers (m, 3) [m] and quaternions (m, 4) of the pulleys."""
        return shapes.wheels(self.robot, self.pose, None, self.length)


Configuration: TypeAlias = Snapshot | InMotion


class Played(Protocol):
    """Base of a played motion: a run, a simulation or a log."""

    name: ClassVar[str]  # name of the kind of motion
    unchanged: ClassVar[str]  # text that replaces the controls for changes of the robot

    robot: Robot
    time: Array  # times of the samples from 0 [s], shape (N,)

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def index_at(self, time: float) -> int:
        """Index of the last sample at or before a time [s]; 0 for earlier times."""
        return max(int(np.searchsorted(self.time, time, side="right")) - 1, 0)

    def at(self, time: float) -> Configuration:
        """The sample at or before a time [s]."""

    def code(self, source: str, time: float) -> list[str]:
        """Lines of Python that reproduce the sample at a time [s]; `source` is an expression of the motion."""

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Desired and actual positions (n, 3), n <= `most`, with a scaled error; NaN in gaps."""

    def track(self) -> Track:
        """Charts, spans and marks of the timeline."""


class Beside(NamedTuple):
    """A second run, which is played with the same clock."""

    played: Played
    names: tuple[str, str]  # names of both runs on the timeline, the second run last


class PlayerState(NamedTuple):
    """State of a player."""

    played: Played | None
    original: bool  # True if the page was opened with it
    time: float  # shown time [s]
    playing: bool  # True if the clock runs
    following: bool  # True if the motion was shown, False for a pose of the user


class Player:
    """Player of a run, a simulation or a log, with its clock."""

    def __init__(
        self, original: Played | None, put_on: Callable[[Played | None], None], beside: Beside | None = None
    ) -> None:
        """Play the motion `original`, or no motion for None. `put_on` is called whenever another motion is played."""
        self._put_on, self._original, self._beside = put_on, original, beside
        # speed: ratio of the time of the motion to real time
        # number: number of the played motion; a longer version has the same number
        self.speed, self.number = 1.0, 0
        self.play(original)

    @property
    def is_original(self) -> bool:
        """True if the page was opened with the played motion."""
        return self.played is self._original

    @property
    def beside(self) -> Beside | None:
        """The second run."""
        return self._beside if self.played is not None and self.is_original else None

    def play(self, played: Played | None, *, at_once: bool = False) -> None:
        """Play another motion, or stop playing."""
        # time: shown time of the motion [s], 0 to `duration`
        # playing: True if the clock runs
        # following: True if the motion is shown, False for a pose of the user
        self._replace(played)
        self.time, self.playing, self.following = 0.0, at_once, played is not None
        self.number += 1
        self._put_on(played)

    def extend(self, played: Played) -> None:
        """Replace the original motion by a longer version. A paused clock at the former end moves to the new end."""
        shown = self.is_original  # otherwise the simulation of a cut is shown
        self._original = played
        if shown:
            moves = self.time >= self.duration and not self.playing
            self._replace(played)
            self.time = self.duration if moves else self.time

    def grow(self, played: Played) -> None:
        """Replace the simulation of a cut by a longer version. A clock at the former end continues."""
        self.playing = self.playing or self.time >= self.duration
        self._replace(played)

    def save(self) -> PlayerState:
        """State to return to later."""
        return PlayerState(self.played, self.is_original, self.time, self.playing, self.following)

    def restore(self, kept: PlayerState) -> None:
        """Return to the stored state `kept`. The original motion keeps its later extensions."""
        self.play(self._original if kept.original else kept.played)
        self.time, self.playing, self.following = kept.time, kept.playing, kept.following

    def advance(self, elapsed: float) -> None:
        """Advance a running clock by an interval of real time [s]; it stops at the end."""
        if self.playing:
            self.time = min(self.time + max(elapsed, 0.0) * self.speed, self.duration)
            self.playing = self.time < self.duration

    def now(self) -> Configuration:
        """Configuration at the present time."""
        assert self.played is not None
        return self.played.at(self.time)

    def leave(self) -> None:
        """Pause, and show a pose of the user."""
        self.playing = self.following = False

    def follow(self) -> None:
        """Show the played motion, if there is one."""
        self.following = self.played is not None

    def toggle(self) -> None:
        """Pause, or play; at its end, the clock starts again."""
        if not self.playing and self.time >= self.duration:
            self.time = 0.0
        self.playing = not self.playing
        self.follow()

    def scrub_to(self, time: float) -> None:
        """Pause at another time [s], limited to the ends of the clock."""
        self.time, self.playing = min(max(time, 0.0), self.duration), False
        self.follow()

    def _replace(self, played: Played | None) -> None:
        """Replace the played motion. The clock ends with it or with the second run, whichever is later."""
        self.played = played
        parts = [part.duration for part in (played, self.beside and self.beside.played) if part is not None]
        self.duration = max(parts, default=0.0)

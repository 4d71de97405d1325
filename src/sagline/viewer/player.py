"""Player of a run, a simulation or a log, and its clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import InMotion
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.timeline import Track


class Played(Protocol):
    """A run, a simulation or a log."""

    @property
    def name(self) -> str:
        """Name of its kind."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def home(self) -> Pose:
        """The first pose."""

    @property
    def duration(self) -> float:
        """Time of its end [s]."""

    @property
    def still(self) -> str:
        """Text in place of the controls that would change the robot."""

    def sight(self, time: float) -> Snapshot | InMotion:
        """State at a time [s]."""

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Desired and actual positions (n, 3), n <= most, the error drawn some times as large; NaN in gaps."""

    def track(self) -> Track:
        """Charts of the timeline."""


class Beside(NamedTuple):
    """Another run beside what is played, with the same clock.

    Attributes:
        played: The other one.
        names: What both are called on the timeline, what is played first.
    """

    played: Played
    names: tuple[str, str]


@dataclass(frozen=True, slots=True)
class Timeline:
    """Clock of a playback.

    Attributes:
        duration: Time of the end [s].
        time: Time shown [s], 0 to duration.
        playing: Whether time goes on.
    """

    duration: float
    time: float = 0.0
    playing: bool = False

    def advanced(self, elapsed: float, speed: float) -> Timeline:
        """After a while of real time [s] at a speed [times]; stops at the end."""
        if not self.playing:
            return self
        time = self.time + max(elapsed, 0.0) * speed
        return Timeline(self.duration, min(time, self.duration), time < self.duration)

    def extended(self, duration: float) -> Timeline:
        """With an end that has moved on [s]; who stood at the end stands there again."""
        time = duration if self.time >= self.duration and not self.playing else self.time
        return Timeline(duration, time, self.playing)

    def toggled(self) -> Timeline:
        """Play, from the start again if at the end; or pause."""
        time = 0.0 if not self.playing and self.time >= self.duration else self.time
        return Timeline(self.duration, time, not self.playing)

    def scrubbed(self, time: float) -> Timeline:
        """At another time [s], paused; a time outside is taken as the nearer end."""
        return Timeline(self.duration, min(max(time, 0.0), self.duration), False)


class PlayerState(NamedTuple):
    """State of a player.

    Attributes:
        played: What; None for nothing.
        given: Whether it is what the page was opened with.
        clock: Where it was.
        following: Whether it was shown, and not a pose of one's own.
    """

    played: Played | None
    given: bool
    clock: Timeline
    following: bool


class Player:
    """A run, a simulation or a log, and its clock.

    Attributes:
        played: What is played; None for nothing.
        clock: Where it is.
        following: Whether what is played is shown, and not a pose of one's own.
        speed: Time of what is played a second.
        number: Of what is played; it stays what it is when that goes on.
    """

    def __init__(
        self,
        given: Played | None,
        put_on: Callable[[Played | None], None],
        beside: Beside | None = None,
    ) -> None:
        """Put something on, or nothing."""
        self._put_on, self._given, self._beside = put_on, given, beside
        self.speed, self.number = 1.0, 0
        self.play(given)

    @property
    def given(self) -> bool:
        """True if the page was opened with what is played."""
        return self.played is self._given

    @property
    def beside(self) -> Beside | None:
        """The second run."""
        return self._beside if self.played is not None and self.played is self._given else None

    def play(self, played: Played | None, *, at_once: bool = False) -> None:
        """Put something on the timeline in place of what was there, or nothing."""
        self.played = played
        self.number += 1
        self.following = played is not None
        self.clock = Timeline(self._duration(), 0.0, at_once)
        self._put_on(played)

    def extend(self, played: Played) -> None:
        """Have what was given go on; who looks at its end sees the new end."""
        looked_at = self.played is self._given  # or else at what a cut brought
        self._given = played
        if looked_at:
            self.played = played
            self.clock = self.clock.extended(self._duration())

    def grow(self, played: Played) -> None:
        """Have what a cut brought go on; a clock that has come to its end waits for the rest, and goes on."""
        waits = self.clock.time >= self.clock.duration
        self.played = played
        self.clock = Timeline(self._duration(), self.clock.time, self.clock.playing or waits)

    def save(self) -> PlayerState:
        """State to return to later."""
        return PlayerState(self.played, self.played is self._given, self.clock, self.following)

    def restore(self, kept: PlayerState) -> None:
        """Play what was kept, where its clock stood; of what was given as much as there is by now."""
        self.play(self._given if kept.given else kept.played)
        self.clock = self.clock.scrubbed(kept.clock.time)
        if kept.clock.playing:
            self.clock = self.clock.toggled()
        self.following = kept.following

    def advance(self, elapsed: float) -> None:
        """Some real time has passed [s]."""
        self.clock = self.clock.advanced(elapsed, self.speed)

    def sight(self) -> Snapshot | InMotion:
        """State at the present time."""
        assert self.played is not None
        return self.played.sight(self.clock.time)

    def leave(self) -> None:
        """Stop, and show a pose of one's own."""
        self.clock = self.clock.scrubbed(self.clock.time)
        self.following = False

    def follow(self) -> None:
        """Show what is played, if anything is."""
        self.following = self.played is not None

    def toggle(self) -> None:
        """Play, or pause."""
        self.clock = self.clock.toggled()
        self.follow()

    def scrub_to(self, time: float) -> None:
        """Look at another time [s], paused."""
        self.clock = self.clock.scrubbed(time)
        self.follow()

    def _duration(self) -> float:
        parts = [part.duration for part in (self.played, self.beside and self.beside.played) if part is not None]
        return max(parts, default=0.0)

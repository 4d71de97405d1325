"""The clock of a run: play, pause, speed, scrub. It knows times, no samples and no browser."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Timeline:
    """Where a playback is.

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

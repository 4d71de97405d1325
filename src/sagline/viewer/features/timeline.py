"""Timeline across the bottom of the page."""

from __future__ import annotations

import time
from collections.abc import Hashable
from typing import Any, Final

import numpy as np

from sagline.viewer import shapes
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.player import Played
from sagline.viewer.robot_scene import GHOST, GHOST_WIDTH, NEAR, Nodes, cable_segments
from sagline.viewer.server import finite_numbers
from sagline.viewer.tension_scale import linear
from sagline.viewer.timeline import COLORS, Track, timeline_message

_WIDTH: Final = 8.0  # width of the line along the cable under the pointer [px]
_COLORS: Final = linear(np.array([[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in COLORS], dtype=np.uint8))


SPEEDS: Final = (0.25, 1.0, 4.0, 16.0)
PERIOD: Final = 1.0 / 30.0  # shortest time between messages of the clock [s]
TURN: Final = 0.5  # shortest time between moves of the window [s]
NARROWEST: Final = 1e-6  # smallest width of a window, relative to the duration
_MOST_STEPS: Final = 1_000_000
LARGEST: Final = 1e300  # largest number in a message


class TimelineFeature(Feature):
    """The timeline of browser/timeline.js: charts of the played motion, and the control of its clock."""

    live = True

    def __init__(self, page: Page) -> None:
        """Register the messages of browser/timeline.js."""
        player, channel = page.player, page.channel
        self._channel, self._player = channel, player
        self._nodes, self._body = Nodes(page.server.scene), shapes.Solid.platform(page.robot)
        self._above = float(self._body.vertices[:, 2].max()) + NEAR * page.size
        self._played: Played | None = None  # played motion of the track
        self._number = player.number
        self._track: Track | None = None
        self._other: Track | None = None  # track of the second run
        self._chart = 0  # index of the shown chart
        self._window: tuple[float, float] | None = None  # visible range of times [s]; None for all
        self._sent: Any = None  # last message of the state
        self._clock: Any = None
        self._sent_at = -PERIOD
        self._moved_at = -TURN
        self._was_playing = False  # True if the clock was running at the last tick
        self._cable: int | None = None  # cable under the pointer
        for topic in ("scrub", "step", "play", "speed", "follow", "chart", "point", "window"):
            channel.on(topic, getattr(self, f"_on_{topic}"))
        self.tick()

    @property
    def waiting(self) -> bool:
        """True if the present time of the clock is not sent yet."""
        return bool(self._clock != self._now())

    def depends(self, view: View) -> Hashable:
        """Key: the view if a cable is under the pointer or a second run is drawn."""
        beside = view.played is not None and self._player.beside is not None
        return view if beside or self._cable is not None else None

    def follow(self, view: View) -> None:
        """Draw the second run and the cable under the pointer."""
        beside = self._player.beside if view.played is not None else None
        sag_scale = view.settings.sag_scale
        if beside is None:
            self._nodes.hide("/beside", "/beside_cables")
        else:
            other = beside.played.at(self._player.time)
            self._nodes.body("/beside", self._body, GHOST, 0.5, other.pose)
            self._nodes.label("/beside/name", beside.names[1], (0.0, 0.0, self._above))
            self._nodes.lines("/beside_cables", cable_segments(other, sag_scale), GHOST, GHOST_WIDTH)
        cable = self._cable
        if cable is None or cable >= view.snapshot.robot.cable_count:
            self._nodes.hide("/pointed")
        else:
            points = shapes.segments(view.snapshot.courses(sag_scale)[[cable]], dashed=False)
            self._nodes.lines("/pointed", points, _COLORS[cable % len(_COLORS)], _WIDTH)

    def tick(self) -> None:
        """Send all changes, and the clock at most once per `PERIOD`."""
        if self._player.played is not self._played:
            self._restart()
        self._move_window()
        if self._sent != (self._track, self._chart, self._window):
            self._send_tracks()
        if self.waiting and time.monotonic() - self._sent_at >= PERIOD:
            self._sent_at, self._clock = time.monotonic(), self._now()
            self._channel.send("clock", self._clock)

    def _restart(self) -> None:
        """Update the tracks for the played motion or a longer version of it."""
        played, beside = self._player.played, self._player.beside
        self._track = None if played is None else played.track()
        self._other = None if beside is None else self._other or beside.played.track()
        if self._number != self._player.number:  # a new motion, not only a longer version
            self._chart, self._window = 0, None
        self._played, self._number = played, self._player.number

    def _move_window(self) -> None:
        """Move the window after the clock has left the window; without delay if the clock has reached its end."""
        player = self._player
        ended, self._was_playing = self._was_playing and player.time >= player.duration, player.playing
        if self._window is None or not (player.playing or ended):
            return
        start, end = self._window
        if not start <= player.time <= end and (ended or time.monotonic() - self._moved_at > TURN):
            self._moved_at = time.monotonic()
            first = min(player.time, player.duration - (end - start))
            self._window = (first, first + end - start)

    def _send_tracks(self) -> None:
        played, beside, track = self._player.played, self._player.beside, self._track
        self._sent = (track, self._chart, self._window)
        if played is None or track is None:
            self._channel.send("timeline", None)
            return
        tracks = [(played.name if beside is None else beside.names[0], track)]
        if beside is not None and self._other is not None:
            tracks.append((beside.names[1], self._other))
        message = timeline_message(tracks, self._chart, self._player.duration, self._window)
        self._channel.send("timeline", {"kind": played.name, "speeds": SPEEDS, **message})

    def _now(self) -> dict[str, Any]:
        return {name: getattr(self._player, name) for name in ("time", "playing", "speed", "following")}

    def _on_scrub(self, value: Any, _: int) -> None:
        if self._player.played is not None and _is_number(value):
            self._player.scrub_to(float(value))

    def _on_step(self, value: Any, _: int) -> None:
        if self._track is not None and _is_number(value) and abs(value) <= _MOST_STEPS:
            self._player.scrub_to(self._track.step_from(self._player.time, int(value)))

    def _on_play(self, value: Any, _: int) -> None:
        if self._player.played is not None and isinstance(value, bool) and value != self._player.playing:
            self._player.toggle()

    def _on_speed(self, value: Any, _: int) -> None:
        if _is_number(value) and value in SPEEDS:
            self._player.speed = float(value)

    def _on_follow(self, value: Any, _: int) -> None:
        if isinstance(value, bool):
            (self._player.follow if value else self._player.leave)()

    def _on_chart(self, value: Any, _: int) -> None:
        if self._track is not None and type(value) is int and 0 <= value < len(self._track.charts):
            self._chart = value

    def _on_window(self, value: Any, _: int) -> None:
        duration = self._player.duration
        if value is None:
            self._window = None
        elif (ends := finite_numbers(value, 2, LARGEST)) is not None:
            start, end = max(float(ends[0]), 0.0), min(float(ends[1]), duration)
            if end - start >= NARROWEST * duration > 0.0:
                self._window = None if (start, end) == (0.0, duration) else (start, end)

    def _on_point(self, value: Any, _: int) -> None:
        self._cable = value if type(value) is int and value >= 0 else None


def _is_number(value: Any) -> bool:
    return finite_numbers([value], 1, LARGEST) is not None

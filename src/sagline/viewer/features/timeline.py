"""Timeline across the bottom of the page."""

from __future__ import annotations

import time
from collections.abc import Hashable
from math import isfinite
from typing import Any, Final

import numpy as np
import viser

from sagline.robot.robot import Robot
from sagline.viewer import lines, solids
from sagline.viewer.drawn import Drawn
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.player import Played
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import GHOST, GHOST_WIDTH, NEAR
from sagline.viewer.tension_scale import linear
from sagline.viewer.timeline import COLORS, Track, told

_WIDTH: Final = 8.0  # px
_COLORS: Final = linear(np.array([[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in COLORS], dtype=np.uint8))


class TimelineStage:
    """Nodes of the scene that are made when they are first needed."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, name: str = "") -> None:
        """Draw nothing yet; `name` is that of the second run."""
        self._scene, self._robot, self._name = scene, robot, name
        self._pointed: Any = None
        self._beside: tuple[Any, Any] | None = None  # platform and cables

    def emphasize(self, snapshot: Snapshot | Drawn, cable: int | None, sag_scale: float) -> None:
        """Draw a cable bold in the color of its line, or none."""
        shown = cable is not None and cable < self._robot.cable_count
        if self._pointed is not None:
            self._pointed.visible = shown
        if not shown or cable is None:
            return
        points = lines.segments(snapshot.courses(sag_scale)[[cable]], dashed=False).astype(np.float32)
        if self._pointed is None:
            self._pointed = self._scene.add_line_segments(
                "/pointed", points, GHOST, thickness=_WIDTH, thickness_units="screen"
            )
        self._pointed.points = points
        self._pointed.colors = np.broadcast_to(_COLORS[cable % len(_COLORS)], points.shape)

    def show_beside(self, other: Snapshot | Drawn | None, sag_scale: float) -> None:
        """Draw the second run as a ghost, or nothing."""
        if self._beside is not None:
            for node in self._beside:
                node.visible = other is not None
        if other is None:
            return
        points = other.cable_segments(sag_scale).astype(np.float32)
        if self._beside is None:
            self._beside = self._made(points)
        platform, cables = self._beside
        platform.position, platform.wxyz = other.pose.position, np.roll(other.pose.quaternion, 1)
        cables.points = points

    def _made(self, points: Any) -> tuple[Any, Any]:
        body = solids.platform(self._robot)
        frame = self._scene.add_frame("/beside", show_axes=False)
        self._scene.add_mesh_simple("/beside/body", body.vertices, body.faces, color=GHOST, opacity=0.5)
        above = float(body.vertices[:, 2].max()) + NEAR * solids.size_of(self._robot)
        self._scene.add_label("/beside/name", self._name, position=(0.0, 0.0, above), anchor="bottom-center")
        cables = self._scene.add_line_segments(
            "/beside_cables", points, GHOST, thickness=GHOST_WIDTH, thickness_units="screen"
        )
        return frame, cables


SPEEDS: Final = (0.25, 1.0, 4.0, 16.0)
PERIOD: Final = 1.0 / 30.0  # s: the clock is not told more often
TURN: Final = 0.5  # s: a window that the clock has left follows it not more often
NARROWEST: Final = 1e-6  # of the whole, that a window is wide
_MOST_STEPS: Final = 1_000_000


class TimelineFeature(Feature):
    """Follows a player, and moves it; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Begin to speak and to listen; browser/timeline.js is at the other end."""
        player, channel, beside = page.player, page.channel, page.player.beside
        name = "" if beside is None else beside.names[1]
        self._channel, self._player = channel, player
        self._stage = TimelineStage(page.server.scene, page.robot, name)
        self._played: Played | None = None  # of which the track is
        self._number = player.number
        self._track: Track | None = None
        self._other: Track | None = None  # of what is beside
        self._chart = 0  # which is shown
        self._window: tuple[float, float] | None = None  # that is looked at [s]; None for the whole
        self._known: Any = None  # of these the pages know
        self._clock: Any = None
        self._when = -PERIOD
        self._turned = -TURN
        self._played_on = False  # whether the clock went on when it was looked at last
        self._cable: int | None = None  # that is pointed at
        for topic, heard in (
            ("scrub", self._scrub), ("step", self._step), ("play", self._play), ("speed", self._speed),
            ("follow", self._follow), ("chart", self._choose), ("point", self._point), ("window", self._look),
        ):  # fmt: skip
            channel.on(topic, heard)
        self.tick()

    @property
    def waiting(self) -> bool:
        """Whether the pages do not know yet where the clock is."""
        return bool(self._clock != self._now())

    def depends(self, view: View) -> Hashable:
        """Nothing while no cable is pointed at, and no second run drawn."""
        beside = view.played is not None and self._player.beside is not None
        return view if beside or self._cable is not None else None

    def follow(self, view: View) -> None:
        """Draw what is beside, and what is pointed at."""
        beside = self._player.beside if view.played is not None else None
        other = None if beside is None else beside.played.sight(self._player.clock.time)
        self._stage.show_beside(other, view.settings.sag_scale)
        self._stage.emphasize(view.snapshot, self._cable, view.settings.sag_scale)

    def tick(self) -> None:
        """Tell what has changed, the clock not too often."""
        if self._player.played is not self._played:
            self._put_on()
        self._go_along()
        if self._known != (self._track, self._chart, self._window):
            self._tell_tracks()
        if self.waiting and time.monotonic() - self._when >= PERIOD:
            self._when, self._clock = time.monotonic(), self._now()
            self._channel.tell("clock", self._clock)

    def _put_on(self) -> None:
        """Something else is played, or more of it."""
        played, beside = self._player.played, self._player.beside
        self._track = None if played is None else played.track()
        self._other = None if beside is None else self._other or beside.played.track()
        if self._number != self._player.number:  # it is not only longer
            self._chart, self._window = 0, None
        self._played, self._number = played, self._player.number

    def _go_along(self) -> None:
        """Turn the page when the clock has left the window; at once when it has come to its end."""
        clock = self._player.clock
        ended, self._played_on = self._played_on and clock.time >= clock.duration, clock.playing
        if self._window is None or not (clock.playing or ended):
            return
        start, end = self._window
        if not start <= clock.time <= end and (ended or time.monotonic() - self._turned > TURN):
            self._turned = time.monotonic()
            first = min(clock.time, clock.duration - (end - start))
            self._window = (first, first + end - start)

    def _tell_tracks(self) -> None:
        played, beside, track = self._player.played, self._player.beside, self._track
        self._known = (track, self._chart, self._window)
        if played is None or track is None:
            self._channel.tell("timeline", None)
            return
        tracks = [(played.name if beside is None else beside.names[0], track)]
        if beside is not None and self._other is not None:
            tracks.append((beside.names[1], self._other))
        shown = told(tracks, self._chart, self._player.clock.duration, self._window)
        self._channel.tell("timeline", {"kind": played.name, "speeds": SPEEDS, **shown})

    def _now(self) -> dict[str, Any]:
        player = self._player
        return {
            "time": player.clock.time,
            "playing": player.clock.playing,
            "speed": player.speed,
            "following": player.following,
        }

    def _scrub(self, value: Any, _: int) -> None:
        if self._player.played is not None and _is_number(value):
            self._player.scrub_to(float(value))

    def _step(self, value: Any, _: int) -> None:
        if self._track is not None and _is_number(value) and abs(value) <= _MOST_STEPS:
            self._player.scrub_to(self._track.step_from(self._player.clock.time, int(value)))

    def _play(self, value: Any, _: int) -> None:
        if self._player.played is not None and isinstance(value, bool) and value != self._player.clock.playing:
            self._player.toggle()

    def _speed(self, value: Any, _: int) -> None:
        if _is_number(value) and value in SPEEDS:
            self._player.speed = float(value)

    def _follow(self, value: Any, _: int) -> None:
        if isinstance(value, bool):
            (self._player.follow if value else self._player.leave)()

    def _choose(self, value: Any, _: int) -> None:
        if self._track is not None and type(value) is int and 0 <= value < len(self._track.charts):
            self._chart = value

    def _look(self, value: Any, _: int) -> None:
        duration = self._player.clock.duration
        if value is None:
            self._window = None
        elif isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)):
            start, end = max(float(value[0]), 0.0), min(float(value[1]), duration)
            if end - start >= NARROWEST * duration > 0.0:
                self._window = None if (start, end) == (0.0, duration) else (start, end)

    def _point(self, value: Any, _: int) -> None:
        self._cable = value if type(value) is int and value >= 0 else None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300 and isfinite(value)

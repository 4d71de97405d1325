"""The panel of a run or a simulation: its clock, and what there is over time with a cursor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from sagline.viewer.played import Played
from sagline.viewer.timeline import Timeline

_SPEEDS = {"¼ ×": 0.25, "1 ×": 1.0, "4 ×": 4.0, "16 ×": 16.0}
_STEPS = 2000  # of the time slider


class RunPanel:
    """Follow, play, scrub; the values are read by whoever draws."""

    def __init__(
        self, server: viser.ViserServer, played: Played, changed: Callable[[], None], toggled: Callable[[], None]
    ) -> None:
        """Build the panel; `changed` is called when a value changes, `toggled` when play or pause is pressed."""
        self._figures = played.figures()
        self._key = played.key()
        gui = server.gui
        self._folder = gui.add_folder(played.name.capitalize(), order=-1.0)
        with self._folder:
            # Any: mypy takes the values that viser lets one set for read-only
            self._follow: Any = gui.add_checkbox(
                f"Follow the {played.name}", True, hint=f"Dragging the platform leaves the {played.name}."
            )
            self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
            self._time: Any = gui.add_slider("Time [s]", 0.0, played.duration, played.duration / _STEPS, 0.0)
            self._speed = gui.add_dropdown("Speed", tuple(_SPEEDS), initial_value="1 ×")
            self._course = gui.add_html(self._drawn(0.0))
        for handle in (self._follow, self._time):
            handle.on_update(lambda event: changed() if event.client is not None else None)
        self._play.on_click(lambda _: toggled())

    @property
    def following(self) -> bool:
        """Whether what is played is shown, and not a pose of one's own."""
        return bool(self._follow.value)

    @property
    def time(self) -> float:
        """Where the slider is [s]."""
        return float(self._time.value)

    @property
    def speed(self) -> float:
        """Time of what is played a second."""
        return _SPEEDS.get(self._speed.value, 1.0)

    def leave(self) -> None:
        """Stop following."""
        self._follow.value = False

    def join(self) -> None:
        """Follow again."""
        self._follow.value = True

    def show(self, timeline: Timeline) -> None:
        """Move slider and cursors, and name the button by what it would do."""
        self._time.value = timeline.time
        self._course.content = self._drawn(timeline.time)
        self._play.label = "Pause" if timeline.playing else "Play"
        self._play.icon = viser.Icon.PLAYER_PAUSE if timeline.playing else viser.Icon.PLAYER_PLAY

    def extend(self, played: Played) -> None:
        """Have more of the same."""
        self._figures, self._key = played.figures(), played.key()
        self._time.max, self._time.step = played.duration, played.duration / _STEPS

    def remove(self) -> None:
        """Take the panel away."""
        self._folder.remove()

    def _drawn(self, time: float) -> str:
        return "".join(figure.at(time) for figure in self._figures) + self._key

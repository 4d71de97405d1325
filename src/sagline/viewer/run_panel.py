"""The panel of a run: its clock, and its tensions and lengths over time with a cursor."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import viser

from sagline.robot.robot import Robot
from sagline.viewer.course_figure import CourseFigure, Limit
from sagline.viewer.readout import block, force_unit
from sagline.viewer.run import Run
from sagline.viewer.stage import ACTUAL, WANTED
from sagline.viewer.timeline import Timeline

_SPEEDS = {"¼ ×": 0.25, "1 ×": 1.0, "4 ×": 4.0, "16 ×": 16.0}
_STEPS = 2000  # of the time slider


class RunPanel:
    """Follow, play, scrub; the values are read by whoever draws."""

    def __init__(
        self, server: viser.ViserServer, run: Run, changed: Callable[[], None], toggled: Callable[[], None]
    ) -> None:
        """Build the panel; `changed` is called when a value changes, `toggled` when play or pause is pressed."""
        lengths = run.plan.unstrained_length
        self._tensions = _tensions(run)
        self._lengths = CourseFigure.of("Unstrained length [m]", run.time, lengths)
        self._key = CourseFigure.key(lengths.shape[-1]) + block(
            f"path &nbsp;{_stroke(WANTED)} desired {_stroke(ACTUAL)} actual"
        )
        gui = server.gui
        with gui.add_folder("Run", order=-1.0):
            # Any: mypy takes the values that viser lets one set for read-only
            self._follow: Any = gui.add_checkbox("Follow the run", True, hint="Dragging the platform leaves the run.")
            self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
            self._time: Any = gui.add_slider("Time [s]", 0.0, run.duration, run.duration / _STEPS, 0.0)
            self._speed = gui.add_dropdown("Speed", tuple(_SPEEDS), initial_value="1 ×")
            self._course = gui.add_html(self._drawn(0.0))
        for handle in (self._follow, self._time):
            handle.on_update(lambda event: changed() if event.client is not None else None)
        self._play.on_click(lambda _: toggled())

    @property
    def following(self) -> bool:
        """Whether the run is shown, and not a pose of one's own."""
        return bool(self._follow.value)

    @property
    def time(self) -> float:
        """Where the slider is [s]."""
        return float(self._time.value)

    @property
    def speed(self) -> float:
        """Time of the run a second."""
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

    def _drawn(self, time: float) -> str:
        return self._tensions.at(time) + self._lengths.at(time) + self._key


def _tensions(run: Run) -> CourseFigure:
    """The tensions that are limited, with their limits."""
    state = run.plan.state
    robot, unit = state.one_robot, force_unit(state.one_robot)
    name = "Chord tension" if robot.tension_limits_of == "chord" else "Tension at the winch"
    return CourseFigure.of(
        f"{name} [{unit.name}]", run.time, state.limited_tension / unit.newtons, _limits(robot, unit.newtons)
    )


def _limits(robot: Robot, newtons: float) -> tuple[Limit, ...]:
    """The limits that all cables keep, in a unit [N]; where they differ, the first that one may reach."""
    low, high = float(robot.tension_min.max()), float(robot.tension_max.min())
    lower = (Limit(low / newtons, "lowest allowed"),) if low > 0.0 else ()
    upper = (Limit(high / newtons, "highest allowed"),) if isfinite(high) else ()
    return lower + upper


def _stroke(color: tuple[int, int, int]) -> str:
    return f'<span class="stroke" style="border-color:rgb{color}"></span>'

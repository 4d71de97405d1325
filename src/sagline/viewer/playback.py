"""A simulation as a timeline plays it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.simulation import Simulation
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.moment import Moment
from sagline.viewer.moment_words import happened
from sagline.viewer.stage import ACTUAL
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.timeline_spans import outside
from sagline.viewer.timeline_track import Chart, Mark, Track, cable_names, tension_limits

FAILURES: Final = ("break", "stall", "slack", "saturate")  # of what can happen


@dataclass(frozen=True, slots=True, eq=False)
class Playback:
    """A simulation of N samples, from time 0 on.

    Attributes:
        simulation: The simulation.
    """

    simulation: Simulation

    name = "simulation"
    still = "A simulation is what it was started as; drag the platform to ask what if."

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.simulation.robot

    @property
    def home(self) -> Pose:
        """Where it begins."""
        return self.simulation.pose[0]

    @property
    def time(self) -> Array:
        """Of the samples, from 0 on [s], shape (N,)."""
        return np.asarray(self.simulation.time - self.simulation.time[0])

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def sight(self, time: float) -> Moment:
        """The sample at or before a time [s]."""
        index = int(np.searchsorted(self.time, time, side="right")) - 1
        return Moment(self.simulation, min(max(index, 0), self.time.size - 1))

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """No desired positions, and the actual ones (n, 3), n <= most."""
        rows = np.unique(np.linspace(0, self.time.size - 1, most).astype(np.intp))
        actual = self.simulation.pose.position[rows]
        return np.full_like(actual, np.nan), actual

    def track(self) -> Track:
        """Tensions at the frame ends, how far the platform is from where it began, and what happened."""
        simulation, robot, unit = self.simulation, self.robot, force_unit(self.robot)
        limits = tension_limits(robot, unit.newtons, at="frame_end")
        held = self._held()
        cables = cable_names(robot)
        tension = Chart(
            "Tension at the winch", unit.name, unit.decimals, cables, lambda rows: held[rows] / unit.newtons, limits
        )
        position = simulation.pose.position
        away = Chart(
            "Motion along x, y, z", "mm", 1, ("x", "y", "z"), lambda rows: 1e3 * (position[rows] - position[0])
        )
        began = float(simulation.time[0])
        marks = tuple(
            Mark(event.time - began, happened(event, unit), bad=event.kind in FAILURES) for event in simulation.events
        )
        spans = outside(robot, self.time, held, unit)
        return Track(self.time, (tension, away), spans, marks, (("actual", ACTUAL),))

    def _held(self) -> Array:
        """The tensions, of broken cables until they broke (N, m)."""
        simulation, held = self.simulation, self.simulation.tensions.copy()
        for event in simulation.events:
            if event.kind == "break":
                held[simulation.time >= event.time, event.cable] = np.nan
        return held

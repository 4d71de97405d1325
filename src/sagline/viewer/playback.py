"""A simulation as a timeline plays it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.arrays import Array
from sagline.dynamics.simulation import Simulation
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.course_figure import CourseFigure
from sagline.viewer.moment import Moment
from sagline.viewer.readout import block, force_unit
from sagline.viewer.stage import ACTUAL, stroke


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

    def figures(self) -> tuple[CourseFigure, ...]:
        """Tensions at the frame ends, and how far the platform is from where it began."""
        unit = force_unit(self.robot)
        away = 1e3 * (self.simulation.pose.position - self.simulation.pose.position[0])
        return (
            CourseFigure.of(f"Tension at the winch [{unit.name}]", self.time, self.simulation.tensions / unit.newtons),
            CourseFigure.of("Motion along x, y, z [mm]", self.time, away),
        )

    def key(self) -> str:
        """Which line is which cable."""
        count = self.robot.cable_count
        path = block(f"path &nbsp;{stroke(ACTUAL)} actual")
        return CourseFigure.key(range(count)) + CourseFigure.key("xyz", "motion along") + path

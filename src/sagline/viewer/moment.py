"""One moment of a simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.simulation import Occurrence, Simulation
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import Drawn


@dataclass(frozen=True, slots=True, eq=False)
class Moment(Drawn):
    """A robot in motion.

    Attributes:
        simulation: The simulation.
        index: Number of the sample.
    """

    simulation: Simulation
    index: int

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.simulation.robot

    @property
    def pose(self) -> Pose:
        """Where the platform is."""
        return self.simulation.pose[self.index]

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self.simulation.time[self.index] - self.simulation.time[0])

    @property
    def past(self) -> tuple[Occurrence, ...]:
        """What has happened."""
        now = float(self.simulation.time[self.index])
        return tuple(event for event in self.simulation.events if event.time <= now)

    @property
    def broken(self) -> list[int]:
        """Cables that have broken."""
        return [event.cable for event in self.past if event.kind == "break" and event.cable is not None]

    @property
    def tension(self) -> Array:
        """Tensions at the frame ends [N], shape (m,); NaN of a broken cable."""
        tension: Array = self.simulation.tensions[self.index].copy()
        tension[self.broken] = np.nan
        return tension

    @property
    def length(self) -> Array:
        """Unstrained lengths off the drums [m], shape (m,)."""
        return np.asarray(self.simulation.length[self.index])

    @property
    def nodes(self) -> Array | None:
        """Positions of the cables at their nodes [m], shape (m, P, 3); None of cables without."""
        return None if self.simulation.nodes is None else np.asarray(self.simulation.nodes[self.index])

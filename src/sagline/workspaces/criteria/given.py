"""What criteria judge: poses, their margins, and the cables of those that can be held."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod


class Given:
    """Poses of a robot as criteria look at them.

    Tensions are worked out once, on first use, for the poses that the margin says can be held; they balance one
    wrench, the middle of the set that the margin is of.

    Attributes:
        robot: The robot.
        model: Cable model.
        tension: How the load is shared.
        wrench: The middle of the wrench set, shape (6,).
        pose: The poses, a batch of N.
        margin: Their margins [N], shape (N,), < 0 where they cannot be held.
        cable: The cables that limit the margins, -1 for none, shape (N,).
    """

    def __init__(
        self,
        robot: Robot,
        model: CableModel,
        tension: TensionMethod,
        wrench: Array,
        rows: Array,
        margin: Array,
        cable: Indices,
    ) -> None:
        """Keep them.

        Args:
            robot: The robot.
            model: Cable model.
            tension: How the load is shared.
            wrench: The middle of the wrench set, shape (6,).
            rows: Positions and quaternions, shape (N, 7).
            margin: Of the poses [N], shape (N,).
            cable: That limits each, shape (N,).
        """
        self.robot, self.model, self.tension, self.wrench = robot, model, tension, wrench
        self.pose = Pose._adopt(rows[:, :3], rows[:, 3:])
        self.margin, self.cable = margin, cable

    def __len__(self) -> int:
        """How many poses there are."""
        return len(self.margin)

    @cached_property
    def held(self) -> Flags:
        """Whether the cables can hold the platform, by the margin, shape (N,)."""
        return np.asarray(self.margin >= 0.0)

    @cached_property
    def plan(self) -> Plan:
        """Tensions and lengths at the poses that are held, a batch of as many."""
        return self.planned(self.model)

    def planned(self, model: CableModel) -> Plan:
        """The same with a cable model of one's own.

        Args:
            model: The model.

        Returns:
            A plan of the poses that are held.
        """
        return inverse(self.robot, self.pose[self.held], model, self.tension, self.wrench)

    @property
    def state(self) -> Equilibrium:
        """The robot at the poses that are held."""
        return self.plan.state

    def spread(self, values: Array) -> Array:
        """Values of the poses that are held as values of all, NaN at the others.

        Args:
            values: Shape (K,), one a pose that is held.

        Returns:
            Shape (N,).
        """
        found = np.full(len(self), np.nan)
        found[self.held] = values
        return locked(found)

    def spread_cables(self, cables: Indices) -> Indices:
        """Indices of cables likewise, -1 at the others.

        Args:
            cables: Shape (K,).

        Returns:
            Shape (N,).
        """
        found = np.full(len(self), -1)
        found[self.held] = cables
        return locked(found)

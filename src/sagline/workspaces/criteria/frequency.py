"""How fast the platform swings on its cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sagline.core.arrays import number
from sagline.robot.robot import Robot
from sagline.statics.stiffness import modes
from sagline.workspaces.criteria.criterion import Criterion, Judged, no_cable
from sagline.workspaces.criteria.given import Given


@dataclass(frozen=True, slots=True, eq=False)
class LeastFrequency(Criterion):
    """The platform swings no slower than this on cables whose own mass does not swing, as by `modes`.

    Under the middle load of the set; 0 Hz where it is in no stable equilibrium.

    Attributes:
        limit: Least natural frequency [Hz], > 0.
    """

    title: ClassVar[str] = "frequency"
    unit: ClassVar[str] = "Hz"
    sense: ClassVar[str] = "≥"
    needs_tensions: ClassVar[bool] = True
    limit: float

    def __post_init__(self) -> None:
        """Check the limit."""
        object.__setattr__(self, "limit", number(self.limit, "LeastFrequency: limit", "Hz", above=0.0))

    def judge(self, given: Given) -> Judged:
        """What there is above the limit [Hz]."""
        lowest = modes(given.state).frequency[:, 0]
        falling = np.isnan(lowest) & given.plan.feasible
        return Judged(given.spread(np.where(falling, 0.0, lowest) - self.limit), no_cable(len(given)))

    def scale(self, robot: Robot) -> float:
        """The limit [Hz]."""
        return self.limit

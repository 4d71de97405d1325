"""Where a platform goes on exact cables that were wound to the lengths of a simpler model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arguments import instance
from sagline.core.arrays import number
from sagline.kinematics.confirm import confirm
from sagline.robot.robot import Robot
from sagline.workspaces.criteria.criterion import Criterion, Judged, no_cable
from sagline.workspaces.criteria.given import Given


@dataclass(frozen=True, slots=True, eq=False)
class PositionError(Criterion):
    """A simpler cable model is good enough: the platform is no further from its place than this.

    The lengths are those of the model, with its tensions, under the middle load of the set; the platform then rests
    where exact cables of these lengths balance it, as by `confirm`.

    Attributes:
        model: The cable model, `Straight()` for instance.
        limit: Largest distance between the platform origin and where it was planned [m], > 0.
    """

    title: ClassVar[str] = "position error"
    unit: ClassVar[str] = "m"
    sense: ClassVar[str] = "≤"
    needs_tensions: ClassVar[bool] = True
    model: CableModel
    limit: float

    def __post_init__(self) -> None:
        """Check both."""
        instance(self.model, CableModel, "PositionError: model")
        object.__setattr__(self, "limit", number(self.limit, "PositionError: limit", "m", above=0.0))

    def __str__(self) -> str:
        """With the model."""
        return f"{super(PositionError, self).__str__()} with {type(self.model).__name__}"

    def judge(self, given: Given) -> Judged:
        """What is left up to the limit [m]; NaN where the model has no lengths, or they hold nothing."""
        found = confirm(given.planned(self.model))
        error = np.where(found.held, np.linalg.norm(found.position_error, axis=1), np.nan)
        return Judged(given.spread(self.limit - error), no_cable(len(given)))

    def scale(self, robot: Robot) -> float:
        """The limit [m]."""
        return self.limit

"""The margin of the loads, with a reserve if wanted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.core.arrays import locked, number
from sagline.robot.robot import Robot
from sagline.workspaces.criteria.criterion import Criterion, Judged
from sagline.workspaces.criteria.given import Given


@dataclass(frozen=True, slots=True, eq=False)
class LeastMargin(Criterion):
    """The cables hold every wrench of the set, and so much more in any direction.

    Every workspace has it with no reserve: `workspace` puts it first.

    Attributes:
        limit: Reserve [N], >= 0.
    """

    title: ClassVar[str] = "margin"
    unit: ClassVar[str] = "N"
    sense: ClassVar[str] = "≥"
    limit: float = 0.0

    def __post_init__(self) -> None:
        """Check the limit."""
        object.__setattr__(self, "limit", number(self.limit, "LeastMargin: limit", "N", low=0.0))

    @property
    def always(self) -> bool:
        """Without a reserve every workspace has it."""
        return self.limit == 0.0

    def judge(self, given: Given) -> Judged:
        """Margins above the reserve [N], and the cables that limit them."""
        return Judged(locked(given.margin - self.limit), given.cable)

    def scale(self, robot: Robot) -> float:
        """The platform's weight; without gravity the strongest pull of a cable [N]."""
        weight = robot.mass * robot.gravity
        if weight > 0.0:
            return weight
        strongest = robot.tension_max[robot.tension_max < float("inf")]
        return float(strongest.max(initial=0.0)) or float(robot.tension_min.max()) or 1.0

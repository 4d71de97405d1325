"""How far cables hang below their chords."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.core.arrays import number
from sagline.robot.robot import Robot
from sagline.workspaces.criteria.criterion import Criterion, Judged
from sagline.workspaces.criteria.given import Given


@dataclass(frozen=True, slots=True, eq=False)
class MaximumSag(Criterion):
    """No cable hangs further below its chord than this, under the middle load of the set.

    Attributes:
        limit: Largest sag [m], > 0.
    """

    title: ClassVar[str] = "sag"
    unit: ClassVar[str] = "m"
    sense: ClassVar[str] = "≤"
    needs_tensions: ClassVar[bool] = True
    limit: float

    def __post_init__(self) -> None:
        """Check the limit."""
        object.__setattr__(self, "limit", number(self.limit, "MaximumSag: limit", "m", above=0.0))

    def judge(self, given: Given) -> Judged:
        """What is left up to the limit [m], and the cable that hangs deepest."""
        sag = given.state.cables.sag
        return Judged(given.spread(self.limit - sag.max(axis=1)), given.spread_cables(sag.argmax(axis=1)))

    def scale(self, robot: Robot) -> float:
        """The limit [m]."""
        return self.limit

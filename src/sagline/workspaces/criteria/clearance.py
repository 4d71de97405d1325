"""How far cables and platform stay from each other and from what stands around."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Final

import numpy as np

from sagline.core.arguments import brief
from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError
from sagline.interference.clearance import check_obstacles
from sagline.interference.clearance_rows import ClearanceRows
from sagline.interference.pairs import Obstacle
from sagline.robot.robot import Robot
from sagline.workspaces.criteria.criterion import Criterion, Judged
from sagline.workspaces.criteria.given import Given

_PRECISION: Final = 1e-6  # m: by no more may the level jump from pose to pose
_CABLE: Final = re.compile(r"cable (\d+)")


@dataclass(frozen=True, slots=True, eq=False)
class Clearance(Criterion):
    """Nothing comes nearer than this: no two cables, no cable and platform, none of them and an obstacle.

    Cables as they hang, under the middle load of the set; what is measured against what: see `clearance`.

    Attributes:
        limit: Least distance [m], > 0.
        obstacles: What stands around, Box, Capsule, Sphere and Mesh, one or several.
    """

    title: ClassVar[str] = "clearance"
    unit: ClassVar[str] = "m"
    sense: ClassVar[str] = "≥"
    needs_tensions: ClassVar[bool] = True
    limit: float
    obstacles: Obstacle | Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        """Check both."""
        object.__setattr__(self, "limit", number(self.limit, "Clearance: limit", "m", above=0.0))
        given: Any = self.obstacles
        several = (given,) if isinstance(given, Obstacle) else given
        listed = isinstance(several, list | tuple)
        if wrong := [each for each in several if not isinstance(each, Obstacle)] if listed else [given]:
            step = 'Make them: Sphere(center, radius), Box(size, center), load_mesh("hall.stl").'
            allowed = "Box, Capsule, Sphere or Mesh, one or several"
            raise InvalidValueError("Clearance: obstacles", brief(wrong[0]), allowed, step)
        object.__setattr__(self, "obstacles", tuple(several))

    def judge(self, given: Given) -> Judged:
        """Least distance above the limit [m], and the cable, or the first of two, that is nearest to something."""
        rows = _rows(given.robot, self.obstacles)
        value, pair = rows.least(given.state)
        cables = np.array([*map(_cable_of, rows.pairs.names), -1])
        return Judged(given.spread(value - self.limit), given.spread_cables(cables[pair]))

    def scale(self, robot: Robot) -> float:
        """The limit [m]."""
        return self.limit


@lru_cache(maxsize=4)
def _rows(robot: Robot, obstacles: Obstacle | Sequence[Obstacle]) -> ClearanceRows:
    """What is measured, made ready once for all poses of a robot, after the arguments are checked."""
    checked = check_obstacles(obstacles, robot)
    return ClearanceRows(robot, checked, precision=_PRECISION)


def _cable_of(pair: tuple[str, str]) -> int:
    """The first cable of a pair of names; -1 where there is none."""
    return next((int(found[1]) for name in pair if (found := _CABLE.fullmatch(name))), -1)

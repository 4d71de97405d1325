"""Whether the whole platform is within the frame."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Final

import numpy as np

from sagline.core.arrays import Array, locked, number
from sagline.robot.bounds import bounds
from sagline.robot.robot import Robot
from sagline.workspaces.criteria.criterion import Criterion, Judged, no_cable
from sagline.workspaces.criteria.given import Given

_CORNERS: Final = 0.5 * np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class InFrame(Criterion):
    """The platform's box and anchors stay within the frame's, this far from its faces.

    The frame is the robot's frame_size, or what its anchors span down to the floor. Of a planar robot its plane counts.

    Attributes:
        limit: Least distance from the faces [m], >= 0.
    """

    title: ClassVar[str] = "frame"
    unit: ClassVar[str] = "m"
    sense: ClassVar[str] = "≥"
    limit: float = 0.0

    def __post_init__(self) -> None:
        """Check the limit."""
        object.__setattr__(self, "limit", number(self.limit, "InFrame: limit", "m", low=0.0))

    def judge(self, given: Given) -> Judged:
        """Least distance of a corner from the faces, above the limit [m]."""
        robot = given.robot
        low, high = bounds(robot)
        axes = np.arange(3) if robot.plane_normal is None else np.flatnonzero(np.abs(robot.plane_normal) < 0.5)
        corners = given.pose.transform(_points(robot))[..., axes]
        room = np.minimum(corners - low[axes], high[axes] - corners).min(axis=(1, 2))
        return Judged(locked(room - self.limit), no_cable(len(given)))

    def scale(self, robot: Robot) -> float:
        """A tenth of the frame's least edge that is not flat [m]."""
        low, high = bounds(robot)
        edges = (high - low)[high > low]
        return 0.1 * float(edges.min(initial=np.inf)) if edges.size else 1.0


def _points(robot: Robot) -> Array:
    """Anchors and corners of the platform in its own frame, shape (k, 3)."""
    if robot.platform_size is None:
        return robot.platform_anchors
    return np.vstack((robot.platform_anchors, _CORNERS * robot.platform_size))

"""How stiffly the cables hold the platform."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sagline.core.arrays import Array, number
from sagline.robot.robot import Robot
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import compliance_of
from sagline.workspaces.criteria.criterion import Criterion, Judged, no_cable
from sagline.workspaces.criteria.given import Given


@dataclass(frozen=True, slots=True, eq=False)
class LeastStiffness(Criterion):
    """A force on the center of mass moves it by no more than force over this, whatever its direction.

    The stiffness of the softest direction, with lengths held and the platform free to turn as it gives way; 0 where
    the platform is in no stable equilibrium. Under the middle load of the set.

    Attributes:
        limit: Least stiffness [N/m], > 0.
    """

    title: ClassVar[str] = "stiffness"
    unit: ClassVar[str] = "N/m"
    sense: ClassVar[str] = "≥"
    needs_tensions: ClassVar[bool] = True
    limit: float

    def __post_init__(self) -> None:
        """Check the limit."""
        object.__setattr__(self, "limit", number(self.limit, "LeastStiffness: limit", "N/m", above=0.0))

    def judge(self, given: Given) -> Judged:
        """What there is above the limit [N/m]."""
        freedom = given.robot.freedom
        found = softest(freedom, cable_slopes(given.state).matrix)
        return Judged(given.spread(found - self.limit), no_cable(len(given)))

    def scale(self, robot: Robot) -> float:
        """The limit [N/m]."""
        return self.limit


def softest(freedom: Array, matrix: Array) -> Array:
    """Force on the center of mass over how far it gives way, in the direction where that is least.

    Args:
        freedom: Free motions, shape (n, 6).
        matrix: Stiffness of the platform in world axes, shape (N, 6, 6).

    Returns:
        [N/m], shape (N,): 0 where nothing holds it, NaN for a matrix with NaN.
    """
    lost = np.asarray(np.isnan(matrix).any(axis=(1, 2)))
    own = freedom @ np.where(lost[:, None, None], np.eye(6), matrix) @ freedom.T
    own = 0.5 * (own + np.swapaxes(own, 1, 2))
    size = np.sqrt(np.abs(np.einsum("kii->ki", own)))
    size[size == 0.0] = 1.0
    balanced = own / (size[:, :, None] * size[:, None, :])  # newtons and newton meters alike
    stable = np.linalg.eigvalsh(balanced)[:, 0] > 0.0
    compliance = compliance_of(freedom, matrix)[:, :3, :3]
    known = np.asarray(stable & ~np.isnan(compliance).any(axis=(1, 2)))
    given = np.where(known[:, None, None], compliance, np.eye(3))
    largest = np.linalg.eigvalsh(0.5 * (given + np.swapaxes(given, 1, 2)))[:, -1]
    return np.where(lost, np.nan, np.where(known, 1.0 / largest, 0.0))

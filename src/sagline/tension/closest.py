"""Closest: the feasible tensions nearest to those of the pose before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod
from sagline.tension.minimum_norm import MinimumNorm


@dataclass(frozen=True, slots=True)
class Closest(TensionMethod):
    """The article's choice (55): nearest to the previous tension set, by projection onto the feasible polygon.

    Follows a path smoothly, and depends on it: the first pose takes the minimum norm, and after a gap of
    infeasible poses the last feasible set is the reference. In a batch of poses every pose stands alone.
    Choose it for the smoothest tensions along one path.

    Source:
        Gia Luan & Truong Thinh 2020, (55); the projection is derived in docs/model.md, section 5.
    """

    code: ClassVar[int] = codes.CLOSEST

    @property
    def alone(self) -> TensionMethod:
        """The minimum norm."""
        return MinimumNorm(self.variable, self.lowest_point_margin)

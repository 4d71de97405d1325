"""Polygon walk: the optimum among the corners met by walking around the feasible polygon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from sagline.core.arguments import choice
from sagline.kernels import codes
from sagline.kernels.sharing.on_polygon import WALK_CENTROID, WALK_NORM, WALK_SUM
from sagline.tension.method import TensionMethod

Optimum = Literal["1-norm", "2-norm", "centroid"]
_OPTIMA = {"1-norm": WALK_SUM, "2-norm": WALK_NORM, "centroid": WALK_CENTROID}


@dataclass(frozen=True, slots=True)
class PolygonWalk(TensionMethod):
    """The algorithm for n + 2 cables: walk around the feasible polygon, take its best point.

    Its answers are those of `LowestSum`, `MinimumNorm` and `Centroid`, which cut the polygon instead and are quicker.
    Choose it to compare with that algorithm as published.

    Attributes:
        optimum: "1-norm", "2-norm" (default) or "centroid".

    Source:
        Gouttefarde, Lamaury, Reichert & Bruckmann 2015, "A versatile tension distribution algorithm for n-DOF parallel
        robots driven by n + 2 cables".
    """

    code: ClassVar[int] = codes.POLYGON_WALK
    needs_upper_limits: ClassVar[bool] = True
    most_redundant: ClassVar[int | None] = 2
    optimum: Optimum = "2-norm"

    def __post_init__(self) -> None:
        """Check the options."""
        TensionMethod.__post_init__(self)
        object.__setattr__(self, "optimum", choice(self.optimum, "optimum", _OPTIMA))

    @property
    def parameter(self) -> float:
        """Which optimum."""
        return _OPTIMA[self.optimum]

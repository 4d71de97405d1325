"""Analytic center: as far from all limits as their product allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class AnalyticCenter(TensionMethod):
    """The feasible tensions with the largest product of distances to all limits.

    Smooth wherever the feasible set has an inside: no limit ever becomes active. Near the border of the workspace,
    where the set shrinks to a point, it follows. Any number of redundant cables; the same point in every variable.
    Choose it for controllers that want differentiable tensions. A set without end has no center: UNBOUNDED.

    Source:
        Di Paola, Goldsztejn, Zoso & Caro 2023, "Analytic center based tension distribution for cable-driven
        platforms".
    """

    code: ClassVar[int] = codes.ANALYTIC_CENTER

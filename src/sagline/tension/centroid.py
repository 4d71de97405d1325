"""Centroid: the middle of the feasible polygon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class Centroid(TensionMethod):
    """The centroid of the feasible polygon, the barycenter; the middle of the interval for one redundant cable.

    Continuous, and far from all limits, so that slack and overload are far too; costs more tension than needed. The
    same point in every variable. For more than two redundant cables take `AnalyticCenter`. Choose it for a stiff,
    robust setup where energy does not count. A set without end has no centroid: the pose is UNBOUNDED.

    Source:
        Mikelsons, Bruckmann, Hiller & Schramm 2008, "A real-time capable force calculation algorithm for redundant
        tendon-based parallel manipulators"; Lamaury & Gouttefarde 2013.
    """

    code: ClassVar[int] = codes.CENTROID
    most_redundant: ClassVar[int | None] = 2

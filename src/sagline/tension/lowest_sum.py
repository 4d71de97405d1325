"""Lowest sum: the feasible tensions of least sum, a linear program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class LowestSum(TensionMethod):
    """The feasible tensions of least 1-norm: a corner of the feasible set.

    The least motor torque in all; as many cables as are redundant stay at their limits. The corner jumps to another
    one where the path turns the polygon, so the tensions are not continuous. Where a whole side is lowest, its point
    of least norm is taken (for more than two redundant cables, one of its corners). Choose it for static loads.

    Source:
        Borgstrom, Jordan, Sukhatme, Batalin & Kaiser 2009, "Rapid computation of optimally safe tension
        distributions for parallel cable-driven robots"; Lamaury & Gouttefarde 2013.
    """

    code: ClassVar[int] = codes.LOWEST_SUM

"""Lowest maximum: the feasible tensions whose largest is least."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class LowestMaximum(TensionMethod):
    """The feasible tensions of least infinity-norm; of those with the same largest tension, the ones of least norm.

    Spares the most loaded cable, and so the winches' size; continuous in its largest tension but not in the others.
    Choose it to size cables and drives; for motion take `PNorm`, which comes near it smoothly.

    Source:
        Gosselin & Grenier 2011, "On the determination of the force distribution in overconstrained cable-driven
        parallel mechanisms".
    """

    code: ClassVar[int] = codes.LOWEST_MAXIMUM

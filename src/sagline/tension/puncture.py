"""Puncture: from the minimum norm towards the middle, as far as the limits ask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class Puncture(TensionMethod):
    """Where the way from the minimum-norm solution to the (improved) closed form enters the limits.

    Low tensions at the price of a closed form; covers what `ImprovedClosedForm` covers. Choose it for low tensions on
    hardware that can afford no polygon.

    Source:
        Mueller, Reichert & Bruckmann 2015, "Analysis of a real-time capable cable force computation method".
    """

    code: ClassVar[int] = codes.PUNCTURE
    needs_upper_limits: ClassVar[bool] = True

"""Tensions that somebody has chosen by hand, by a dot in the drawing of what is feasible."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from sagline.tension.quadratic_program import QuadraticProgram

BY_HAND: Final = "chosen by hand"


@dataclass(frozen=True, slots=True, eq=False)
class ByHand(QuadraticProgram):
    """The feasible tensions nearest to those that were chosen: these themselves, where the platform was then.

    Chord tensions that balance a pose differ from those of the minimum norm by a point of the null space, and so do
    those nearest to them: with the pulls of sagging cables the former move a little, the point stays. Elsewhere the
    tensions stay as near to the chosen ones as balance and limits allow.
    """

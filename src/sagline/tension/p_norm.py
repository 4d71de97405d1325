"""p-norm: between the least sum of squares and the least maximum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.tension.method import TensionMethod

LARGEST = 32.0  # beyond, the powers of small tensions leave nothing for Newton's method to see


@dataclass(frozen=True, slots=True)
class PNorm(TensionMethod):
    """The feasible tensions of least p-norm, the p-th root of the sum of their p-th powers.

    Continuous for every p: p = 2 is `MinimumNorm`, large p comes near `LowestMaximum` without its jumps. Choose it,
    with p from 4 to 8, to spare the most loaded cable on a moving platform.

    Attributes:
        p: Exponent, 2 to 32.

    Source:
        Verhoeven 2004, "Analysis of the workspace of tendon-based Stewart platforms", ch. 5; Gosselin & Grenier 2011.
    """

    code: ClassVar[int] = codes.P_NORM
    p: float = 4.0

    def __post_init__(self) -> None:
        """Check the options."""
        TensionMethod.__post_init__(self)
        p = number(self.p, "p", "", low=2.0)
        if p > LARGEST:
            raise InvalidValueError("p", f"{p:g}", f"2 to {LARGEST:g}", "For larger p take LowestMaximum.")
        object.__setattr__(self, "p", p)

    @property
    def parameter(self) -> float:
        """The exponent."""
        return self.p

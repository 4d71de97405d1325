"""Improved closed form: hold what is violated, share the rest again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class ImprovedClosedForm(TensionMethod):
    """The closed form, but a cable that misses its limit most is held there and the rest shared again.

    As many times as there are redundant cables; covers nearly all of the feasible poses, and says NOT_COVERED for the
    others. Continuous but for changes of the held cable. Choose it where ClosedForm ends too early.

    Source:
        Pott 2014, "An improved force distribution algorithm for over-constrained cable-driven parallel robots".
    """

    code: ClassVar[int] = codes.IMPROVED_CLOSED_FORM
    needs_upper_limits: ClassVar[bool] = True

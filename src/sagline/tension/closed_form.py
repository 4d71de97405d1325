"""Closed form: the solution nearest to the middle of the limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class ClosedForm(TensionMethod):
    """The balanced tensions nearest to the middle of the limits, if they keep them.

    Linear in the wrench and smooth, but it misses part of the feasible poses: those are NOT_COVERED. Choose it where
    every microsecond counts and the platform stays in the inner workspace.

    Source:
        Pott, Bruckmann & Mikelsons 2009, "Closed-form force distribution for parallel wire robots".
    """

    code: ClassVar[int] = codes.CLOSED_FORM
    needs_upper_limits: ClassVar[bool] = True

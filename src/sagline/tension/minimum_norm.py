"""Minimum norm: the feasible tensions of least sum of squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.kernels import codes
from sagline.tension.method import TensionMethod


@dataclass(frozen=True, slots=True)
class MinimumNorm(TensionMethod):
    """The feasible tensions of least Euclidean norm: the projection of 0 onto the feasible set.

    Depends on the pose alone, so that a closed path closes; lets cables that are not needed go to their lower limits.
    Choose it for plans that repeat and for low tensions throughout.

    Source:
        Gia Luan & Truong Thinh 2020, (53); docs/model.md, section 5.
    """

    code: ClassVar[int] = codes.MINIMUM_NORM

"""The elastic cable: a weightless Hooke spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.cables.model import CableModel
from sagline.kernels import codes


@dataclass(frozen=True, slots=True)
class Elastic(CableModel):
    """A cable that stretches but has no weight: L = D/(1 + tau/EA).

    Where L >= D it is slack and carries nothing.

    Source:
        docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.ELASTIC
    weightless: ClassVar[bool] = True

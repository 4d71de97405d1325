"""The straight cable: inextensible and weightless."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.cables.model import CableModel
from sagline.kernels import codes


@dataclass(frozen=True, slots=True)
class Straight(CableModel):
    """A cable that neither stretches nor sags: L = D.

    From a length it knows no tension: the answer is NaN, and the closure residual is |L - D|.

    Source:
        docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.STRAIGHT
    weightless: ClassVar[bool] = True

"""The parabolic cable: the exact equations to first order in sag and strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.cables.model import CableModel
from sagline.kernels import codes


@dataclass(frozen=True, slots=True)
class Parabolic(CableModel):
    """A shallow cable to first order: L = D (1 + (w D cos phi)^2/(24 tau^2))/(1 + tau/EA), T_z = tau sin phi + w D/2.

    From a length: the positive root of its cubic in tau.

    Source:
        docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.PARABOLIC

"""The elastic catenary: the exact cable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.cables.model import CableModel
from sagline.kernels import codes


@dataclass(frozen=True, slots=True)
class Catenary(CableModel):
    """Irvine's elastic catenary, solved to the last digits in both directions. The default everywhere.

    Source:
        Irvine 1981, ch. 2; cancellation-free forms in docs/model.md, section 2.
    """

    code: ClassVar[int] = codes.CATENARY

"""The five cable models, and the models by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.cables.model import CableModel
from sagline.core.arguments import named
from sagline.core.arrays import number
from sagline.core.surface import ordered_classes
from sagline.kernels import codes


class Straight(CableModel):
    """Straight cable without elongation and sag: L = D.

    The length of a straight cable does not determine its tension. A state from a given length has the tension NaN and
    the closure residual |L - D|.

    Source:
        docs/model.md, section 3.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.STRAIGHT
    weightless: ClassVar[bool] = True


class Elastic(CableModel):
    """Straight elastic cable without weight: L = D/(1 + tau/EA).

    If L >= D, the cable is slack and its tension is zero.

    Source:
        docs/model.md, section 3.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.ELASTIC
    weightless: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Empirical(CableModel):
    """Empirical model of the article: T_z = tan(phi) T_x + k_h rho D, and L as a function of T_x by equation (48).

    The model is valid if the lowest point of the cable is outside the span: T_x > w D/(2 |tan phi|). Results with a
    smaller T_x have the status BELOW_VALIDITY. For a given length, the solution is on the branch of (48) on which L
    decreases with T_x.

    Attributes:
        k_h: Intercept constant [m/s^2]. The default is the published magnitude, 4.845; theory gives g/2 for a small
            sag.
        k_p: Sag constant [m^2/s^4]. The default is the published value, 4.385; theory gives g^2/24 for a small sag.

    Source:
        Gia Luan & Truong Thinh 2020, equations (21), (27), (28), (45), (48); docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.EMPIRICAL
    k_h: float = 4.845
    k_p: float = 4.385

    def __post_init__(self) -> None:
        """Check the two constants."""
        object.__setattr__(self, "k_h", number(self.k_h, "k_h", "m/s^2"))
        object.__setattr__(self, "k_p", number(self.k_p, "k_p", "m^2/s^4", low=0.0))

    @property
    def parameters(self) -> tuple[float, float]:
        """Constants k_h and k_p of the model."""
        return self.k_h, self.k_p


class Parabolic(CableModel):
    """First order in the sag: L = D (1 + (w D cos phi)^2/(24 tau^2))/(1 + tau/EA), T_z = tau sin phi + w D/2.

    If the length is given, tau is the positive root of a cubic equation.

    Source:
        docs/model.md, section 3.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.PARABOLIC


class Catenary(CableModel):
    """Elastic catenary, solved up to rounding errors for a given tension or length. The default cable model.

    Source:
        Irvine 1981, ch. 2; cancellation-free forms in docs/model.md, section 2.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.CATENARY


def models_by_name() -> dict[str, type[CableModel]]:
    """Classes of the cable models by name, in the order of `__init__.pyi`."""
    return ordered_classes("sagline.cables")


def model_of(value: CableModel | str, item: str = "model") -> CableModel:
    """Cable model `value`, or the cable model with the name `value`, such as "elastic"."""
    return named(value, CableModel, models_by_name(), item)

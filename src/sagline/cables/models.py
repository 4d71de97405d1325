"""The five cable models, and a table of all of them by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sagline.cables.model import CableModel
from sagline.core.arguments import named
from sagline.core.arrays import number
from sagline.kernels import codes


@dataclass(frozen=True, slots=True)
class Straight(CableModel):
    """A cable without elongation and sag: L = D.

    A length does not determine the tension. The tension is then NaN, and the closure residual is |L - D|.

    Source:
        docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.STRAIGHT
    weightless: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Elastic(CableModel):
    """A cable with elongation but without weight: L = D/(1 + tau/EA).

    If L >= D, the cable is slack and its tension is zero.

    Source:
        docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.ELASTIC
    weightless: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Empirical(CableModel):
    """The article's closed form: T_z = tan(phi) T_x + k_h rho D, and L as a function of T_x by equation (48).

    The model is valid if the lowest point of the cable is outside the span, T_x > w D/(2 |tan phi|). Results for
    smaller T_x have the status BELOW_VALIDITY. For a given length, T_x is on the decreasing branch of (48).

    Attributes:
        k_h: Intercept constant [m/s^2]. The default is the magnitude of the published value, 4.845; theory gives g/2
            for a shallow cable.
        k_p: Sag constant [m^2/s^4]. The default is the published value 4.385; theory gives g^2/24 for a shallow cable.

    Source:
        Gia Luan & Truong Thinh 2020, equations (21), (27), (28), (45), (48); docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.EMPIRICAL
    k_h: float = 4.845
    k_p: float = 4.385

    def __post_init__(self) -> None:
        """Check the constants."""
        object.__setattr__(self, "k_h", number(self.k_h, "k_h", "m/s^2"))
        object.__setattr__(self, "k_p", number(self.k_p, "k_p", "m^2/s^4", low=0.0))

    @property
    def parameters(self) -> tuple[float, float]:
        """k_h and k_p."""
        return self.k_h, self.k_p


@dataclass(frozen=True, slots=True)
class Parabolic(CableModel):
    """First-order shallow cable: L = D (1 + (w D cos phi)^2/(24 tau^2))/(1 + tau/EA), T_z = tau sin phi + w D/2.

    For a given length, tau is the positive root of a cubic equation.

    Source:
        docs/model.md, section 3.
    """

    code: ClassVar[int] = codes.PARABOLIC


@dataclass(frozen=True, slots=True)
class Catenary(CableModel):
    """Irvine's elastic catenary, solved to rounding error in both directions. The default cable model.

    Source:
        Irvine 1981, ch. 2; cancellation-free forms in docs/model.md, section 2.
    """

    code: ClassVar[int] = codes.CATENARY


MODELS: dict[str, type[CableModel]] = {
    model.__name__: model  # in the order of increasing accuracy
    for model in (
        Straight,
        Elastic,
        Empirical,
        Parabolic,
        Catenary,
    )
}


def model_of(value: CableModel | str, item: str = "model") -> CableModel:
    """Return a cable model unchanged. A name such as "elastic" is converted to a cable model."""
    return named(value, CableModel, MODELS, item)

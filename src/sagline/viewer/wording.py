"""How numbers and names are written: once for every panel, so that a thing has one name and a number no false sign."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, Elastic, Empirical
from sagline.tension.method import TensionMethod
from sagline.viewer.by_hand import BY_HAND, ByHand

MODEL_NAMES: dict[type[CableModel], str] = {  # those that say more than the name of their class
    Catenary: "catenary (exact)",
    Empirical: "empirical (the article's)",
    Elastic: "elastic, weightless",
}
_NONE = "–"
KILO_FROM = 1e5  # N: forces from here on are written in kilonewtons


class ForceUnit(NamedTuple):
    """How the forces of one robot are written.

    Attributes:
        name: "N" or "kN".
        newtons: One of it [N].
        form: How many decimals.
    """

    name: str
    newtons: float
    form: str

    @property
    def decimals(self) -> int:
        """How many decimals."""
        return int(self.form[1])

    @classmethod
    def up_to(cls, highest: float) -> ForceUnit:
        """The unit for forces up to a highest one [N], the same for small ones beside it."""
        return cls("N", 1.0, ".1f") if highest < KILO_FROM else cls("kN", 1e3, ".2f")

    def bare(self, force: float) -> str:
        """A force [N] without the unit."""
        return number(force / self.newtons, self.form)

    def written(self, force: float) -> str:
        """A force [N] with the unit."""
        return f"{self.bare(force)} {self.name}"


def number(value: float, form: str) -> str:
    """A number, or a dash for none; what rounds to zero has no sign."""
    if not isfinite(value):
        return _NONE
    text = f"{value:{form}}"
    return text if float(text.replace(",", "")) != 0.0 else text.removeprefix("-")


def model_name(model: CableModel) -> str:
    """What a cable model is called."""
    return MODEL_NAMES.get(type(model), type(model).__name__.lower())


def method_name(method: TensionMethod) -> str:
    """What a way of sharing the load is called, and that it remembers if it does."""
    name = BY_HAND if isinstance(method, ByHand) else type(method).__name__
    return f"{name} (remembers the way)" if remembers(method) else name


def remembers(method: TensionMethod) -> bool:
    """Whether the tensions of a pose depend on those before."""
    return method.alone is not method

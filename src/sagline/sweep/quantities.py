"""What a sweep can be asked: the variables that each quantity leaves on the disk."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from types import MappingProxyType
from typing import Final, NamedTuple

from sagline.kinematics.status import PoseStatus
from sagline.workspaces.margin_status import MarginStatus


class Variable(NamedTuple):
    """One array of a sweep; its first dimensions are robot, pose and wrench.

    Attributes:
        name: Its name.
        unit: Unit of its values, "" for none.
        long_name: What it is, in a reader's words.
        a_cable: Whether it has a value for each cable, along a fourth dimension.
        codes: The status that it holds codes of, if any.
        whole: Whether its values are whole numbers.
    """

    name: str
    unit: str
    long_name: str
    a_cable: bool = False
    codes: type[IntEnum] | None = None
    whole: bool = False

    @property
    def type(self) -> str:
        """The type of its values."""
        return "int8" if self.whole or self.codes is not None else "float64"


STATUS: Final = Variable("status", "", "how each request ended", codes=PoseStatus)
PROOF: Final = Variable("proof", "N", "proved least change of the force that makes it feasible, 0 if it is")
TENSION: Final = Variable("tension", "N", "tension along the chord, T_x / cos phi", a_cable=True)
LENGTH: Final = Variable("length", "m", "unstrained length L, all cable off the drum", a_cable=True)
ENOUGH: Final = Variable("enough", "N", "change of the force that suffices")
MARGIN: Final = Variable("margin", "N", "how much more load the pose can take, below zero how much too much it is")
LOW: Final = Variable("margin_low", "N", "lower end of the margin's bracket; feasible where it is not below zero")
HIGH: Final = Variable("margin_high", "N", "upper end of the margin's bracket; infeasible where it is below zero")
LIMITING: Final = Variable("limiting_cable", "", "cable whose limit moves the margin fastest, -1 for none", whole=True)
MARGIN_STATUS: Final = Variable("margin_status", "", "what the margin's bracket says", codes=MarginStatus)

QUANTITIES: Final = MappingProxyType(
    {
        "tension": (STATUS, PROOF, TENSION),
        "length": (STATUS, PROOF, LENGTH),
        "shortfall": (STATUS, PROOF, ENOUGH),
        "margin": (MARGIN_STATUS, MARGIN, LOW, HIGH, LIMITING),
    }
)


def variables_of(quantities: Iterable[str]) -> tuple[Variable, ...]:
    """The variables of some quantities, each once.

    Args:
        quantities: Names of QUANTITIES.

    Returns:
        The variables, in the order of the quantities.
    """
    return tuple(dict.fromkeys(variable for name in quantities for variable in QUANTITIES[name]))

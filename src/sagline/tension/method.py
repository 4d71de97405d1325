"""What every method of sharing the load has in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

from sagline.arrays import checked
from sagline.errors import InvalidValueError
from sagline.kernels import codes

Variable = Literal["chord", "horizontal"]
_VARIABLES = {"chord": codes.CHORD_TENSION, "horizontal": codes.HORIZONTAL_TENSION}


@dataclass(frozen=True, slots=True)
class TensionMethod:
    """A way of choosing among the feasible tensions: a code that the kernels understand, and its options.

    Attributes:
        code: Which choice the kernels make (`sagline.kernels.codes`).
        variable: The tension in which the choice is made: "chord" (default) or "horizontal", the article's T_x.
            Their minimum-norm answers differ.
        lowest_point_margin: The article's T_adj of (54) [N]: bounds T_x below by w D/(2 |tan phi|) + T_adj, which
            keeps the lowest point of each cable outside its span. None (default) leaves the bound out.
    """

    code: ClassVar[int]
    variable: Variable = "chord"
    lowest_point_margin: float | None = None

    def __post_init__(self) -> None:
        """Check the options."""
        if self.variable not in _VARIABLES:
            allowed = " or ".join(get_args(Variable))
            raise InvalidValueError("variable", repr(self.variable), allowed, "Name the tension to share the load in.")
        if self.lowest_point_margin is not None:
            checked(self.lowest_point_margin, "lowest_point_margin", "N", low=0.0)

    @property
    def alone(self) -> TensionMethod:
        """The method for a pose that has no pose before it; methods without memory stay what they are."""
        return self

    @property
    def variable_code(self) -> int:
        """The variable as kernels know it."""
        return _VARIABLES[self.variable]

    @property
    def validity(self) -> float:
        """T_adj as kernels know it: NaN for none."""
        return float("nan") if self.lowest_point_margin is None else float(self.lowest_point_margin)

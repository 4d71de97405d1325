"""Tension limits that may change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arguments import choice
from sagline.core.arrays import Array, Indices, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import tables
from sagline.optimization.free import Bound, Free, Part, cable_numbers, cables_of_robot, check_order, whose_text
from sagline.robot.robot import Robot

LIMITS: Final = {"tension_min": tables.TENSION_MIN, "tension_max": tables.TENSION_MAX}


@dataclass(frozen=True, slots=True, eq=False)
class FreeLimit(Free):
    """A tension limit that may change, the same for all cables of it.

    Attributes:
        which: "tension_min" or "tension_max".
        low: Least [N], >= 0.
        high: Largest [N].
        cables: Whose limit, numbers from 0; empty for all.
    """

    which: str
    low: float
    high: float
    cables: tuple[int, ...]

    def __init__(self, which: str, low: float, high: float, *, cables: Sequence[int] | None = None) -> None:
        """Check them.

        Args:
            which: "tension_min" or "tension_max".
            low: Least [N], >= 0.
            high: Largest [N].
            cables: Whose, numbers from 0; None for all.

        Raises:
            InvalidValueError: If low is not below high, or an argument is of the wrong kind.

        Examples:
            >>> import sagline as sl
            >>> print(sl.FreeLimit("tension_max", 500.0, 3000.0).high, "N")
            3000.0 N
        """
        lower, upper = number(low, "low", "N", low=0.0), number(high, "high", "N", low=0.0)
        check_order(np.array([lower]), np.array([upper]), "N", strictly=True)
        named = () if cables is None else cable_numbers(cables, "cables")
        values = {"which": choice(which, "which", LIMITS), "low": lower, "high": upper, "cables": named}
        for field, value in values.items():
            object.__setattr__(self, field, value)

    def bound(self, robot: Robot, item: str) -> Bound:
        """What it means for a robot."""
        cables = cables_of_robot(self.cables, robot, f"{item}: cables")
        own = getattr(robot, self.which)[cables]
        name = f"{self.which}{whose_text(cables, robot.cable_count)}"
        if len(set(own.tolist())) > 1:
            value = f"{own.min():g} to {own.max():g} N"
            step = "Name the cables that share one: FreeLimit(..., cables=[0, 1])."
            raise InvalidValueError(f"{item}: the robot's {name}", value, "the same for all of these cables", step)
        start = float(own[0])
        if not self.low <= start <= self.high:
            allowed, step = f"{self.low:g} to {self.high:g} N", "Widen the bounds, or correct the robot."
            raise InvalidValueError(f"{item}: the robot's {name}", f"{start:g} N", allowed, step)
        return _Limited((Part(name, "N", self.low, self.high, start),), LIMITS[self.which], cables)


class _Limited(NamedTuple):
    """A limit: which column, of which cables."""

    parts: tuple[Part, ...]
    column: int
    cables: Indices

    def write(self, cables: Array, values: Array) -> None:
        """Set it."""
        cables[:, self.cables, self.column] = values

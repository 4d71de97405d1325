"""What of a robot may change while a better one is searched, each part between bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from sagline.core.arguments import brief, integer
from sagline.core.arrays import Array, Indices
from sagline.core.errors import InvalidValueError
from sagline.core.results import ByFields
from sagline.robot.robot import Robot


class Part(NamedTuple):
    """One number that may change.

    Attributes:
        name: What it is, as messages and tables call it.
        unit: Its unit; "" for the number of a choice.
        low: Least [unit].
        high: Largest [unit].
        start: What the robot has [unit], between the two.
        choices: How many choices there are, the number being 0, 1, ...; 0 where it is continuous.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    choices: int = 0


class Bound(Protocol):
    """A `Free` of a robot: what it has, and how it enters the tables of cables."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """The numbers that may change."""

    def write(self, cables: Array, values: Array) -> None:
        """Change cable tables (N, m, CABLE_COLUMNS) in place, by the parts' values (N, K)."""


class Free(ByFields):
    """A part of a robot that may change: `FreeAnchors`, `FreeCable` or `FreeLimit`."""

    __slots__ = ()

    def bound(self, robot: Robot, item: str) -> Bound:
        """What it means for a robot.

        Args:
            robot: The robot that the search begins with.
            item: How messages call it.

        Raises:
            InvalidValueError: If the robot does not have it, or not within the bounds.
        """
        raise NotImplementedError


def check_order(low: Array, high: Array, unit: str, *, strictly: bool = False) -> None:
    """Refuse bounds that are crossed, or with `strictly` equal, shape (K,)."""
    for k in np.flatnonzero(low >= high if strictly else low > high):
        where = f"[{k}]" if len(low) > 1 else ""
        allowed = f"< high{where}, {high[k]:g} {unit}" if strictly else f"<= high{where}, {high[k]:g} {unit}"
        raise InvalidValueError(f"low{where}", f"{low[k]:g} {unit}", allowed, "Exchange low and high.")


def cable_numbers(cables: Any, item: str) -> tuple[int, ...]:
    """Numbers of cables that a caller gives, each once."""
    given = list(cables) if isinstance(cables, Sequence | np.ndarray) and not isinstance(cables, str) else []
    found = [integer(one) for one in given]
    if not found or any(one is None or one < 0 for one in found) or len(set(found)) < len(found):
        step = "Number the cables from 0, or leave cables out for all."
        raise InvalidValueError(item, brief(cables), "numbers of cables that differ", step)
    return tuple(one for one in found if one is not None)


def cables_of_robot(cables: tuple[int, ...], robot: Robot, item: str) -> Indices:
    """Those of a robot, all of them for none."""
    wrong = [one for one in cables if one >= robot.cable_count]
    if wrong:
        step = f"{robot.name} has {robot.cable_count} cables, numbered from 0."
        raise InvalidValueError(item, wrong[0], f"0 to {robot.cable_count - 1}", step)
    return np.array(cables or range(robot.cable_count), dtype=np.int64)


def whose_text(cables: Indices, count: int) -> str:
    """How names say which cables are meant; nothing for all."""
    return "" if len(cables) == count else f"[{' '.join(map(str, cables))}]"

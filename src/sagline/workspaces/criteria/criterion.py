"""What every criterion has in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.robot.robot import Robot
from sagline.workspaces.criteria.given import Given


class Judged(NamedTuple):
    """What a criterion says of N poses.

    Attributes:
        value: How far inside each is, in the criterion's unit: >= 0 where it is met; NaN where there are no tensions
            to judge, shape (N,).
        cable: Which cable decides, -1 where none does, shape (N,).
    """

    value: Array
    cable: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Criterion:
    """A condition on poses: a function of the pose that is >= 0 where it is met, and continuous.

    Attributes:
        title: What it is called in tables and figures.
        unit: Of its values.
        needs_tensions: Whether it looks at how the load is shared.
        sense: Whether what it limits is to be "≤" or "≥" its limit; "" where it has none.
    """

    title: ClassVar[str]
    unit: ClassVar[str]
    needs_tensions: ClassVar[bool] = False
    sense: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Refuse the criterion that is none: the interface by itself.

        Raises:
            InvalidValueError: If there is no condition.
        """
        if type(self) is Criterion:
            step = "Choose one of the criteria, MaximumSag(0.05) for instance."
            raise InvalidValueError("Criterion()", "the interface alone", "a criterion", step)

    def judge(self, given: Given) -> Judged:
        """How far inside poses are.

        Args:
            given: The poses.

        Returns:
            Values in the criterion's unit, and the cables that decide.
        """
        raise NotImplementedError

    def scale(self, robot: Robot) -> float:
        """What counts as one, so that criteria of different units compare: in its unit, > 0.

        Args:
            robot: The robot.

        Returns:
            The size.
        """
        raise NotImplementedError

    def check(self, robot: Robot) -> None:
        """Refuse robots that it cannot judge.

        Args:
            robot: The robot.

        Raises:
            InvalidValueError: If it cannot.
        """

    @property
    def always(self) -> bool:
        """Whether every workspace has it, so that nobody need be told."""
        return False

    def __str__(self) -> str:
        """In words: "sag ≤ 50 mm"."""
        limit = n(getattr(self, "limit", np.nan), unit=self.unit)
        return f"{self.title} {self.sense} {limit}" if self.sense else self.title

    def values(self, given: Given) -> Array:
        """How far inside poses are, without the cables.

        Args:
            given: The poses.

        Returns:
            In the criterion's unit, shape (N,).
        """
        return self.judge(given).value


def no_cable(count: int) -> Indices:
    """For criteria that no single cable decides.

    Args:
        count: Number of poses.

    Returns:
        -1 for each.
    """
    return locked(np.full(count, -1))

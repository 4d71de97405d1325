"""What every optimizer is given: where to begin, and whom to ask."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

from sagline.core.arrays import Array

Rate: TypeAlias = Callable[[Array], Array]  # points of the unit cube (N, d) to costs (N, g); the least are wanted


class Task(NamedTuple):
    """What is searched.

    Attributes:
        rate: Gives the costs of points of the unit cube; a generation at once.
        start: The robot that one begins with, shape (d,).
        sample: Points to try besides, shape (K, d).
        goals: How many costs there are, g.
        seed: Of the search.
        evaluations: How many points may be rated; those of start and sample count.
    """

    rate: Rate
    start: Array
    sample: Array
    goals: int
    seed: int
    evaluations: int

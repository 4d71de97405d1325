"""What the timeline shows of something played: its quantities over time, where it is wrong and why, what happened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.robot import Robot

# Cables by number, here and nowhere else: no color of the platform, of its path, of a tension or of a verdict.
# Each holds 3 : 1 on the panels of both themes.
COLORS: Final = ("#0e9384", "#8a8a12", "#9a6f52", "#1897b8", "#5e9a3c", "#7d8794")  # lines beyond them are dashed
_ENDS: Final = {"chord": "the chord", "frame_end": "the frame end"}


class Limit(NamedTuple):
    """A limit of what is drawn.

    Attributes:
        value: Where it is, in the unit of the chart.
        name: What it is.
        upper: Whether values are to stay below it.
    """

    value: float
    name: str
    upper: bool


class Span(NamedTuple):
    """A time in which something is wrong.

    Attributes:
        start: When it begins [s].
        end: When it ends [s].
        why: What is wrong, in words.
    """

    start: float
    end: float
    why: str


class Mark(NamedTuple):
    """Something that happened.

    Attributes:
        time: When [s].
        text: What, in words.
        bad: Whether it is a fault or a failure.
    """

    time: float
    text: str
    bad: bool


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """A quantity of each cable, or along each axis, over time.

    Attributes:
        title: What it is.
        unit: Its unit.
        decimals: How many of them are told.
        names: Of the lines: numbers of cables, or axes.
        values: Finds those of some samples when they are asked for, shape (n, k); NaN where there is none.
        limits: Of the values.
    """

    title: str
    unit: str
    decimals: int
    names: tuple[str, ...]
    values: Callable[[slice], Array]
    limits: tuple[Limit, ...] = ()

    @property
    def of_cables(self) -> bool:
        """Whether its lines are cables."""
        return self.names[0] == "0"


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Something played, as the timeline shows it.

    Attributes:
        time: Of the samples [s], from 0 on, shape (N,).
        charts: What there is over time; tensions first.
        spans: Where something is wrong, in order.
        marks: What happened, in order.
        paths: Names and colors of the ways and platforms that are drawn in the scene.
    """

    time: Array
    charts: tuple[Chart, ...]
    spans: tuple[Span, ...] = ()
    marks: tuple[Mark, ...] = ()
    paths: tuple[tuple[str, tuple[int, int, int]], ...] = ()

    def within(self, start: float, end: float) -> slice:
        """The samples from a time to another [s], and the one before and the one after."""
        first, stop = np.searchsorted(self.time, [start, end])
        return slice(max(int(first) - 1, 0), int(stop) + 1)

    def step_from(self, time: float, steps: int) -> float:
        """The time of the sample so many after the one at or before a time [s]."""
        now = int(np.searchsorted(self.time, time, side="right")) - 1
        return float(self.time[min(max(now + steps, 0), self.time.size - 1)])


def cable_names(robot: Robot) -> tuple[str, ...]:
    """The names of the lines of a chart of cables."""
    return tuple(map(str, range(robot.cable_count)))


def tension_limits(robot: Robot, newtons: float, *, at: str) -> tuple[Limit, ...]:
    """The limits that all cables keep; where they differ, the first that one may reach.

    Args:
        robot: The robot.
        newtons: The unit of the chart [N].
        at: Which tension is drawn, "chord" or "frame_end"; limits of the other one say so.
    """
    low, high = float(robot.tension_min.max()), float(robot.tension_max.min())
    other = "" if at == robot.tension_limits_of else f", of {_ENDS[robot.tension_limits_of]}"
    lower = (Limit(low / newtons, f"lowest allowed{other}", upper=False),) if low > 0.0 else ()
    upper = (Limit(high / newtons, f"highest allowed{other}", upper=True),) if isfinite(high) else ()
    return lower + upper

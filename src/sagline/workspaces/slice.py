"""A plane through a robot's space, and the margins on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np

from sagline.core.arrays import Array, Indices, locked

_IN_PLANE: Final = ((1, 2), (0, 2), (0, 1))  # axes across and up a drawing, by the axis that is normal to it
AXES: Final = "xyz"


class Plane(NamedTuple):
    """A plane at right angles to an axis of the world.

    Attributes:
        normal: That axis, 0 to 2.
        at: Where on it the plane is [m].
    """

    normal: int
    at: float

    @property
    def axes(self) -> tuple[int, int]:
        """The axes that go across and up in a drawing of it."""
        return _IN_PLANE[self.normal]

    def __str__(self) -> str:
        """As an equation."""
        return f"{AXES[self.normal]} = {self.at:.3g} m"

    def positions(self, across: Array, up: Array) -> Array:
        """The points of a grid on it, row by row.

        Args:
            across: Coordinates of the columns [m], shape (C,).
            up: Coordinates of the rows [m], shape (U,).

        Returns:
            Positions [m], shape (U C, 3).
        """
        places = np.empty((up.size, across.size, 3))
        first, second = self.axes
        places[..., self.normal] = self.at
        places[..., first], places[..., second] = across, up[:, None]
        return places.reshape(-1, 3)


class Found(Protocol):
    """What a function of positions has found at N of them: `Details` of levels, for instance."""

    @property
    def level(self) -> Array:
        """>= 0 inside, shape (N,)."""

    @property
    def margin(self) -> Array:
        """Signed margin [N], shape (N,)."""

    @property
    def criterion(self) -> Indices:
        """Which criterion decides, as an index, shape (N,)."""

    @property
    def cable(self) -> Indices:
        """Which cable, -1 where none does, shape (N,)."""


Find = Callable[[Array], Found]


@dataclass(frozen=True, slots=True, eq=False)
class Slice:
    """Levels and margins on a grid in a plane.

    Attributes:
        plane: The plane.
        across: Coordinates of the columns [m], shape (C,).
        up: Coordinates of the rows [m], shape (U,).
        level: >= 0 inside of the workspace, shape (U, C).
        margin: Signed margins [N], negative where the loads cannot be borne, minus infinity where the robot is
            singular, shape (U, C).
        criterion: Which criterion decides, as an index, shape (U, C).
        cable: Which cable limits, -1 where none does, shape (U, C).
    """

    plane: Plane
    across: Array
    up: Array
    level: Array
    margin: Array
    criterion: Indices
    cable: Indices


def slice_of(find: Find, plane: Plane, low: Array, high: Array, shape: tuple[int, int]) -> Slice:
    """What is found on a plane, between two corners of a box.

    Args:
        find: Given positions (N, 3) [m], what is found there: `levels().details` of a workspace.
        plane: The plane.
        low: Lowest corner of the box [m], shape (3,).
        high: Highest corner [m], shape (3,).
        shape: How many columns and rows.

    Returns:
        The slice.
    """
    first, second = plane.axes
    across, up = np.linspace(low[first], high[first], shape[0]), np.linspace(low[second], high[second], shape[1])
    found = find(plane.positions(across, up))
    grid = (up.size, across.size)
    parts = (found.level, found.margin, found.criterion, found.cable)
    return Slice(plane, locked(across), locked(up), *(locked(part.reshape(grid)) for part in parts))

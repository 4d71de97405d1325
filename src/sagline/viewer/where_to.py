"""Where the platform can go from where it is: how far along each axis until the margin changes its sign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.robot.robot import Robot
from sagline.workspaces.slice import Find

_STEPS: Final = 20  # along each way at first: a gap that is narrower than a step may be passed over
_HALVINGS: Final = 14  # then: a way is known to some 1e-4 of its step
WAYS: Final = np.vstack((np.eye(3), -np.eye(3)))  # +x, +y, +z, -x, -y, -z
NAMES: Final = ("+x", "+y", "+z", "−x", "−y", "−z")


@dataclass(frozen=True, slots=True, eq=False)
class WhereTo:
    """Straight ways from a pose, the platform turned as it is.

    Attributes:
        start: Where they begin [m], shape (3,).
        inside: Whether the platform is within the workspace there.
        margin: There [N].
        which: Ways that a platform of this robot can go, indices of `WAYS`, shape (K,).
        distance: Along each to the boundary, or to the end of the box [m], shape (K,).
        crossed: Whether it ends at the boundary, shape (K,).
        cable: The cable that limits there, -1 where none does, shape (K,).
    """

    start: Array
    inside: bool
    margin: float
    which: Indices
    distance: Array
    crossed: Flags
    cable: Indices

    @property
    def ends(self) -> Array:
        """Where the ways end [m], shape (K, 3)."""
        return np.asarray(self.start + self.distance[:, None] * WAYS[self.which])


def free_ways(robot: Robot, flat: int | None) -> Indices:
    """Ways along axes of the world that the platform may move along.

    Args:
        robot: The robot.
        flat: An axis along which positions are all the same; None for none.

    Returns:
        Indices of `WAYS`, shape (K,).
    """
    free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
    if flat is not None:
        free[flat] = False
    return np.flatnonzero(np.abs(WAYS) @ free > 0.5)


def where_to(find: Find, start: Array, which: Indices, low: Array, high: Array) -> WhereTo:
    """Follow straight ways to the boundary.

    Args:
        find: Gives levels and margins at positions, the platform turned as it is.
        start: Where the platform is [m], shape (3,).
        which: Ways to follow, indices of `WAYS`, shape (K,).
        low: Lowest corner of the box that the ways end at [m], shape (3,).
        high: Highest corner [m], shape (3,).

    Returns:
        How far each goes until the margin changes its sign: for a platform inside to where it has to stop, for one
        outside to where it would be held.
    """
    ways = WAYS[which]
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(ways > 0.0, (high - start) / ways, np.where(ways < 0.0, (low - start) / ways, np.inf))
    farthest = np.maximum(room.min(axis=1), 0.0)
    at = farthest[:, None] * np.linspace(0.0, 1.0, _STEPS + 1)
    first = find(start[None])
    value, cable = _found(find, start + at[..., None] * ways[:, None])
    inside = bool(first.level[0] >= 0.0)
    other = (value >= 0.0) != inside
    crossed = other.any(axis=1)
    last = np.where(crossed, other.argmax(axis=1), _STEPS)
    row = np.arange(len(which))
    near, far, limiting = at[row, np.maximum(last - 1, 0)], at[row, last], cable[row, last]
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        value_there, cable_there = _found(find, (start + middle[:, None] * ways)[:, None])
        beyond = ((value_there[:, 0] >= 0.0) != inside) & crossed
        far, limiting = np.where(beyond, middle, far), np.where(beyond, cable_there[:, 0], limiting)
        near = np.where(beyond, near, middle)
    distance, limiting = np.where(crossed, far, farthest), np.where(crossed, limiting, -1)
    margin = float(first.margin[0])
    return WhereTo(start, inside, margin, which, locked(distance), locked(crossed), locked(limiting))


def _found(find: Find, places: Array) -> tuple[Array, Indices]:
    """Levels and limiting cables at places (K, S, 3)."""
    found = find(places.reshape(-1, 3))
    return found.level.reshape(places.shape[:2]), found.cable.reshape(places.shape[:2])

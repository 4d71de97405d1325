"""Anchors that may be shifted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import tables
from sagline.optimization.free import Bound, Free, Part, cable_numbers, cables_of_robot, check_order, whose_text
from sagline.optimization.symmetry import Symmetry, followed, symmetry_of
from sagline.robot.robot import Robot

ENDS: Final = {"frame": tables.FRAME_X, "platform": tables.PLATFORM_X}
_UNIT: Final = 1e-9  # of a vector's length
_AXES: Final = "xyz"


@dataclass(frozen=True, slots=True, eq=False)
class FreeAnchors(Free):
    """Anchors that may be shifted from where the robot has them: in a box, along lines, symmetrically.

    Dead cable behind guides follows in the robots that are found, and stays as it is while they are searched.

    Attributes:
        end: "frame" or "platform".
        low: Least shifts [m], along x, y, z or, with `along`, along each direction: shape (K,), <= 0.
        high: Largest shifts [m], shape (K,), >= 0; where both are 0 nothing is free.
        along: Directions, world axes for the frame and platform axes for the platform, shape (K, 3), unit vectors.
        cables: Whose anchors, numbers from 0; empty for all.
        symmetry: How the others follow the first of them: "x", "xy" or any other axes: mirrored in the planes across
            these; "turned": about the vertical, with the angle between them; "together": by the same shift; None:
            each moves by itself.
    """

    end: str
    low: Array
    high: Array
    along: Array
    cables: tuple[int, ...]
    symmetry: Symmetry | None

    def __init__(
        self,
        end: str,
        low: ArrayLike,
        high: ArrayLike,
        *,
        along: ArrayLike | None = None,
        cables: Sequence[int] | None = None,
        symmetry: str | None = None,
    ) -> None:
        """Check them.

        Args:
            end: "frame" or "platform".
            low: Least shifts [m]: three numbers along x, y, z; with `along` one a direction.
            high: Largest shifts [m], of the same shape.
            along: A direction or several, of any length but zero; None for x, y and z.
            cables: Whose anchors, numbers from 0; None for all.
            symmetry: "x", "y", "z", "xy", ..., "turned", "together", or None.

        Raises:
            InvalidValueError: If low is above high, 0 (where the robot has its anchors) is not between them, nothing
                is free, or an argument is of the wrong kind.

        Examples:
            >>> import sagline as sl
            >>> posts = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="xy")
            >>> print(posts.low, posts.high, "m")
            [-1.] [1.] m
        """
        directions = np.eye(3) if along is None else _directions(along)
        lower, upper = (_shifts(value, name, len(directions)) for value, name in ((low, "low"), (high, "high")))
        check_order(lower, upper, "m")
        for k in np.flatnonzero((lower > 0.0) | (upper < 0.0)):
            step = "Shifts count from where the robot has its anchors: give low <= 0 <= high."
            raise InvalidValueError(f"low[{k}] to high[{k}]", f"{lower[k]:g} to {upper[k]:g} m", "0 m inside", step)
        if not (upper > lower).any():
            raise InvalidValueError("high", "the same as low", "> low in a direction", "Give the anchors some room.")
        free = upper > lower
        values = {
            "end": choice(end, "end", ENDS),
            "low": locked(lower[free]),
            "high": locked(upper[free]),
            "along": locked(directions[free]),
            "cables": () if cables is None else cable_numbers(cables, "cables"),
            "symmetry": symmetry_of(symmetry),
        }
        for field, value in values.items():
            object.__setattr__(self, field, value)

    def bound(self, robot: Robot, item: str) -> Bound:
        """What it means for a robot."""
        cables = cables_of_robot(self.cables, robot, f"{item}: cables")
        anchors = robot.frame_anchors if self.end == "frame" else robot.platform_anchors
        parts: list[Part] = []
        rates: list[Array] = []
        names = _direction_names(self.along)
        shifts = followed(self.symmetry, anchors[cables], self.along, (self.low, self.high), item)
        for which, moved in shifts:  # moved: of each cable, for each direction (K, c, 3)
            for k, name in enumerate(names):
                rate = np.zeros((robot.cable_count, tables.CABLE_COLUMNS))
                rate[cables, ENDS[self.end] : ENDS[self.end] + 3] = moved[k]
                if np.abs(rate).max() == 0.0:
                    continue
                whose = cables if which is None else cables[which : which + 1]
                named = f"{self.end}_anchors{whose_text(whose, robot.cable_count)} {name}"
                parts.append(Part(named, "m", float(self.low[k]), float(self.high[k]), 0.0))
                rates.append(rate)
        if not parts:
            step = "Leave out the symmetry, or the directions across its planes."
            raise InvalidValueError(f"{item}: symmetry", "one that holds all anchors", "one that lets some move", step)
        return _Shifted(tuple(parts), np.array(rates))


class _Shifted(NamedTuple):
    """Anchors: what each part adds to the table of cables, per meter."""

    parts: tuple[Part, ...]
    rates: Array

    def write(self, cables: Array, values: Array) -> None:
        """Shift them; sums in a fixed order, whatever the number of candidates."""
        for k, rate in enumerate(self.rates):
            cables += values[:, k, None, None] * rate


def _directions(along: ArrayLike) -> Array:
    vectors = np.atleast_2d(checked(along, "along", "", shape=(3,)))
    lengths = np.linalg.norm(vectors, axis=1)
    if vectors.ndim != 2 or not len(vectors) or lengths.min() < _UNIT:
        raise InvalidValueError("along", brief(along), "directions of shape (K, 3)", "Give [0, 0, 1] for upwards.")
    unit: Array = vectors / lengths[:, None]
    return unit


def _shifts(value: ArrayLike, item: str, count: int) -> Array:
    given = checked(value, item, "m")
    if given.shape not in ((), (count,)):
        allowed = f"a number, or {count} of them, one a direction"
        raise InvalidValueError(item, f"of shape {given.shape}", allowed, "Give one for x, y and z, or use along.")
    return np.array(np.broadcast_to(given, (count,)))


def _direction_names(along: Array) -> list[str]:
    """x, y and z where that is what they are, else the vector."""
    names = []
    for vector in along:
        axis = np.flatnonzero(np.abs(vector) > 1.0 - _UNIT)
        whole = axis.size and vector[axis[0]] > 0.0
        names.append(_AXES[axis[0]] if whole else f"along ({', '.join(f'{x:.3g}' for x in vector)})")
    return names

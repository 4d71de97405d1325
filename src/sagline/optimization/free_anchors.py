"""Design variables that shift anchors in a box or along lines, with or without symmetry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import set_fields
from sagline.kernels import tables
from sagline.optimization import free
from sagline.optimization.free import Bound
from sagline.robot.robot import Robot

Symmetry: TypeAlias = str
MIRRORED: Final = tuple("".join(axes) for count in (1, 2, 3) for axes in combinations("xyz", count))
NAMES: Final = (*MIRRORED, "turned", "together")
_ON_PLANE: Final = 1e-9  # tolerance of the distance from a plane or axis, relative to the extent of the anchors


def _symmetric_shifts(
    symmetry: Symmetry | None, anchors: Array, along: Array, bounds: tuple[Array, Array], item: str
) -> list[tuple[int | None, Array]]:
    """Index of each leading anchor, and shifts (K, c, 3) of all anchors if the leading anchor shifts by one meter."""
    # A leading anchor determines the shifts of other anchors by symmetry. The index of a single leading anchor is None.
    # Raises an error if an anchor could cross its mirror plane, or is on the axis of rotation.
    count = len(anchors)
    if symmetry is None:
        alone = np.eye(count)
        return [(i, along[:, None, :] * alone[i][None, :, None]) for i in range(count)]
    if symmetry == "together":
        return [(None, np.repeat(along[:, None, :], count, axis=1))]
    if symmetry == "turned":
        return [(None, _turned(anchors, along, item))]
    return [(None, _mirrored(symmetry, anchors, along, bounds, item))]


def _turned(anchors: Array, along: Array, item: str) -> Array:
    away = anchors[:, :2] - anchors[:, :2].mean(axis=0)
    if np.linalg.norm(away, axis=1).min() <= _ON_PLANE * max(float(np.ptp(anchors)), 1.0):
        step = 'Choose "together", or omit the cable with the anchor on the axis.'
        raise InvalidValueError(f"{item}: symmetry", "'turned' with an anchor on the axis", "no anchor on it", step)
    angle = np.arctan2(away[:, 1], away[:, 0])
    angle -= angle[0]
    shifts = np.repeat(along[:, None, :], len(anchors), axis=1)
    shifts[..., 0] = np.cos(angle) * along[:, None, 0] - np.sin(angle) * along[:, None, 1]
    shifts[..., 1] = np.sin(angle) * along[:, None, 0] + np.cos(angle) * along[:, None, 1]
    return shifts


def _mirrored(symmetry: str, anchors: Array, along: Array, bounds: tuple[Array, Array], item: str) -> Array:
    """Shifts (K, c, 3) that are mirrored at planes; an anchor on a mirror plane has no shift across the plane."""
    shifts = np.repeat(along[:, None, :], len(anchors), axis=1)
    for axis in ("xyz".index(name) for name in symmetry):
        low, high = float(anchors[:, axis].min()), float(anchors[:, axis].max())
        plane = 0.5 * (low + high)
        away = anchors[:, axis] - plane
        side = np.where(np.abs(away) <= _ON_PLANE * max(high - low, 1.0), 0.0, np.sign(away))
        if side[0] == 0.0:
            side = np.zeros_like(side)  # the leading anchor is on the plane: no anchor moves across
        lead, side = side[0], side * side[0]
        shifts[..., axis] *= side
        inward = -np.minimum(*(bound * along[:, axis] * lead for bound in bounds)).sum()
        room = float(np.abs(away[side != 0.0]).min(initial=np.inf))
        if inward >= room:
            name = "xyz"[axis]
            value = f"up to {inward:g} m inward"
            allowed = f"< {room:g} m, the distance to the plane {name} = {plane:g} m"
            step = f"Reduce the bounds along {name}, because anchors would pass their mirror images."
            raise InvalidValueError(f"{item}: the shift along {name}", value, allowed, step)
    return shifts


ENDS: Final = {"frame": tables.FRAME_X, "platform": tables.PLATFORM_X}
_UNIT: Final = 1e-9  # tolerance of the length of a unit vector
_AXES: Final = "xyz"


@dataclass(frozen=True, slots=True, eq=False)
class FreeAnchors(free.Free):
    """Design variables: shifts of anchors from their positions in the initial robot, in a box or along lines.

    During the search, the dead length of guides is constant. The resulting robots have the correct dead length.

    Attributes:
        end: "frame" or "platform".
        low: Smallest shifts [m], shape (K,), <= 0: along x, y, z, or along the directions in `along`.
        high: Largest shifts [m], shape (K,), >= 0. A direction with `low` = `high` = 0 has no shift.
        along: Directions as unit vectors, shape (K, 3), in world axes for "frame" and platform axes for "platform".
        cables: Indices of the cables with shifted anchors, from 0; empty for all cables.
        symmetry: Rule that gives all shifts from the shift of the first anchor. "x", "xy" or other axes: shifts are
            mirrored at the planes normal to these axes. "turned": shifts are rotated about the vertical, by the angle
            between the anchors. "together": all shifts are equal. None: all shifts are independent.
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
        """Check end, shifts, directions, cables and symmetry.

        Args:
            end: "frame" or "platform".
            low: Smallest shifts [m]: three numbers for x, y, z, or one number per direction in `along`.
            high: Largest shifts [m], with the shape of `low`.
            along: Directions of the shifts, one or several vectors of any nonzero length; None for x, y and z.
            cables: Indices of the cables with shifted anchors, from 0; None for all cables.
            symmetry: "x", "y", "z", "xy", ..., "turned", "together", or None.

        Raises:
            InvalidValueError: If a shift of 0, the initial position, is not between `low` and `high`; if all shifts are
                fixed; if an argument has a wrong type.

        Examples:
            >>> import sagline as sl
            >>> posts = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="xy")
            >>> print(posts.low, posts.high, "m")
            [-1.] [1.] m
        """
        directions = np.eye(3) if along is None else _directions(along)
        lower, upper = (_shifts(value, name, len(directions)) for value, name in ((low, "low"), (high, "high")))
        free.check_order(lower, upper, "m")
        for k in np.flatnonzero((lower > 0.0) | (upper < 0.0)):
            step = "Give low <= 0 <= high, because shifts are relative to the robot's anchors."
            raise InvalidValueError(f"low[{k}] to high[{k}]", f"{lower[k]:g} to {upper[k]:g} m", "0 m inside", step)
        if not (upper > lower).any():
            raise InvalidValueError("high", "the same as low", "> low in a direction", "Widen the bounds.")
        moving = upper > lower
        set_fields(
            self,
            end=choice(end, "end", ENDS),
            low=locked(lower[moving]),
            high=locked(upper[moving]),
            along=locked(directions[moving]),
            cables=free.cable_numbers(cables),
            symmetry=None if symmetry is None else str(choice(symmetry, "symmetry", NAMES)),
        )

    def bound(self, robot: Robot, item: str) -> Bound:
        """Design variables of this part, for a given robot."""
        cables = free.cables_of_robot(self.cables, robot, f"{item}: cables")
        anchors = robot.frame_anchors if self.end == "frame" else robot.platform_anchors
        parts: list[free.DesignVariable] = []
        rates: list[Array] = []
        names = _direction_names(self.along)
        shifts = _symmetric_shifts(self.symmetry, anchors[cables], self.along, (self.low, self.high), item)
        for which, moved in shifts:  # moved (K, c, 3): shift of each anchor per direction
            for k, name in enumerate(names):
                rate = np.zeros((robot.cable_count, tables.CABLE_COLUMNS))
                rate[cables, ENDS[self.end] : ENDS[self.end] + 3] = moved[k]
                if np.abs(rate).max() == 0.0:
                    continue
                whose = cables if which is None else cables[which : which + 1]
                named = f"{self.end}_anchors{free.whose_text(whose, robot.cable_count)} {name}"
                parts.append(free.DesignVariable(named, "m", float(self.low[k]), float(self.high[k]), 0.0))
                rates.append(rate)
        if not parts:
            step = "Omit the symmetry, or the directions across its planes."
            raise InvalidValueError(f"{item}: symmetry", "fixes all anchors", "a symmetry that permits a shift", step)

        def write(tables_of_cables: Array, values: Array) -> None:
            for k, rate in enumerate(rates):  # this order of summation does not depend on N
                tables_of_cables += values[:, k, None, None] * rate

        return tuple(parts), write


def _directions(along: ArrayLike) -> Array:
    vectors = np.atleast_2d(checked(along, "along", "", shape=(3,)))
    lengths = np.linalg.norm(vectors, axis=1)
    if vectors.ndim != 2 or not len(vectors) or lengths.min() < _UNIT:
        raise InvalidValueError("along", brief(along), "directions of shape (K, 3)", "Give [0, 0, 1] for upwards.")
    return np.asarray(vectors / lengths[:, None])


def _shifts(value: ArrayLike, item: str, count: int) -> Array:
    given = checked(value, item, "m")
    if given.shape not in ((), (count,)):
        allowed = f"a number, or {count} of them, one per direction"
        step = "Give three numbers for x, y, z, or use along."
        raise InvalidValueError(item, f"of shape {given.shape}", allowed, step)
    return np.array(np.broadcast_to(given, (count,)))


def _direction_names(along: Array) -> list[str]:
    """Name of each direction: x, y or z, or a text with the components of the vector."""
    names = []
    for vector in along:
        axis = np.flatnonzero(np.abs(vector) > 1.0 - _UNIT)
        whole = axis.size and vector[axis[0]] > 0.0
        names.append(_AXES[axis[0]] if whole else f"along ({', '.join(f'{x:.3g}' for x in vector)})")
    return names

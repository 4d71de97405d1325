"""Sets of loads on a platform, each described by its support function.

The margin uses only the extent of a set W against a direction y: h_W(y) = max over w in W of -y . w. Every set of this
module is a sum of segments, ellipsoids, polytopes and inertial loads. Support functions of a sum are added.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief
from sagline.core.arrays import Array, Indices, checked, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.core.results import ByFields, set_fields


def _wrench(wrench: Array) -> str:
    """Text of a wrench; a zero force or moment is omitted."""
    halves = ((wrench[:3], "N"), (wrench[3:], "N m"))
    return ", ".join(f"({', '.join(n(value) for value in half)}) {unit}" for half, unit in halves if half.any())


def _segments(segments: Array) -> str:
    """Text of segments: sizes of the segments along axes, and number of all other segments."""
    along = np.count_nonzero(segments, axis=1) == 1
    sizes = np.abs(segments[along]).sum(axis=0)
    parts = [f"±{_each(own, unit)}" for own, unit in ((sizes[:3], "N"), (sizes[3:], "N m")) if own.any()]
    rest = int(np.count_nonzero(~along & segments.any(axis=1)))
    return ", ".join(parts + [f"{rest} oblique segments"] * (rest > 0))


def _each(values: Array, unit: str) -> str:
    """Text of three numbers. If all are equal, the number is written once."""
    if np.ptp(values) == 0.0:
        return n(values[0], unit=unit)
    return f"({', '.join(n(value) for value in values)}) {unit}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WrenchSet(ByFields):
    """A set of wrenches on the platform: force and moment about the center of mass in world axes, without gravity.

    `WrenchBox`, `WrenchEllipsoid`, `WrenchPolytope` and `Accelerations` are such sets. The sum of two sets with `+`
    contains all sums of one wrench from each set.

    Attributes:
        center: A wrench [N, N m], shape (6,).
        segments: Vectors s, shape (S, 6); each vector adds all wrenches between -s and s.
        ellipsoids: Matrices A, shape (E, 6, 6); each matrix adds A s for all vectors s with length at most 1.
        corners: Corners of the polytopes [N, N m], polytope by polytope, shape (C, 6).
        sizes: Number of corners of each polytope, shape (P,).
        accelerations: Largest acceleration of the center of mass along each world axis [m/s^2], and largest angular
            acceleration about each world axis [rad/s^2], shape (2,). Mass and inertia of the robot give the loads.
    """

    center: Array
    segments: Array
    ellipsoids: Array
    corners: Array
    sizes: Indices
    accelerations: Array

    def __add__(self, other: WrenchSet) -> WrenchSet:
        """Minkowski sum with another set."""
        if not isinstance(other, WrenchSet):
            return NotImplemented
        center, accelerations = self.center + other.center, self.accelerations + other.accelerations
        pairs = ((getattr(self, name), getattr(other, name)) for name in ("segments", "ellipsoids", "corners", "sizes"))
        return WrenchSet(*map(locked, (center, *map(np.concatenate, pairs), accelerations)))

    def __str__(self) -> str:
        """Description of the set in one line, for example "±100 N, ±20 N m"."""
        parts = [_wrench(self.center)] if self.center.any() else []
        parts += [_segments(self.segments)] if self.segments.any() else []
        parts += ["an ellipsoid"] * len(self.ellipsoids)
        for corners in np.split(self.corners, np.cumsum(self.sizes)[:-1]) if len(self.sizes) else ():
            parts.append(f"a polytope of {len(corners)} corners" if len(corners) > 1 else _wrench(corners[0]))
        if self.accelerations.any():
            limits = zip(self.accelerations, ("m/s²", "rad/s²"), strict=True)
            parts.append("accelerations " + ", ".join(f"±{n(size, unit=unit)}" for size, unit in limits if size > 0.0))
        return " + ".join(parts) or "its weight alone"

    def __repr__(self) -> str:
        """Type and description."""
        return f"<{type(self).__name__}: {self}>"

    def _fill(self, **parts: Array) -> None:
        """Set the given fields, and make all other fields empty."""
        none = {
            "center": np.zeros(6),
            "segments": np.zeros((0, 6)),
            "ellipsoids": np.zeros((0, 6, 6)),
            "corners": np.zeros((0, 6)),
            "sizes": np.zeros(0, dtype=np.int64),
            "accelerations": np.zeros(2),
        }
        set_fields(self, **{name: locked(np.ascontiguousarray(value)) for name, value in {**none, **parts}.items()})


class WrenchBox(WrenchSet):
    """All wrenches that differ from a center by at most a given amount in each component.

    Examples:
        >>> import sagline as sl
        >>> print(sl.WrenchBox(force=100.0, moment=20.0).segments.diagonal())
        [100. 100. 100.  20.  20.  20.]
    """

    __slots__ = ()

    def __init__(self, force: ArrayLike = 0.0, moment: ArrayLike = 0.0, center: ArrayLike | None = None) -> None:
        """Check force, moment and center.

        Args:
            force: Largest difference of each force component [N], a number or shape (3,), >= 0.
            moment: Largest difference of each moment component [N m], a number or shape (3,), >= 0.
            center: Force [N], then moment [N m], shape (6,); None for zero.

        Raises:
            InvalidValueError: If a number is not finite or negative, or a shape is wrong.
        """
        self._fill(center=_center(center), segments=np.diag(_six(force, moment)))


class WrenchEllipsoid(WrenchSet):
    """All wrenches in an ellipsoid.

    Examples:
        >>> import sagline as sl
        >>> forces = sl.WrenchEllipsoid(force=50.0)  # 50 N in any direction
        >>> print(forces.ellipsoids[0].diagonal())
        [50. 50. 50.  0.  0.  0.]
    """

    __slots__ = ()

    def __init__(
        self,
        force: ArrayLike = 0.0,
        moment: ArrayLike = 0.0,
        center: ArrayLike | None = None,
        *,
        matrix: ArrayLike | None = None,
    ) -> None:
        """Check semi-axes, center and matrix.

        Args:
            force: Semi-axes along the force components [N], a number or shape (3,), >= 0.
            moment: Semi-axes along the moment components [N m], a number or shape (3,), >= 0.
            center: Force [N], then moment [N m], shape (6,); None for zero.
            matrix: Matrix A of the wrenches A s with |s| <= 1, shape (6, 6), instead of the semi-axes.

        Raises:
            InvalidValueError: If a number is not finite, a semi-axis is negative, or a shape is wrong. If semi-axes and
                matrix are both given.
        """
        axes = _six(force, moment)
        if matrix is not None and axes.any():
            raise InvalidValueError("matrix", "given with semi-axes", "one of the two", "Leave out the others.")
        own = np.diag(axes) if matrix is None else exactly(matrix, "matrix", "N, N m", (6, 6))
        self._fill(center=_center(center), ellipsoids=own[None])


class WrenchPolytope(WrenchSet):
    """Convex hull of given wrenches.

    Examples:
        >>> import sagline as sl
        >>> full = [0, 0, -300, 0, 0, 0]  # N downward
        >>> lifted = sl.WrenchPolytope([[0, 0, 0, 0, 0, 0], full])
        >>> print(lifted.corners[:, 2])
        [   0. -300.]
    """

    __slots__ = ()

    def __init__(self, corners: ArrayLike) -> None:
        """Check the corners.

        Args:
            corners: Wrenches [N, N m], shape (C, 6), C >= 1; a corner may be inside of the hull of the others.

        Raises:
            InvalidValueError: If a number is not finite, or there are no corners.
        """
        given = checked(corners, "corners", "N, N m", shape=(6,))
        if given.ndim != 2 or not len(given):
            step = "Give one wrench per row: force x, y, z, then moment x, y, z."
            raise InvalidValueError("corners", f"of shape {given.shape}", "shape (C, 6), C >= 1", step)
        self._fill(corners=given, sizes=np.array([len(given)], dtype=np.int64))


class Accelerations(WrenchSet):
    """Inertial loads of an accelerating platform, from the robot's mass, inertia and orientation.

    The loads come from the acceleration of the center of mass and the angular acceleration. The gyroscopic moment is
    not included, because it does not depend on an acceleration.

    Examples:
        >>> import sagline as sl
        >>> tool = sl.WrenchBox(force=10.0)  # N, either way along each axis
        >>> quick = sl.Accelerations(linear=2.0) + tool  # and 2 m/s^2
        >>> print(quick.accelerations)
        [2. 0.]
    """

    __slots__ = ()

    def __init__(self, linear: float = 0.0, angular: float = 0.0) -> None:
        """Check both accelerations.

        Args:
            linear: Largest acceleration of the center of mass along each world axis [m/s^2], >= 0.
            angular: Largest angular acceleration about each world axis [rad/s^2], >= 0.

        Raises:
            InvalidValueError: If an acceleration is not finite or is negative.
        """
        both = [number(linear, "linear", "m/s^2", low=0.0), number(angular, "angular", "rad/s^2", low=0.0)]
        self._fill(accelerations=np.array(both))


NO_LOAD: Final[WrenchSet] = Accelerations()  # the set contains only the zero wrench, which means the weight alone


def load_of(value: object) -> WrenchSet:
    """Check the argument `wrenches`: a set, or None for the weight alone."""
    if value is None:
        return NO_LOAD
    if not isinstance(value, WrenchSet):
        step = "Give WrenchBox(force=100.0, moment=20.0) for instance; a single wrench is WrenchPolytope([wrench])."
        raise InvalidValueError("wrenches", brief(value), "a WrenchSet, or None", step)
    return value


def _center(center: ArrayLike | None) -> Array:
    return np.zeros(6) if center is None else exactly(center, "center", "N, N m", (6,))


def _six(force: ArrayLike, moment: ArrayLike) -> Array:
    """Check force and moment components, >= 0, and return them together, (6,)."""
    return np.concatenate([_three(force, "force", "N"), _three(moment, "moment", "N m")])


def _three(value: ArrayLike, item: str, unit: str) -> Array:
    """Check `value`, one or three numbers >= 0, and return three numbers, (3,)."""
    given = checked(value, item, unit, low=0.0)
    if given.shape not in ((), (3,)):
        raise InvalidValueError(item, f"of shape {given.shape}", "a number, or shape (3,)", "Give one x, y, z.")
    return np.broadcast_to(given, (3,))

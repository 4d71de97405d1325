"""Sets of loads that a platform has to bear, each by its support function.

Of a set W only this enters: how far it reaches against a direction y, h_W(y) = max over w in W of -y . w. Every set
here is a sum of four kinds, whose support functions add: segments, ellipsoids, polytopes, and inertial loads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, checked, exactly, locked
from sagline.errors import InvalidValueError


@dataclass(frozen=True, slots=True, eq=False)
class WrenchSet:
    """A set of wrenches on the platform: force and moment about the center of mass in world axes, without gravity.

    Made by `WrenchBox`, `WrenchEllipsoid`, `WrenchPolytope` and `Accelerations`, and by adding two sets with `+`: the
    sums of each wrench of the one and each of the other.

    Attributes:
        center: A wrench [N, N m], shape (6,).
        segments: Each adds all wrenches between minus and plus itself, shape (S, 6).
        ellipsoids: Each A adds A s for all s no longer than 1, shape (E, 6, 6).
        corners: Of polytopes [N, N m], those of one after those of the other, shape (C, 6).
        sizes: How many corners each polytope has, shape (P,).
        accelerations: Largest acceleration of the center of mass along each world axis [m/s^2], and largest angular
            acceleration about each [rad/s^2], shape (2,): the loads of these, by the robot's mass and inertia.
    """

    center: Array
    segments: Array
    ellipsoids: Array
    corners: Array
    sizes: Array
    accelerations: Array

    def __add__(self, other: WrenchSet) -> WrenchSet:
        """All sums of a wrench of this set and one of the other."""
        if not isinstance(other, WrenchSet):
            return NotImplemented
        return WrenchSet(
            locked(self.center + other.center),
            locked(np.concatenate([self.segments, other.segments])),
            locked(np.concatenate([self.ellipsoids, other.ellipsoids])),
            locked(np.concatenate([self.corners, other.corners])),
            locked(np.concatenate([self.sizes, other.sizes])),
            locked(self.accelerations + other.accelerations),
        )


def _set(**parts: Array) -> WrenchSet:
    """A set of these parts and no others."""
    none = {
        "center": np.zeros(6),
        "segments": np.zeros((0, 6)),
        "ellipsoids": np.zeros((0, 6, 6)),
        "corners": np.zeros((0, 6)),
        "sizes": np.zeros(0, dtype=np.int64),
        "accelerations": np.zeros(2),
    }
    return WrenchSet(**{name: locked(np.ascontiguousarray(value)) for name, value in {**none, **parts}.items()})


def WrenchBox(  # noqa: N802 - what it makes is a set, called by its shape
    force: ArrayLike = 0.0, moment: ArrayLike = 0.0, center: ArrayLike | None = None
) -> WrenchSet:
    """All wrenches that differ from a center by no more than so much in each component.

    Args:
        force: Largest difference of each force component [N], a number or shape (3,), >= 0.
        moment: Largest difference of each moment component [N m], a number or shape (3,), >= 0.
        center: Force [N], then moment [N m], shape (6,); None for none.

    Returns:
        The set.

    Raises:
        InvalidValueError: If a number is not finite or negative, or a shape is another.

    Examples:
        >>> import sagline as sl
        >>> print(sl.WrenchBox(force=100.0, moment=20.0).segments.diagonal())
        [100. 100. 100.  20.  20.  20.]
    """
    half = [_three(force, "force", "N"), _three(moment, "moment", "N m")]
    middle = np.zeros(6) if center is None else exactly(center, "center", "N, N m", (6,))
    return _set(center=middle, segments=np.diag(np.concatenate(half)))


def _three(value: ArrayLike, item: str, unit: str) -> Array:
    """A number or three of them, none negative, as three."""
    given = checked(value, item, unit, low=0.0)
    if given.shape not in ((), (3,)):
        raise InvalidValueError(item, f"of shape {given.shape}", "a number, or shape (3,)", "Give one x, y, z.")
    return np.broadcast_to(given, (3,))

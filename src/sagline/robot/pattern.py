"""Motion patterns: selection of a platform's free motions among the six motions."""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np

from sagline.core.arrays import Array, locked

MotionPattern = Literal["3R3T", "3T", "1R2T", "2T"]
MOTION_PATTERNS: Final[tuple[str, ...]] = get_args(MotionPattern)
PLANAR: Final = frozenset({"1R2T", "2T"})
ROTATING: Final = frozenset({"3R3T", "1R2T"})
_SPATIAL: Final = {"3R3T": locked(np.eye(6)), "3T": locked(np.eye(3, 6))}


def freedom_matrix(pattern: MotionPattern, plane_normal: Array | None) -> Array:
    """Orthonormal rows (n, 6) that select the free components of a wrench or twist in world axes.

    plane_normal: unit normal of the plane of a planar pattern, (3,). Its translations are e1 and e2 with e1 x e2 =
    plane_normal; e1 is horizontal, and e2 points upward as steeply as the plane allows. The rotation is the last row.
    """
    if plane_normal is None:
        return _SPATIAL[pattern]
    rows = np.zeros((3, 6))
    rows[:2, :3] = _plane_axes(plane_normal)
    rows[2, 3:] = plane_normal
    return locked(rows if pattern == "1R2T" else rows[:2])


def _plane_axes(normal: Array) -> Array:
    # the length of this vector is the sine of the angle between normal and vertical
    horizontal = np.cross((0.0, 0.0, 1.0), normal)
    length = float(np.linalg.norm(horizontal))
    if length < 1e-12:  # in a horizontal plane (except for rounding) every direction is horizontal; x is chosen
        horizontal = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        length = float(np.linalg.norm(horizontal))
    first = horizontal / length
    return np.stack([first, np.cross(normal, first)])

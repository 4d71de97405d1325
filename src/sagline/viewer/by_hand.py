"""Tensions chosen by hand in a drawing of the feasible tensions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.tension.methods import QuadraticProgram
from sagline.tension.polygon import Side, TensionPolygon

BY_HAND: Final = "chosen by hand"


@dataclass(frozen=True, slots=True, eq=False)
class ByHand(QuadraticProgram):
    """Feasible tensions that are closest to tensions chosen by hand; at the pose of the choice, both are equal.

    Tensions in force balance are the minimum-norm tensions plus a point of the null space. The sag forces shift the
    minimum-norm tensions slightly, but they do not shift this point. At other poses, the tensions are as close to the
    chosen tensions as the balance and the limits allow.
    """


WIDTH, BORDER = 340, 26  # height of the drawing of an interval [px]
HEIGHTS: Final = (0, 74, 190)  # height of the drawing by the number of redundant cables [px]
BEYOND: Final = 0.5  # extension of the drawing of an unbounded polygon, relative to the size of its finite part


@dataclass(frozen=True, slots=True, eq=False)
class DotField:
    """Drawing of the feasible tensions."""

    polygon: TensionPolygon
    # corners of the drawing in coordinates of the null space [N], shape (h, r), r = 1 or 2; an unbounded polygon is
    # clipped
    corners: Array
    # limit of each side, from corner k to corner k + 1 (at corner k for an interval)
    sides: tuple[Side | None, ...]
    low: Array  # lowest coordinates of the drawing [N], shape (r,)
    high: Array  # highest coordinates of the drawing [N], shape (r,)

    @classmethod
    def of(cls, polygon: TensionPolygon, dot: Array, before: DotField | None = None) -> DotField:
        """Make the drawing of a nonempty polygon, for one or two redundant cables."""
        corners, sides = polygon.vertices, polygon.sides
        if before is not None:
            low, high = before.low, before.high
        else:
            low, high = _extent(polygon, dot)
        if not polygon.bounded:
            corners, sides = _clipped(corners, sides, low, high)
        return cls(polygon, locked(np.ascontiguousarray(corners)), sides, low, high)

    @property
    def redundant(self) -> int:
        """Number of redundant cables, 1 or 2."""
        return int(self.corners.shape[1])

    @property
    def height(self) -> int:
        """Height of the drawing [px]."""
        return HEIGHTS[self.redundant]

    @property
    def middle(self) -> Array:
        """Coordinates of the middle of the drawing [N], shape (r,)."""
        return np.asarray(0.5 * (self.low + self.high))

    @property
    def scale(self) -> float:
        """Pixels per newton."""
        inside = np.array([WIDTH, self.height])[: self.redundant] - 2.0 * BORDER
        return float(np.min(inside / np.maximum(self.high - self.low, 1e-9)))

    def place(self, at: Array) -> tuple[float, float]:
        """Position of coordinates (r,) in the drawing [px], from its upper left corner."""
        away = self.scale * (at - self.middle)
        return 0.5 * WIDTH + float(away[0]), 0.5 * self.height - float(away[1] if self.redundant > 1 else 0.0)

    def nearest(self, at: Array) -> Array:
        """Nearest feasible point to coordinates (r,)."""
        if self.redundant == 1:
            return np.clip(at, self.corners.min(axis=0), self.corners.max(axis=0))
        starts, ends = self.corners, np.roll(self.corners, -1, axis=0)
        along, away = ends - starts, at - starts
        if np.all(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0] >= 0.0):  # corners are in counter-clockwise order
            return at
        length = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
        share = np.clip((along * away).sum(axis=1) / length, 0.0, 1.0)
        feet = starts + share[:, None] * along
        return np.asarray(feet[int(np.argmin(np.linalg.norm(feet - at, axis=1)))])

    def tension(self, at: Array) -> Array:
        """Chord tensions at coordinates (r,) [N], shape (m,)."""
        return np.maximum(self.polygon.origin + at @ self.polygon.basis, 0.0)


def _extent(polygon: TensionPolygon, dot: Array) -> tuple[Array, Array]:
    """Lowest and highest coordinates to draw (r,)."""
    if polygon.bounded:
        return polygon.vertices.min(axis=0), polygon.vertices.max(axis=0)
    known = np.array([side is not None for side in polygon.sides])
    if polygon.vertices.shape[1] == 2:
        known &= np.roll(known, 1)  # a corner of two limits, not of the box
    points = np.vstack(
        (polygon.vertices[known], dot[None] if np.isfinite(dot).all() else polygon.vertices[:0], np.zeros_like(dot))
    )
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.max(high - low)) or float(np.abs(polygon.origin).max()) or 1.0
    return low - BEYOND * size, high + BEYOND * size


def _clipped(
    corners: Array, sides: tuple[Side | None, ...], low: Array, high: Array
) -> tuple[Array, tuple[Side | None, ...]]:
    """Part of a polygon within the box from `low` to `high`. The sides of the box do not count as limits."""
    if corners.shape[1] == 1:
        return np.clip(corners, low, high), sides
    for axis, sign, end in ((0, 1.0, high[0]), (0, -1.0, -low[0]), (1, 1.0, high[1]), (1, -1.0, -low[1])):
        inside = sign * corners[:, axis] <= end
        kept: list[Array] = []
        named: list[Side | None] = []
        for k, corner in enumerate(corners):
            after = (k + 1) % len(corners)
            if inside[k]:
                kept.append(corner)
                named.append(sides[k])
            if inside[k] != inside[after]:
                share = (sign * end - corner[axis]) / (corners[after][axis] - corner[axis])
                kept.append(corner + share * (corners[after] - corner))
                named.append(None if inside[k] else sides[k])
        corners, sides = np.array(kept).reshape(-1, 2), tuple(named)
    return corners, sides

"""Polygon of the feasible tensions of one pose in the null space, for up to two redundant cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular


class Side(NamedTuple):
    """Tension limit on which a side of the polygon lies.

    Attributes:
        cable: Index of the cable.
        limit: "min" or "max".
    """

    cable: int
    limit: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TensionPolygon(Result, Tabular):
    """All feasible tensions of one pose: origin + lambda basis, where lambda is a point of the polygon.

    The sag forces T_z - tau sin phi of sagging cables depend on the tensions. The polygon assumes constant sag forces,
    computed at the minimum-norm tensions (docs/model.md, section 5).

    Attributes:
        vertices: Corners, counter-clockwise, in coordinates of the null space [N], shape (h, 2); Omega_lambda of the
            article. One redundant cable gives the two ends of an interval, which may be infinite, shape (2, 1). Without
            redundant cables, there is one point without coordinates, shape (1, 0). If no tensions are feasible, the
            shape is (0, r).
        tensions: Tensions at the vertices [N], in the tension variable, shape (h, m); Omega_t of the article.
        sides: Tension limit of each side; side k connects the vertices k and k + 1. For an interval, tension limit at
            vertex k. None for a side at infinity, whose vertices represent infinity because the polygon is unbounded.
        bounded: True if no side is at infinity.
        basis: Orthonormal basis of the null space, shape (r, m).
        origin: Minimum-norm tensions that balance the wrench [N], shape (m,); they may violate the limits.
        scale: Factor of each cable in the equation `tension variable = scale * chord tension + offset`, shape (m,): 1
            for the chord tension, cos phi for the horizontal tension, and the derivative by chord tension for the
            frame-end tension.
        offset: Offset in this equation [N], shape (m,); zero except for the frame-end tension.
    """

    _columns: ClassVar[Columns] = ("T#=tensions",)

    vertices: Array
    tensions: Array
    sides: tuple[Side | None, ...]
    bounded: bool
    basis: Array
    origin: Array
    scale: Array
    offset: Array

    def coordinates(self, chord_tension: ArrayLike) -> Array:
        """Compute the coordinates of tensions in the plane of the polygon.

        Args:
            chord_tension: Chord tensions that balance the pose [N], shape (..., m), as in `Plan.chord_tension`.

        Returns:
            Coordinates in the null space [N], shape (..., r); NaN where the tensions are NaN.

        Raises:
            InvalidValueError: If `chord_tension` does not contain numbers, or not one number per cable.
        """
        given = checked(chord_tension, "chord_tension", "N", missing=True)
        if given.ndim == 0 or given.shape[-1] != self.scale.size:
            allowed = f"shape (..., {self.scale.size})"
            raise InvalidValueError("chord_tension", f"of shape {given.shape}", allowed, "Give one tension per cable.")
        shared = self.scale * given + self.offset
        found: Array = (shared - self.origin) @ self.basis.T
        return found

"""Feasible tensions of one pose, for plots: a polygon in the null space, for up to two redundant cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.core.table import Columns, Tabular


class Side(NamedTuple):
    """Tension limit that forms a side of the polygon.

    Attributes:
        cable: Index of the cable.
        limit: "min" or "max".
    """

    cable: int
    limit: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TensionPolygon(Result, Tabular):
    """All tensions within their limits that balance one pose: origin + lambda basis, with lambda in the polygon.

    For sagging cables the balance depends on the tensions. The polygon then uses the sag forces T_z - tau sin phi at
    the minimum-norm tensions (docs/model.md, section 5).

    Attributes:
        vertices: Corners, counter-clockwise, in coordinates of the null space [N], shape (h, 2); Omega_lambda of the
            article. For one redundant cable, the vertices are the ends of an interval, possibly infinite, shape (2, 1).
            Without redundant cables, there is one point without coordinates, shape (1, 0). If no tensions are feasible,
            the shape is (0, r).
        tensions: Tensions at the vertices [N], in the tension variable, shape (h, m); Omega_t of the article.
        sides: For each side k, which connects vertices k and k + 1, its tension limit; for an interval, the limit at
            vertex k. None for a side at infinity, where the polygon is unbounded; the vertices of this side represent
            infinity.
        bounded: True if no side is at infinity.
        basis: Orthonormal basis of the null space, shape (r, m).
        origin: Minimum-norm tensions that balance the wrench without regard to the limits [N], shape (m,).
        scale: Factor of each cable in the equation `tension variable = scale * chord tension + offset`, shape (m,). It
            is 1 for the chord tension and cos phi for the horizontal tension. For the frame-end tension it is the
            derivative with respect to the chord tension.
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
        """Coordinates of given tensions in the polygon.

        Args:
            chord_tension: Chord tensions that balance the pose [N], shape (..., m), as in `Plan.chord_tension`.

        Returns:
            Coordinates in the null space [N], shape (..., r); NaN where the tensions are NaN.

        Raises:
            InvalidValueError: If the tensions are not numbers, or not one number per cable.
        """
        given = checked(chord_tension, "chord_tension", "N", missing=True)
        if given.ndim == 0 or given.shape[-1] != self.scale.size:
            allowed = f"shape (..., {self.scale.size})"
            raise InvalidValueError("chord_tension", f"of shape {given.shape}", allowed, "Give one tension per cable.")
        shared = self.scale * given + self.offset
        found: Array = (shared - self.origin) @ self.basis.T
        return found

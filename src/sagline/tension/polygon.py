"""The feasible tensions of one pose as a picture: a polygon in the null space of two redundant cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result


class Side(NamedTuple):
    """Limit that is a side of the polygon.

    Attributes:
        cable: Index of the cable.
        limit: "min" or "max".
    """

    cable: int
    limit: str


@dataclass(frozen=True, slots=True, eq=False)
class TensionPolygon(Result):
    """All tensions that balance one pose within their limits: tensions = origin + lambda basis.

    With a sagging cable the balance depends on the tensions: this is the polygon of the last linearization, with the
    pulls T_z - tau sin phi that the cables have at the minimum-norm tensions (docs/model.md, section 5).

    Attributes:
        vertices: The article's Omega_lambda: corners, counter-clockwise, in coordinates of the null space [N], shape
            (h, 2); for one redundant cable the ends of an interval, shape (2, 1), infinite where it has none; for no
            redundant cable one point without coordinates, shape (1, 0). Shape (0, r) where nothing is feasible.
        tensions: The article's Omega_t: tensions at the vertices [N], in the distribution's variable, shape (h, m).
        sides: The limit that each side is, from vertex k to vertex k + 1 (at vertex k for an interval); None where the
            polygon has no such side: it is unbounded there, and the vertices at both ends only represent infinity.
        bounded: Whether every side is a limit.
        basis: Orthonormal basis of the null space, shape (r, m).
        origin: The minimum-norm tensions of the balance without limits [N], shape (m,).
        scale: The distribution's variable is scale times the chord tension plus offset, shape (m,): 1, or cos phi for
        the
            horizontal tension, or the slope of the frame-end tension.
        offset: Zero except for the frame-end tension [N], shape (m,).
    """

    vertices: Array
    tensions: Array
    sides: tuple[Side | None, ...]
    bounded: bool
    basis: Array
    origin: Array
    scale: Array
    offset: Array

    def coordinates(self, chord_tension: ArrayLike) -> Array:
        """Coordinates of tensions of this pose in the polygon.

        Args:
            chord_tension: Chord tensions that balance the pose [N], shape (..., m), as `Plan.chord_tension` has them.

        Returns:
            Coordinates in the null space [N], shape (..., r); NaN for tensions that are NaN.

        Raises:
            InvalidValueError: If they are no numbers, or not one a cable.
        """
        given = checked(chord_tension, "chord_tension", "N", missing=True)
        if given.ndim == 0 or given.shape[-1] != self.scale.size:
            allowed = f"shape (..., {self.scale.size})"
            raise InvalidValueError("chord_tension", f"of shape {given.shape}", allowed, "Give one tension a cable.")
        shared = self.scale * given + self.offset
        found: Array = (shared - self.origin) @ self.basis.T
        return found

"""The feasible tensions of one pose for plotting: a polygon in the null space, for up to two redundant cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result


class Side(NamedTuple):
    """Tension limit that forms a side of the polygon.

    Attributes:
        cable: Index of the cable.
        limit: "min" or "max".
    """

    cable: int
    limit: str


@dataclass(frozen=True, slots=True, eq=False)
class TensionPolygon(Result):
    """All tensions within their limits that balance one pose: tensions = origin + lambda basis.

    For sagging cables the balance depends on the tensions. The polygon is then that of the last linearization, with the
    sag forces T_z - tau sin phi at the minimum-norm tensions (docs/model.md, section 5).

    Attributes:
        vertices: The article's Omega_lambda: corners, counter-clockwise, in coordinates of the null space [N], shape
            (h, 2). For one redundant cable, these are the ends of an interval, possibly infinite, shape (2, 1). Without
            redundant cables, this is one point without coordinates, shape (1, 0). If no tensions are feasible, the
            shape is (0, r).
        tensions: The article's Omega_t: tensions at the vertices [N], in the tension variable, shape (h, m).
        sides: The limit of each side, from vertex k to vertex k + 1 (at vertex k for an interval); None for a side at
            which the polygon is unbounded. The vertices at both ends of such a side represent infinity.
        bounded: True if every side is a limit.
        basis: Orthonormal basis of the null space, shape (r, m).
        origin: The minimum-norm tensions that balance the wrench, without limits [N], shape (m,).
        scale: Factor of the tension variable, which is scale times chord tension plus offset, shape (m,). It is 1 for
            the chord tension, cos phi for the horizontal tension, and the derivative of the frame-end tension for this
            tension.
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
        """Coordinates in the polygon of given tensions at this pose.

        Args:
            chord_tension: Chord tensions that balance the pose [N], shape (..., m), as in `Plan.chord_tension`.

        Returns:
            Coordinates in the null space [N], shape (..., r); NaN for tensions that are NaN.

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

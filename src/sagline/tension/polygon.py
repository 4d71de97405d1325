"""The feasible tensions of one pose for plotting: a polygon in the null space of up to two redundant cables."""

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
    """All tensions that balance one pose within their limits: tensions = origin + lambda basis.

    For sagging cables the balance depends on the tensions: this is the polygon of the last linearization, with the sag
    forces T_z - tau sin phi at the minimum-norm tensions (docs/model.md, section 5).

    Attributes:
        vertices: The article's Omega_lambda: corners, counter-clockwise, in coordinates of the null space [N], shape
            (h, 2); for one redundant cable the ends of an interval, shape (2, 1), possibly infinite; for no redundant
            cable one point without coordinates, shape (1, 0). Shape (0, r) if no tensions are feasible.
        tensions: The article's Omega_t: tensions at the vertices [N], in the tension variable, shape (h, m).
        sides: The limit of each side, from vertex k to vertex k + 1 (at vertex k for an interval); None where the
            polygon is unbounded: the vertices at both ends of such a side represent infinity.
        bounded: True if every side is a limit.
        basis: Orthonormal basis of the null space, shape (r, m).
        origin: The minimum-norm tensions that balance the wrench, without limits [N], shape (m,).
        scale: The tension variable is scale times the chord tension plus offset, shape (m,): 1, or cos phi for the
            horizontal tension, or the derivative of the frame-end tension.
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
            InvalidValueError: If they are not numbers, or not one per cable.
        """
        given = checked(chord_tension, "chord_tension", "N", missing=True)
        if given.ndim == 0 or given.shape[-1] != self.scale.size:
            allowed = f"shape (..., {self.scale.size})"
            raise InvalidValueError("chord_tension", f"of shape {given.shape}", allowed, "Give one tension a cable.")
        shared = self.scale * given + self.offset
        found: Array = (shared - self.origin) @ self.basis.T
        return found

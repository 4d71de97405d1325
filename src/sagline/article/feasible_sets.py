"""Figures 3 to 5: which tensions and lengths put the end of a cable where it is wanted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sagline.article.fits import Line, fit_line
from sagline.article.sampling import GRAVITY
from sagline.cables.cable import Cable
from sagline.cables.models import Catenary
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError

CORNERS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)])  # of |x| + |z| = 1


class End(NamedTuple):
    """Where the platform end of a cable is wanted.

    Attributes:
        span: Horizontal distance from the frame end [m].
        rise: Height above the frame end [m].
    """

    span: float
    rise: float

    @property
    def chord(self) -> float:
        """D [m]."""
        return float(np.hypot(self.span, self.rise))


@dataclass(frozen=True, slots=True, eq=False)
class FeasibleSets:
    """The sets psi for some lengths, the curve Psi over all, and the line pi through its projection.

    Attributes:
        cable: Material.
        end: The wanted position B_d.
        tolerance: epsilon_max of (20) [m].
        psi_lengths: Lengths L of the sets psi [m], shape (s,).
        psi: Their outlines in the (T_x, T_z) plane [N], shape (s, points, 2).
        tensions: T_x along the curve Psi [N], shape (t,).
        vertical: T_z along it [N], shape (t,).
        lengths: L along it [m], shape (t,).
        line: The line pi of least squares through (T_x, T_z): slope a_pi, intercept b_pi [N].
    """

    cable: Cable
    end: End
    tolerance: float
    psi_lengths: Array
    psi: Array
    tensions: Array
    vertical: Array
    lengths: Array
    line: Line

    @property
    def tangent(self) -> float:
        """Tan phi, the article's slope of pi (26)."""
        return self.end.rise / self.end.span

    @property
    def half_weight(self) -> float:
        """Half the weight w D, the magnitude of the article's intercept (28) [N]."""
        return 0.5 * float(self.cable.linear_density) * GRAVITY * self.end.chord


def feasible_sets(
    cable: Cable, end: End, tolerance: float, tensions: Array, psi_tensions: Array, points: int = 80
) -> FeasibleSets:
    """The article's psi and Psi, exactly.

    The map from (T, L) to B is one to one at a given L, so the outline of psi is the image of the outline of the
    tolerance, |dx| + |dz| = epsilon_max around B_d, under its inverse: no search is needed.

    Args:
        cable: Material, a single one.
        end: B_d.
        tolerance: epsilon_max [m], > 0.
        tensions: T_x at which the curve Psi is sampled [N], shape (t,).
        psi_tensions: T_x of the lengths for which psi is outlined [N], shape (s,).
        points: Of each outline, a multiple of 4.

    Returns:
        The sets.

    Raises:
        InvalidValueError: If points is no multiple of 4.

    Source:
        Gia Luan & Truong Thinh 2020, (20), (21), figures 3 to 5, statements 1 and 2.
    """
    if points % 4:
        raise InvalidValueError("points", points, "a multiple of 4", "The outline has four edges.")
    model, stretch = Catenary(), end.chord / end.span
    curve = model.from_tension(cable, end.span, end.rise, tensions * stretch, GRAVITY)
    lengths = model.from_tension(cable, end.span, end.rise, psi_tensions * stretch, GRAVITY).unstrained_length
    outline = np.asarray(end) + tolerance * _diamond(points)
    psi = model.from_length(cable, outline[:, 0], outline[:, 1], lengths[:, None], GRAVITY)
    return FeasibleSets(
        cable=cable,
        end=end,
        tolerance=tolerance,
        psi_lengths=lengths,
        psi=np.stack((psi.horizontal_tension, psi.vertical_force), axis=-1),
        tensions=curve.horizontal_tension,
        vertical=curve.vertical_force,
        lengths=curve.unstrained_length,
        line=fit_line(curve.horizontal_tension, curve.vertical_force),
    )


def _diamond(points: int) -> Array:
    """Points on |x| + |z| = 1, the first again as the last, shape (points + 1, 2)."""
    share = np.linspace(0.0, 4.0, points + 1)
    edges = np.arange(5.0)
    return np.stack([np.interp(share, edges, CORNERS[:, k]) for k in range(2)], axis=-1)

"""Figures 6 and 7: the intercept of the line pi, over chord and density, at both ends of the cable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.article.fits import fit_factor, fit_line
from sagline.article.sampling import Sampling
from sagline.core.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class InterceptStudy:
    """Intercepts b_pi of the forces on one end of the cable, and what the article regresses from them.

    Attributes:
        sampling: The cables, a angles, c chords, r densities.
        slope: a_pi of the fitted lines, shape (a, c, r).
        intercept: b_pi of the fitted lines [N], shape (a, c, r).
        r_squared: How well the lines fit, shape (a, c, r).
        h_b: Factor of D in b_pi = h_b D [N/m], shape (a, r).
        k_h_of_angle: Factor of rho in h_b = k_h rho, angle by angle [m/s^2], shape (a,).
        k_h: The same over all angles [m/s^2].
    """

    sampling: Sampling
    slope: Array
    intercept: Array
    r_squared: Array
    h_b: Array
    k_h_of_angle: Array
    k_h: float


def intercept_studies(sampling: Sampling) -> tuple[InterceptStudy, InterceptStudy]:
    """The article's regressions (21), (27), (28) at the platform end and at the frame end.

    Both lines give the vertical force on the cable: at the frame end it is smaller by the cable's weight, so the
    intercept is negative there.

    Args:
        sampling: The cables.

    Returns:
        The study at the platform end, and that at the frame end.

    Source:
        Gia Luan & Truong Thinh 2020, section 4.2, figures 6 and 7; erratum 1 in docs/errata.md.
    """
    state = sampling.hang()
    frame_end = state.vertical_force - state.cable_weight
    return _study(sampling, state.vertical_force), _study(sampling, frame_end)


def _study(sampling: Sampling, vertical: Array) -> InterceptStudy:
    line = fit_line(sampling.tensions, vertical)
    h_b = fit_factor(sampling.chords[:, None], line.intercept, axis=-2)
    everywhere = np.broadcast_to(sampling.densities, h_b.shape)
    return InterceptStudy(
        sampling=sampling,
        slope=line.slope,
        intercept=line.intercept,
        r_squared=line.r_squared,
        h_b=h_b,
        k_h_of_angle=fit_factor(sampling.densities, h_b),
        k_h=float(fit_factor(everywhere.ravel(), h_b.ravel())),
    )

"""Sampled cables of the article's empirical study, and the least-squares fits of this study."""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

import sagline as sl
from sagline.core.arrays import Array, checked
from sagline.core.fields import given, rule

GRAVITY = 9.81  # [m/s^2], the same in all studies of the article
ANGLE = 0.754  # angle of the article's figure 10 [rad]
UNSTRETCHABLE = 1e20  # stiffness [N] for which the strain is below the rounding error


class FittedLine(NamedTuple):
    """Lines y = slope x + intercept, fitted to samples along the last axis."""

    slope: Array  # slope, shape (...)
    intercept: Array  # intercept, shape (...)
    r_squared: Array  # coefficient of determination: share of the variance of y that the line explains, shape (...)
    deviation: Array  # largest distance of a sample from the line, in the unit of y, shape (...)


def fit_line(x: Array, y: Array) -> FittedLine:
    """Fit a least-squares line to samples along the last axis."""
    x, y = np.broadcast_arrays(x, y)
    away_x = x - x.mean(axis=-1, keepdims=True)
    away_y = y - y.mean(axis=-1, keepdims=True)
    slope = np.sum(away_x * away_y, axis=-1) / np.sum(away_x**2, axis=-1)
    rest = away_y - slope[..., None] * away_x
    explained = 1.0 - np.sum(rest**2, axis=-1) / np.sum(away_y**2, axis=-1)
    intercept = y.mean(axis=-1) - slope * x.mean(axis=-1)
    return FittedLine(slope, intercept, explained, np.abs(rest).max(axis=-1))


def fit_factor(shape: Array, y: Array, axis: int = -1) -> Array:
    """Least-squares factor a of y = a * shape, along one axis."""
    # all other regressions of the article have this form; the shape is 1/T_x^2, D^3, cos^4(phi), rho^2, D or rho
    shape, y = np.broadcast_arrays(shape, y)
    factor: Array = np.sum(shape * y, axis=axis) / np.sum(shape**2, axis=axis)
    return factor


_POSITIVE = {"shape": (None,), "above": 0.0}


@attrs.frozen(eq=False)
class Sampling:
    """Every combination of four quantities of a cable; the platform end is above the frame end."""

    # angle phi of the chord (the article's beta), between 0 and pi/2
    angles: Array = attrs.field(converter=given, metadata=rule("rad", shape=(None,)))
    chords: Array = attrs.field(converter=given, metadata=rule("m", **_POSITIVE))
    densities: Array = attrs.field(converter=given, metadata=rule("kg/m", **_POSITIVE))
    tensions: Array = attrs.field(converter=given, metadata=rule("N", **_POSITIVE))  # T_x
    axial_stiffness: float = UNSTRETCHABLE  # EA of all cables [N]

    def __attrs_post_init__(self) -> None:
        """Check the four quantities of the cables."""
        for about in (about for about in attrs.fields(Sampling) if about.metadata):
            object.__setattr__(self, about.name, checked(getattr(self, about.name), about.name, **about.metadata))

    def hang(self) -> sl.CableState:
        """States of the sampled cables, by the exact model."""
        angle, chord, density, tension = np.meshgrid(
            self.angles, self.chords, self.densities, self.tensions, indexing="ij"
        )
        cable = sl.Cable(density, self.axial_stiffness)
        cosine = np.cos(angle)
        return sl.Catenary().from_tension(cable, chord * cosine, chord * np.sin(angle), tension / cosine, GRAVITY)

    def between(self, lowest: float, highest: float) -> Sampling:
        """The same sampling, with its tensions evenly spaced between two limits."""
        tensions = np.linspace(lowest, highest, self.tensions.size)
        return Sampling(self.angles, self.chords, self.densities, tensions, self.axial_stiffness)


def article_sampling() -> Sampling:
    """Assumed samples; the article gives only phi = 0.754 rad and rho in (0, 2)."""
    # Chords from 2 to 16 m, as in the frames of the article's Table 1; five angles around 0.754 rad; ten densities;
    # sixty tensions from 100 N to 10 kN, evenly spaced. Source: Gia Luan & Truong Thinh 2020, figures 6 to 15
    return Sampling(
        angles=[0.25, 0.5, ANGLE, 1.0, 1.25],
        chords=np.linspace(2.0, 16.0, 8),
        densities=np.linspace(0.2, 2.0, 10),
        tensions=np.linspace(100.0, 10_000.0, 60),
    )


def simulated_cable() -> sl.Cable:
    """The cable of the article's simulated robots."""
    cables = sl.load_robot("article-suspended").cables
    return cables._part(0, cables.linear_density.shape)

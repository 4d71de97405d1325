"""Figures 6 to 15: sampled cables, and the article's regressions for its two constants k_h and k_p."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.core.arrays import Array

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
    """Fit least-squares lines to the samples `x` and `y` along the last axis."""
    x, y = np.broadcast_arrays(x, y)
    away_x = x - x.mean(axis=-1, keepdims=True)
    away_y = y - y.mean(axis=-1, keepdims=True)
    slope = np.sum(away_x * away_y, axis=-1) / np.sum(away_x**2, axis=-1)
    rest = away_y - slope[..., None] * away_x
    explained = 1.0 - np.sum(rest**2, axis=-1) / np.sum(away_y**2, axis=-1)
    intercept = y.mean(axis=-1) - slope * x.mean(axis=-1)
    return FittedLine(slope, intercept, explained, np.abs(rest).max(axis=-1))


def fit_factor(shape: Array, y: Array, axis: int = -1) -> Array:
    """Least-squares factor a of `y` = a * `shape`, along the axis `axis`."""
    # all other regressions of the article have this form; the shape is 1/T_x^2, D^3, cos^4(phi), rho^2, D or rho
    shape, y = np.broadcast_arrays(shape, y)
    factor: Array = np.sum(shape * y, axis=axis) / np.sum(shape**2, axis=axis)
    return factor


class End(NamedTuple):
    """Desired position of the platform end of a cable."""

    span: float  # horizontal distance from the frame end [m]
    rise: float  # height above the frame end [m]

    @classmethod
    def at_angle(cls, chord: float) -> End:
        """End of a chord of the length `chord` [m], at the article's angle."""
        return cls(chord * float(np.cos(ANGLE)), chord * float(np.sin(ANGLE)))

    @property
    def chord(self) -> float:
        """Length D of the chord [m]."""
        return float(np.hypot(self.span, self.rise))


class Sampling(NamedTuple):
    """Every combination of four quantities of cables without stretch; the platform end is above the frame end."""

    angles: Array  # angle phi of the chord (the article's beta), between 0 and pi/2 [rad]
    chords: Array  # D [m]
    densities: Array  # rho [kg/m]
    tensions: Array  # T_x [N]

    def hang(self) -> sl.CableState:
        """States of the sampled cables, by the exact model."""
        angle, chord, density, tension = np.meshgrid(*self, indexing="ij")
        cosine = np.cos(angle)
        cable, chord_tension = sl.Cable(density, UNSTRETCHABLE), tension / cosine
        return sl.Catenary().from_tension(cable, chord * cosine, chord * np.sin(angle), chord_tension, GRAVITY)

    def between(self, lowest: float, highest: float) -> Sampling:
        """The same sampling, with tensions evenly spaced from `lowest` to `highest` [N]."""
        return self._replace(tensions=np.linspace(lowest, highest, self.tensions.size))


def article_sampling() -> Sampling:
    """Assumed samples; the article gives only phi = 0.754 rad and rho in (0, 2)."""
    # Chords from 2 to 16 m, as in the frames of the article's Table 1; five angles around 0.754 rad; ten densities;
    # sixty tensions from 100 N to 10 kN, evenly spaced. Source: Gia Luan & Truong Thinh 2020, figures 6 to 15
    return Sampling(
        angles=np.array([0.25, 0.5, ANGLE, 1.0, 1.25]),
        chords=np.linspace(2.0, 16.0, 8),
        densities=np.linspace(0.2, 2.0, 10),
        tensions=np.linspace(100.0, 10_000.0, 60),
    )


def simulated_cable() -> sl.Cable:
    """The cable of the article's simulated robots."""
    cables = sl.load_robot("article-suspended").cables
    return cables._part(0, cables.linear_density.shape)


PUBLISHED_K_H = 4.845  # [m/s^2], magnitude; Gia Luan & Truong Thinh 2020, section 4.2.2
PUBLISHED_K_P = 4.385  # [m^2/s^4], section 5.2.4
SHALLOW_K_H = GRAVITY / 2.0
SHALLOW_K_P = GRAVITY**2 / 24.0
LOWEST, HIGHEST = (20.0, 400.0), (500.0, 200_000.0)  # search intervals for both ends of the range of tensions [N]


@dataclass(frozen=True, slots=True, eq=False)
class InterceptStudy:
    """Intercepts b_pi of the forces on one end of the cable, and the article's regressions."""

    sampling: Sampling  # the cables, a angles, c chords, r densities
    slope: Array  # slopes a_pi of the fitted lines, shape (a, c, r)
    intercept: Array  # intercepts b_pi of the fitted lines [N], shape (a, c, r)
    h_b: Array  # h_b in b_pi = h_b D [N/m], shape (a, r)
    k_h_of_angle: Array  # k_h in h_b = k_h rho, for each angle [m/s^2], shape (a,)
    k_h: float  # k_h in h_b = k_h rho, for all angles together [m/s^2]


def intercept_studies(sampling: Sampling) -> tuple[InterceptStudy, InterceptStudy]:
    """The regressions (21), (27), (28) of the article, at the platform end and at the frame end."""
    # Both lines are vertical forces on the cable. The force at the frame end is smaller by the cable's weight, so that
    # its intercept is negative. Source: Gia Luan & Truong Thinh 2020, section 4.2, figures 6 and 7; erratum 1 in
    # docs/errata.md
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
        h_b=h_b,
        k_h_of_angle=fit_factor(sampling.densities, h_b),
        k_h=float(fit_factor(everywhere.ravel(), h_b.ravel())),
    )


@dataclass(frozen=True, slots=True, eq=False)
class StretchStudy:
    """Adjusting length d = L - D of a cable, as a function of the tension."""

    tensions: Array  # T_x [N], shape (t,)
    magnitude: Array  # |T| at the platform end of the cable without stretch [N], shape (t,)
    unstretchable: Array  # adjusting length d of a cable that does not stretch [m], shape (t,)
    stretchable: Array  # adjusting length d_e of the elastic cable [m], shape (t,)
    relieved: Array  # d_e plus the elongation |T| L/EA of the article (36) [m], shape (t,)
    relieved_exactly: Array  # d_e plus the true elongation by the mean force along the cable [m], shape (t,)


@dataclass(frozen=True, slots=True, eq=False)
class SagStudy:
    """The article's sequence of regressions that begins with d and ends with k_p, for cables without stretch."""

    sampling: Sampling  # the cables, a angles, c chords, r densities, t tensions
    adjusting_length: Array  # adjusting lengths d [m], shape (a, c, r, t)
    a_d: Array  # factor in d = a_d/T_x^2 (41) [m N^2], shape (a, c, r)
    q_a: Array  # factor in a_d = q_a D^3 (43) [N^2/m^2], shape (a, r)
    p_q: Array  # factor in q_a = p_q cos^4(phi) (44) [N^2/m^2], shape (r,)
    k_p: float  # factor in p_q = k_p rho^2 (45) [m^2/s^4]

    @property
    def fitted_length(self) -> Array:
        """Adjusting length d by (41) [m], shape (a, c, r, t)."""
        return self.a_d[..., None] * length_shape(self.sampling.tensions)

    @property
    def fitted_a_d(self) -> Array:
        """Factor a_d by (43) [m N^2], shape (a, c, r)."""
        return self.q_a[:, None] * chord_shape(self.sampling.chords)[:, None]

    @property
    def fitted_q_a(self) -> Array:
        """Factor q_a by (44) [N^2/m^2], shape (a, r)."""
        return self.p_q * angle_shape(self.sampling.angles)[:, None]


def length_shape(tension: Array) -> Array:
    """Function (41), 1/T_x^2 [1/N^2], to which d is proportional."""
    return tension**-2


def chord_shape(chord: Array) -> Array:
    """Function (43), D^3 [m^3], to which a_d is proportional."""
    return chord**3


def angle_shape(angle: Array) -> Array:
    """Function (44), cos^4 of the chord's angle, to which q_a is proportional."""
    shape: Array = np.cos(angle) ** 4
    return shape


def density_shape(density: Array) -> Array:
    """Function (45), rho^2 [kg^2/m^2], to which p_q is proportional."""
    return density**2


def stretch_study(cable: sl.Cable, end: End, tensions: Array) -> StretchStudy:
    """Adjusting lengths of a cable without its elongation: by (36) and (38), and with the true elongation."""
    # The elongation by the force at the platform end, |T| L/EA, is too large by w L^2 sin(phi)/(2 EA), because half of
    # the cable's weight acts along the chord (erratum 5). Source: Gia Luan & Truong Thinh 2020, (33) to (38), figures 8
    # and 9
    model, chord_tension = sl.Catenary(), tensions * end.chord / end.span
    stiff = model.from_tension(cable.replace(axial_stiffness=UNSTRETCHABLE), *end, chord_tension, GRAVITY)
    soft = model.from_tension(cable, *end, chord_tension, GRAVITY)
    mean_force = np.hypot(soft.horizontal_tension, soft.vertical_force - 0.5 * soft.cable_weight)
    stretch = soft.unstrained_length / cable.axial_stiffness
    return StretchStudy(
        tensions=stiff.horizontal_tension,
        magnitude=stiff.platform_end_tension,
        unstretchable=stiff.adjusting_length,
        stretchable=soft.adjusting_length,
        relieved=soft.adjusting_length + soft.platform_end_tension * stretch,
        relieved_exactly=soft.adjusting_length + mean_force * stretch,
    )


def sag_study(sampling: Sampling) -> SagStudy:
    """The regressions (41), (43), (44), (45) of the article, one after the other."""
    # source: Gia Luan & Truong Thinh 2020, section 5.2, figures 10 to 15
    excess = sampling.hang().adjusting_length
    a_d = fit_factor(length_shape(sampling.tensions), excess)
    q_a = fit_factor(chord_shape(sampling.chords)[:, None], a_d, axis=-2)
    p_q = fit_factor(angle_shape(sampling.angles)[:, None], q_a, axis=-2)
    return SagStudy(
        sampling=sampling,
        adjusting_length=excess,
        a_d=a_d,
        q_a=q_a,
        p_q=p_q,
        k_p=float(fit_factor(density_shape(sampling.densities), p_q)),
    )


class Constants(NamedTuple):
    """Constants from the regressions for one range of tensions."""

    lowest: float  # lowest sampled T_x [N]
    highest: float  # highest sampled T_x [N]
    k_h_platform: float  # k_h at the platform end [m/s^2]
    k_h_frame: float  # k_h at the frame end [m/s^2], negative
    k_p: float  # k_p [m^2/s^4]


def constants(sampling: Sampling) -> Constants:
    """Both constants from the article's regressions, for sampled cables."""
    platform, frame = intercept_studies(sampling)
    tensions = sampling.tensions
    return Constants(float(tensions.min()), float(tensions.max()), platform.k_h, frame.k_h, sag_study(sampling).k_p)


@cache
def published_sampling() -> Sampling:
    """Assumed samples of the article, in the range of tensions that gives the published constants."""
    sampling = article_sampling()
    found = published_range(sampling)
    return sampling.between(found.lowest, found.highest)


def published_range(sampling: Sampling) -> Constants:
    """The range of tensions that gives both published constants: k_h = -4.845 at the frame end and k_p = 4.385."""
    # The two ends of the range determine the two constants: if the lower end increases, k_p decreases; if the upper end
    # increases, |k_h| increases.
    from scipy.optimize import brentq

    def best_lowest(highest: float) -> float:
        def excess(lowest: float) -> float:
            return sag_study(sampling.between(lowest, highest)).k_p - PUBLISHED_K_P

        return float(brentq(excess, *LOWEST, xtol=1e-6))

    def missing(log_highest: float) -> float:
        highest = float(np.exp(log_highest))
        _, frame = intercept_studies(sampling.between(best_lowest(highest), highest))
        return frame.k_h + PUBLISHED_K_H

    try:
        highest = float(np.exp(brentq(missing, *np.log(HIGHEST), xtol=1e-8)))
    except ValueError:  # there is no change of sign between the ends of the search
        raise sl.InvalidValueError(
            "the sampled cables",
            "cables for which no range of tensions gives the published constants",
            f"lowest tensions in {LOWEST} N, highest in {HIGHEST} N",
            "Sample chords and densities as the article did.",
        ) from None
    return constants(sampling.between(best_lowest(highest), highest))

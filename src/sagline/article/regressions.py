"""Study of figures 6 to 15: sampled cables, and the regressions of the article for its constants k_h and k_p."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

import sagline as sl
from sagline.core.arrays import Array

GRAVITY = 9.81  # [m/s^2], in all studies of the article
ANGLE = 0.754  # angle of the article's figure 10 [rad]
UNSTRETCHABLE = 1e20  # stiffness [N] for which the strain is below the rounding error


def fit_line(x: Array, y: Array) -> tuple[Array, Array]:
    """Slopes and intercepts (...) of least-squares lines through the samples `x` (N,) and `y` (..., N)."""
    away = x - x.mean()
    slope = np.sum(away * y, axis=-1) / np.sum(away**2)
    return slope, y.mean(axis=-1) - slope * x.mean()


def fit_factor(shape: Array, y: Array, axis: int = -1) -> Array:
    """Least-squares factor a of `y` = a * `shape`, along the axis `axis`."""
    # Except for lines, all regressions of the article have this form. The shape is 1/T_x^2, D^3, cos^4(phi), rho^2, D
    # or rho.
    shape, y = np.broadcast_arrays(shape, y)
    return np.asarray(np.sum(shape * y, axis=axis) / np.sum(shape**2, axis=axis))


End: TypeAlias = tuple[float, float]  # platform end of a cable: span and rise from the frame end [m]


def end_at_angle(chord: float) -> End:
    """Platform end of a cable with a chord of the length `chord` [m], at the angle of the article."""
    return chord * float(np.cos(ANGLE)), chord * float(np.sin(ANGLE))


class Sampling(NamedTuple):
    """Cables without stretch for all combinations of four quantities; the platform end is above the frame end."""

    angles: Array  # angle phi of the chord (the article's beta), between 0 and pi/2 [rad]
    chords: Array  # D [m]
    densities: Array  # rho [kg/m]
    tensions: Array  # T_x [N]

    def hang(self) -> sl.CableState:
        """States of the sampled cables according to the exact model."""
        angle, chord, density, tension = np.meshgrid(*self, indexing="ij")
        cosine = np.cos(angle)
        cable, chord_tension = sl.Cable(density, UNSTRETCHABLE), tension / cosine
        return sl.Catenary().from_tension(cable, chord * cosine, chord * np.sin(angle), chord_tension, GRAVITY)

    def between(self, lowest: float, highest: float) -> Sampling:
        """Sampling with other tensions, which are evenly spaced from `lowest` to `highest` [N]."""
        return self._replace(tensions=np.linspace(lowest, highest, self.tensions.size))


def article_sampling() -> Sampling:
    """Assumed samples of the article, which states only phi = 0.754 rad and rho in (0, 2)."""
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
LOWEST, HIGHEST = (20.0, 400.0), (500.0, 200_000.0)  # search intervals of lowest and highest tension [N]


class InterceptStudy:
    """Intercepts b_pi for one end of the cable, and the regressions of the article that lead from b_pi to k_h."""

    def __init__(self, sampling: Sampling, vertical: Array) -> None:
        """Regressions of the vertical forces `vertical` [N] at one end of the cables."""
        _, intercept = fit_line(sampling.tensions, vertical)
        # sampling: the cables, a angles, c chords, r densities
        # intercept: intercepts b_pi of the fitted lines [N], shape (a, c, r)
        self.sampling, self.intercept = sampling, intercept
        # factor in b_pi = h_b D [N/m], shape (a, r)
        self.h_b = fit_factor(sampling.chords[:, None], intercept, axis=-2)
        # factor in h_b = k_h rho, fitted for each angle [m/s^2], shape (a,)
        self.k_h_of_angle = fit_factor(sampling.densities, self.h_b)
        everywhere = np.broadcast_to(sampling.densities, self.h_b.shape)
        # factor in h_b = k_h rho, fitted for all angles together [m/s^2]
        self.k_h = float(fit_factor(everywhere.ravel(), self.h_b.ravel()))

    @property
    def bend(self) -> float:
        """Largest deviation of b_pi from h_b D, divided by the largest b_pi."""
        rest = self.intercept - self.h_b[:, None, :] * self.sampling.chords[:, None]
        return float(np.abs(rest).max() / np.abs(self.intercept).max())


def intercept_studies(sampling: Sampling) -> tuple[InterceptStudy, InterceptStudy]:
    """Regressions (21), (27), (28) of the article, first for the platform end, then for the frame end."""
    # The lines show vertical forces on both ends of the cable. The force at the frame end is smaller by the weight of
    # the cable. Its intercept is therefore negative. Source: Gia Luan & Truong Thinh 2020, section 4.2, figures 6 and
    # 7; erratum 1 in docs/errata.md
    state = sampling.hang()
    frame_end = state.vertical_force - state.cable_weight
    return InterceptStudy(sampling, state.vertical_force), InterceptStudy(sampling, frame_end)


class SagStudy:
    """Regressions (41), (43), (44) and (45) of the article, from the adjusting length d to the constant k_p."""

    def __init__(self, sampling: Sampling) -> None:
        """Fit the factors to sampled cables."""
        # source: Gia Luan & Truong Thinh 2020, section 5.2, figures 10 to 15
        # sampling: the cables, a angles, c chords, r densities, t tensions
        # adjusting_length: adjusting lengths d [m], shape (a, c, r, t)
        self.sampling, self.adjusting_length = sampling, sampling.hang().adjusting_length
        # factor in d = a_d/T_x^2 (41) [m N^2], shape (a, c, r)
        self.a_d = fit_factor(sampling.tensions**-2, self.adjusting_length)
        # factor in a_d = q_a D^3 (43) [N^2/m^2], shape (a, r)
        self.q_a = fit_factor(sampling.chords[:, None] ** 3, self.a_d, axis=-2)
        # factor in q_a = p_q cos^4(phi) (44) [N^2/m^2], shape (r,)
        self.p_q = fit_factor(np.cos(sampling.angles)[:, None] ** 4, self.q_a, axis=-2)
        self.k_p = float(fit_factor(sampling.densities**2, self.p_q))  # factor in p_q = k_p rho^2 (45) [m^2/s^4]

    @property
    def fitted_length(self) -> Array:
        """Adjusting length d according to equation (41) [m], shape (a, c, r, t)."""
        return self.a_d[..., None] * self.sampling.tensions**-2

    @property
    def fitted_a_d(self) -> Array:
        """Factor a_d according to equation (43) [m N^2], shape (a, c, r)."""
        return self.q_a[:, None] * self.sampling.chords[:, None] ** 3

    @property
    def fitted_q_a(self) -> Array:
        """Factor q_a according to equation (44) [N^2/m^2], shape (a, r)."""
        return np.asarray(self.p_q * np.cos(self.sampling.angles)[:, None] ** 4)


def stretch_study(cable: sl.Cable, end: End, tensions: Array) -> tuple[sl.CableState, sl.CableState, Array, Array]:
    """States of a cable that does not stretch and of an elastic cable; adjusting lengths [m] without elongation."""
    # The adjusting lengths are those of the elastic cable, plus the elongation by equations (36) and (38), and plus the
    # true elongation.
    #
    # The force at the platform end gives an elongation |T| L/EA that is too large by w L^2 sin(phi)/(2 EA), because the
    # mean force is smaller by half of the weight's part along the chord (erratum 5). Source: Gia Luan & Truong Thinh
    # 2020, (33) to (38), figures 8 and 9
    model, chord_tension = sl.Catenary(), tensions * np.hypot(*end) / end[0]
    stiff = model.from_tension(cable.replace(axial_stiffness=UNSTRETCHABLE), *end, chord_tension, GRAVITY)
    soft = model.from_tension(cable, *end, chord_tension, GRAVITY)
    mean_force = np.hypot(soft.horizontal_tension, soft.vertical_force - 0.5 * soft.cable_weight)
    stretch = soft.unstrained_length / cable.axial_stiffness
    printed, right = (soft.adjusting_length + force * stretch for force in (soft.platform_end_tension, mean_force))
    return stiff, soft, printed, right


class Constants(NamedTuple):
    """Constants of the empirical model that the regressions give for one range of sampled tensions."""

    lowest: float  # lowest sampled T_x [N]
    highest: float  # highest sampled T_x [N]
    k_h_platform: float  # k_h at the platform end [m/s^2]
    k_h_frame: float  # k_h at the frame end [m/s^2], negative
    k_p: float  # k_p [m^2/s^4]


def constants(sampling: Sampling) -> Constants:
    """Constants k_h and k_p that the regressions of the article give for sampled cables."""
    platform, frame = intercept_studies(sampling)
    tensions = sampling.tensions
    return Constants(float(tensions.min()), float(tensions.max()), platform.k_h, frame.k_h, SagStudy(sampling).k_p)


@cache
def published_sampling() -> Sampling:
    """Assumed samples of the article, with the range of tensions that leads to the published constants."""
    sampling = article_sampling()
    found = published_range(sampling)
    return sampling.between(found.lowest, found.highest)


def published_range(sampling: Sampling) -> Constants:
    """Range of tensions for which the regressions give k_h = -4.845 at the frame end and k_p = 4.385, as published."""
    # k_p decreases if the lower end of the range increases. |k_h| increases if the upper end increases.
    from scipy.optimize import brentq

    def best_lowest(highest: float) -> float:
        def excess(lowest: float) -> float:
            return SagStudy(sampling.between(lowest, highest)).k_p - PUBLISHED_K_P

        return float(brentq(excess, *LOWEST, xtol=1e-6))

    def missing(log_highest: float) -> float:
        highest = float(np.exp(log_highest))
        _, frame = intercept_studies(sampling.between(best_lowest(highest), highest))
        return frame.k_h + PUBLISHED_K_H

    try:
        highest = float(np.exp(brentq(missing, *np.log(HIGHEST), xtol=1e-8)))
    except ValueError:  # no range of tensions within the search intervals gives the constants
        found = "cables for which no range of tensions gives the published constants"
        allowed = f"lowest tensions in {LOWEST} N, highest in {HIGHEST} N"
        step = "Sample chords and densities as the article did."
        raise sl.InvalidValueError("the sampled cables", found, allowed, step) from None
    return constants(sampling.between(best_lowest(highest), highest))

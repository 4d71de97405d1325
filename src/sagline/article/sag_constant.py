"""Figures 8 to 15: the adjusting length over tension, chord, angle and density, with and without stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.article.feasible_sets import End
from sagline.article.fits import fit_factor
from sagline.article.sampling import GRAVITY, UNSTRETCHABLE, Sampling
from sagline.cables.cable import Cable
from sagline.cables.models import Catenary
from sagline.core.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class StretchStudy:
    """The adjusting length d = L - D of one cable over its tension.

    Attributes:
        cable: Material.
        end: Where its platform end is.
        tensions: T_x [N], shape (t,).
        magnitude: |T| on the platform end of the unstretchable cable [N], shape (t,).
        unstretchable: d of a cable that does not stretch [m], shape (t,).
        stretchable: d_e of the cable [m], shape (t,).
        relieved: d_e plus the article's elongation |T| L/EA of (36) [m], shape (t,).
        relieved_exactly: d_e plus the true elongation, of the mean force along the cable [m], shape (t,).
    """

    cable: Cable
    end: End
    tensions: Array
    magnitude: Array
    unstretchable: Array
    stretchable: Array
    relieved: Array
    relieved_exactly: Array


@dataclass(frozen=True, slots=True, eq=False)
class SagStudy:
    """The article's chain of regressions from d to k_p, for cables that do not stretch.

    Attributes:
        sampling: The cables, a angles, c chords, r densities, t tensions.
        adjusting_length: d [m], shape (a, c, r, t).
        a_d: Factor in d = a_d/T_x^2 (41) [m N^2], shape (a, c, r).
        q_a: Factor in a_d = q_a D^3 (43) [N^2/m^2], shape (a, r).
        p_q: Factor in q_a = p_q cos^4(phi) (44) [N^2/m^2], shape (r,).
        k_p: Factor in p_q = k_p rho^2 (45) [m^2/s^4].
    """

    sampling: Sampling
    adjusting_length: Array
    a_d: Array
    q_a: Array
    p_q: Array
    k_p: float

    @property
    def fitted_length(self) -> Array:
        """D of (41) [m], shape (a, c, r, t)."""
        return self.a_d[..., None] * length_shape(self.sampling.tensions)

    @property
    def fitted_a_d(self) -> Array:
        """a_d of (43) [m N^2], shape (a, c, r)."""
        return self.q_a[:, None] * chord_shape(self.sampling.chords)[:, None]

    @property
    def fitted_q_a(self) -> Array:
        """q_a of (44) [N^2/m^2], shape (a, r)."""
        return self.p_q * angle_shape(self.sampling.angles)[:, None]


def length_shape(tension: Array) -> Array:
    """What (41) says of the adjusting length: it goes with 1/T_x^2.

    Args:
        tension: T_x [N], shape (...).

    Returns:
        Shape (...) [1/N^2].
    """
    return tension**-2


def chord_shape(chord: Array) -> Array:
    """What (43) says of a_d: it goes with D^3.

    Args:
        chord: D [m], shape (...).

    Returns:
        Shape (...) [m^3].
    """
    return chord**3


def angle_shape(angle: Array) -> Array:
    """What (44) says of q_a: it goes with cos^4 of the chord's angle.

    Args:
        angle: phi [rad], shape (...).

    Returns:
        Shape (...).
    """
    shape: Array = np.cos(angle) ** 4
    return shape


def density_shape(density: Array) -> Array:
    """What (45) says of p_q: it goes with rho^2.

    Args:
        density: rho [kg/m], shape (...).

    Returns:
        Shape (...) [kg^2/m^2].
    """
    return density**2


def stretch_study(cable: Cable, end: End, tensions: Array) -> StretchStudy:
    """Take the stretch out of a cable's adjusting length, as (36) and (38) do, and as they should.

    The elongation under the force at the platform end, |T| L/EA, is too large by half the cable's weight
    along the chord, w L^2 sin(phi)/(2 EA) (erratum 5).

    Args:
        cable: Material, a single one.
        end: B_d.
        tensions: T_x [N], shape (t,).

    Returns:
        The study.

    Source:
        Gia Luan & Truong Thinh 2020, (33) to (38), figures 8 and 9.
    """
    model, chord_tension = Catenary(), tensions * end.chord / end.span
    stiff = model.from_tension(cable.replace(axial_stiffness=UNSTRETCHABLE), *end, chord_tension, GRAVITY)
    soft = model.from_tension(cable, *end, chord_tension, GRAVITY)
    mean_force = np.hypot(soft.horizontal_tension, soft.vertical_force - 0.5 * soft.cable_weight)
    stretch = soft.unstrained_length / cable.axial_stiffness
    return StretchStudy(
        cable=cable,
        end=end,
        tensions=stiff.horizontal_tension,
        magnitude=stiff.platform_end_tension,
        unstretchable=stiff.adjusting_length,
        stretchable=soft.adjusting_length,
        relieved=soft.adjusting_length + soft.platform_end_tension * stretch,
        relieved_exactly=soft.adjusting_length + mean_force * stretch,
    )


def sag_study(sampling: Sampling) -> SagStudy:
    """The article's regressions (41), (43), (44), (45), one after the other.

    Args:
        sampling: The cables; they should not stretch.

    Returns:
        The study.

    Source:
        Gia Luan & Truong Thinh 2020, section 5.2, figures 10 to 15.
    """
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

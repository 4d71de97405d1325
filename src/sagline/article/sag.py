"""Chapter about figures 8 to 15."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sagline.article.drawing import Courses, Drawings, axes, legend_above, with_fit
from sagline.article.feasible_sets import End
from sagline.article.regressions import (
    PUBLISHED_K_P,
    SHALLOW_K_P,
    SagStudy,
    StretchStudy,
    angle_shape,
    chord_shape,
    density_shape,
    length_shape,
    published_sampling,
    sag_study,
    stretch_study,
)
from sagline.article.sampling import ANGLE, simulated_cable
from sagline.article.texts import chapter, finding
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, GREEN, VERMILLION
from sagline.present.page import Chapter, Finding

CHORD = 10.0  # [m]
TENSIONS = np.linspace(10.0, 500.0, 150)  # [N]
MIDDLE, DENSE = 2, -1  # indices of the article's angle and of the largest density
PICKED = (1, 3, 5, 7)  # indices of drawn chords
DRAWN = (1, 3, 5, 7, 9)  # indices of drawn densities


def sag_chapter() -> Chapter:
    """Chapter about the regressions that lead from the adjusting length to k_p."""
    end = End.at_angle(CHORD)
    stretch, sag = stretch_study(simulated_cable(), end, TENSIONS), sag_study(published_sampling())
    draw = Drawings("sag")
    return chapter(
        "sag",
        (
            _with_stretch(stretch, draw),
            _relieved(stretch, draw),
            _tension(sag, draw),
            _chord(sag, draw),
            _angle(sag, draw),
            _density(sag, draw),
        ),
        chord=CHORD,
    )


def _with_stretch(study: StretchStudy, draw: Drawings) -> Finding:
    figure, ax = axes("$T_x$ [N]", "$d$ [mm]")
    ax.plot(study.tensions, 1e3 * study.unstretchable, color=BLUE, linewidth=1.3, label="does not stretch")
    ax.plot(study.tensions, 1e3 * study.stretchable, color=VERMILLION, linewidth=1.3, label="stretches")
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    legend_above(ax)
    hooke = study.magnitude[-1] * CHORD / float(study.cable.axial_stiffness)
    numbers = {
        "least_unstretchable_m": study.unstretchable.min(),
        "last_stretchable_m": study.stretchable[-1],
        "share_of_hooke": -study.stretchable[-1] / hooke,
    }
    return finding(
        "d-over-tension", numbers=numbers, panels=(draw.panel(figure, "Adjusting length as a function of T_x."),)
    )


def _relieved(study: StretchStudy, draw: Drawings) -> Finding:
    printed = 1e3 * (study.relieved - study.unstretchable)
    mended = 1e3 * (study.relieved_exactly - study.unstretchable)
    numbers = {"error_of_36_mm": np.abs(printed).max(), "error_with_mean_tension_mm": np.abs(mended).max()}
    figure, ax = axes("$|T|$ [N]", "$d$ [mm]")
    ax.plot(study.magnitude, 1e3 * study.unstretchable, color=BLUE, linewidth=2.4, alpha=0.5, label="does not stretch")
    ax.plot(study.magnitude, 1e3 * study.relieved, color=VERMILLION, linewidth=1.1, label="without stretch by (38)")
    ax.set_yscale("log")
    legend_above(ax)
    second, bx = axes("$|T|$ [N]", "error of $d$ [mm]")
    bx.plot(study.magnitude, printed, color=VERMILLION, linewidth=1.3, label="(36), (38)")
    bx.plot(study.magnitude, mended, color=GREEN, linewidth=1.3, label="without stretch by the mean tension")
    legend_above(bx)
    return finding(
        "stretch-removed",
        numbers=numbers,
        panels=(
            draw.panel(figure, "d over |T|: of the cable that does not stretch, and of the elastic cable with (38)."),
            draw.panel(second, "The difference between both."),
        ),
    )


def _tension(study: SagStudy, draw: Drawings) -> Finding:
    tensions = study.sampling.tensions
    figure, ax = axes("$T_x$ [N]", "$d$ [m]")
    ax.set_xscale("log")
    ax.set_yscale("log")
    d, a_d = (values[MIDDLE, PICKED, DENSE] for values in (study.adjusting_length, study.a_d))
    fits = a_d[:, None] * length_shape(tensions)
    Courses(tensions, d, tensions, fits, _named(study.sampling.chords[[*PICKED]], "g")).draw(ax, "$D$ [m]")
    share = study.adjusting_length / study.fitted_length
    numbers = {"exact_over_fit_min": share.min(), "exact_over_fit_max": share.max()}
    return finding(
        "d-model", numbers=numbers, panels=(draw.panel(figure, f"d {_middle_and_dense(study)}, with fits."),)
    )


def _chord(study: SagStudy, draw: Drawings) -> Finding:
    sampling = study.sampling
    fine = np.linspace(0.0, sampling.chords[-1], 80)
    fits = study.q_a[:, DENSE, None] * chord_shape(fine)
    courses = Courses(sampling.chords, study.a_d[..., DENSE], fine, fits, _named(sampling.angles, "g"))
    captions = (
        f"a_d {_middle_and_dense(study)} with its cubic (figure 11).",
        "The same at five angles (figure 12).",
    )
    away = _away(study.fitted_a_d, study.a_d)
    return finding(
        "a-over-chord",
        numbers={"cubic_away_share": away},
        panels=courses.panels(("$D$ [m]", "$a_d$ [m N²]", r"$\varphi$ [rad]"), MIDDLE, captions, draw),
    )


def _angle(study: SagStudy, draw: Drawings) -> Finding:
    sampling = study.sampling
    fine = np.linspace(0.0, 0.5 * np.pi, 100)
    fits = study.p_q[[*DRAWN], None] * angle_shape(fine)
    labels = _named(sampling.densities[[*DRAWN]], ".1f")
    courses = Courses(sampling.angles, study.q_a[:, DRAWN].T, fine, fits, labels)
    captions = (
        f"q_a at ρ = {n(sampling.densities[DENSE], unit='kg/m')} (figure 13).",
        "The same at five densities (figure 14).",
    )
    away = _away(study.fitted_q_a, study.q_a)
    return finding(
        "q-over-angle",
        numbers={"cos4_away_share": away},
        panels=courses.panels((r"$\varphi$ [rad]", "$q_a$ [N²/m²]", r"$\rho$ [kg/m]"), DENSE, captions, draw),
    )


def _density(study: SagStudy, draw: Drawings) -> Finding:
    densities = study.sampling.densities
    fine = np.linspace(0.0, densities[-1], 80)
    figure, ax = axes(r"$\rho$ [kg/m]", "$p_q$ [N²/m²]")
    with_fit(ax, densities, study.p_q, fine, study.k_p * density_shape(fine))
    each = study.p_q / density_shape(densities)
    second, bx = axes(r"$\rho$ [kg/m]", r"$p_q/\rho^2$ [m²/s⁴]")
    bx.plot(densities, each, "o-", color=BLUE, markersize=3.0, linewidth=1.1, label="density by density")
    bx.axhline(PUBLISHED_K_P, color=VERMILLION, linewidth=0.9, linestyle="--", label="published")
    bx.axhline(SHALLOW_K_P, color="0.4", linewidth=0.9, linestyle=":", label="$g^2/24$")
    legend_above(bx)
    return finding(
        "p-over-density",
        numbers={
            "k_p": study.k_p,
            "shallow_k_p": SHALLOW_K_P,
            "k_p_of_density": each,
            "densities_kg_per_m": densities,
        },
        panels=(
            draw.panel(figure, "p_q with the fitted parabola."),
            draw.panel(second, "p_q/ρ²; by (45) it would not depend on ρ."),
        ),
        heaviest=each[-1],
    )


def _named(values: Iterable[float], form: str) -> list[str]:
    return [format(value, form) for value in values]


def _middle_and_dense(study: SagStudy) -> str:
    """Text of the angle and density of the drawn cables, for a caption."""
    return f"at φ = {n(ANGLE, unit='rad')}, ρ = {n(study.sampling.densities[DENSE], unit='kg/m')}"


def _away(fit: Array, values: Array) -> float:
    """Largest distance from a fit, divided by the largest value, along the axis of the fit (the second to last one)."""
    return float((np.abs(fit - values).max(axis=-2) / values.max(axis=-2)).max())

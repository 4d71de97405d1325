"""Chapter: figures 8 to 15."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sagline.article.drawing import Courses, Drawings, axes, legend, with_fit
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
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, GREEN, VERMILLION
from sagline.present.page import Chapter, Finding, Verdict

CHORD = 10.0  # m
TENSIONS = np.linspace(10.0, 500.0, 150)  # N
MIDDLE, DENSE = 2, -1  # of the sampled angles: the article's; of the densities: the heaviest
PICKED = (1, 3, 5, 7)  # chords that are drawn
DRAWN = (1, 3, 5, 7, 9)  # densities that are drawn


def sag_chapter() -> Chapter:
    """From the adjusting length to k_p."""
    end = End.at_angle(CHORD)
    stretch, sag = stretch_study(simulated_cable(), end, TENSIONS), sag_study(published_sampling())
    draw = Drawings("sag")
    return Chapter(
        "sag",
        "The adjusting length and k_p",
        f"Figures 8 and 9 with the simulation's cable at D = {n(CHORD, unit='m')}; figures 10 to 15 with cables that "
        "do not "
        "stretch, sampled as above.",
        (
            _with_stretch(stretch, draw),
            _relieved(stretch, draw),
            _tension(sag, draw),
            _chord(sag, draw),
            _angle(sag, draw),
            _density(sag, draw),
        ),
    )


def _with_stretch(study: StretchStudy, draw: Drawings) -> Finding:
    figure, ax = axes("$T_x$ [N]", "$d$ [mm]")
    ax.plot(study.tensions, 1e3 * study.unstretchable, color=BLUE, linewidth=1.3, label="does not stretch")
    ax.plot(study.tensions, 1e3 * study.stretchable, color=VERMILLION, linewidth=1.3, label="stretches")
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    legend(ax)
    hooke = study.magnitude[-1] * CHORD / float(study.cable.axial_stiffness)
    numbers = {
        "least_unstretchable_m": study.unstretchable.min(),
        "last_stretchable_m": study.stretchable[-1],
        "share_of_hooke": -study.stretchable[-1] / hooke,
    }
    return Finding(
        key="d-over-tension",
        figures=(8,),
        title="d of stretchable and unstretchable cables",
        statement="Unstretchable: d ≥ 0 with d = 0 as asymptote. Stretchable: negative d, an inclined asymptote by "
        "Hooke's law.",
        measured=f"The least d of the unstretchable cable is {n(1e3 * numbers['least_unstretchable_m'], '.2g', 'mm')}; "
        f"with stretch d reaches {n(1e3 * numbers['last_stretchable_m'], '.3g', 'mm')}, "
        f"{n(numbers['share_of_hooke'], '.3f')} of |T|D/EA.",
        verdict=Verdict.HOLDS,
        numbers=numbers,
        panels=(draw.panel(figure, "Adjusting length over T_x."),),
    )


def _relieved(study: StretchStudy, draw: Drawings) -> Finding:
    printed = 1e3 * (study.relieved - study.unstretchable)
    mended = 1e3 * (study.relieved_exactly - study.unstretchable)
    numbers = {"error_of_36_mm": np.abs(printed).max(), "error_with_mean_tension_mm": np.abs(mended).max()}
    figure, ax = axes("$|T|$ [N]", "$d$ [mm]")
    ax.plot(study.magnitude, 1e3 * study.unstretchable, color=BLUE, linewidth=2.4, alpha=0.5, label="does not stretch")
    ax.plot(study.magnitude, 1e3 * study.relieved, color=VERMILLION, linewidth=1.1, label="stretch taken out, (38)")
    ax.set_yscale("log")
    legend(ax)
    second, bx = axes("$|T|$ [N]", "error of $d$ [mm]")
    bx.plot(study.magnitude, printed, color=VERMILLION, linewidth=1.3, label="(36), (38)")
    bx.plot(study.magnitude, mended, color=GREEN, linewidth=1.3, label="with the mean tension")
    legend(bx)
    return Finding(
        key="stretch-removed",
        figures=(9,),
        title="d with the elongation taken out",
        statement="(38): d = d_e + Δl with Δl = |T|L/EA of (36); red and blue dots coincide.",
        measured=f"They do to the eye at low tension, but (36) is {n(numbers['error_of_36_mm'], '.2g', 'mm')} too "
        "long: "
        "it stretches the cable with the tension at its upper end. With the mean tension "
        f"{n(numbers['error_with_mean_tension_mm'], '.2g', 'mm')} are left (erratum 5).",
        verdict=Verdict.HOLDS_WITHIN,
        numbers=numbers,
        panels=(
            draw.panel(figure, "d over |T|: unstretchable, and stretchable with (38)."),
            draw.panel(second, "The difference of the two."),
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
    return Finding(
        key="d-model",
        figures=(10,),
        title="d = a_d/T_x²",
        statement="(41): d = a_d/T_x², “the fittest and simplest”.",
        measured=f"The exact d divided by its fit is between {n(numbers['exact_over_fit_min'], '.3f')} and "
        f"{n(numbers['exact_over_fit_max'], '.3f')} over all sampled cables: the form is right for taut ones and bends "
        "for slack and steep ones.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers=numbers,
        panels=(draw.panel(figure, f"d {_middle_and_dense(study)}, with fits."),),
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
    return Finding(
        key="a-over-chord",
        figures=(11, 12),
        title="a_d is cubic in D",
        statement="(43): a_d = q_a(β) D³, the fittest; at every β.",
        measured=f"The cubic misses a_d by at most {n(100 * away, '.2g', '%')} of the largest a_d of its angle "
        "and density.",
        verdict=Verdict.HOLDS_WITHIN,
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
    return Finding(
        key="q-over-angle",
        figures=(13, 14),
        title="q_a goes with cos⁴ of the angle",
        statement="(44): q_a = p_q(ρ) cos⁴ β, chosen “experimentally”.",
        measured=f"cos⁴ misses q_a by at most {n(100 * away, '.2g', '%')} of the largest q_a of its density. It is no "
        "guess: d = D (wD cos φ)²/(24 τ²) of a shallow cable, with τ = T_x/cos φ.",
        verdict=Verdict.HOLDS_WITHIN,
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
    legend(bx)
    return Finding(
        key="p-over-density",
        figures=(15,),
        title="p_q is quadratic in ρ, and k_p",
        statement="(45): p_q = k_p ρ² with k_p ≈ 4.385.",
        measured=f"k_p = {n(study.k_p, '.4f')} with these tensions. Density by density it rises from "
        f"{n(each[0], '.3f')} (g²/24 = {n(SHALLOW_K_P, '.3f')}) to {n(each[-1], '.3f')}: the heaviest, slackest cables "
        "make the published value.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers={
            "k_p": study.k_p,
            "shallow_k_p": SHALLOW_K_P,
            "k_p_of_density": each,
            "densities_kg_per_m": densities,
        },
        panels=(
            draw.panel(figure, "p_q with its parabola."),
            draw.panel(second, "p_q over ρ² should not depend on ρ."),
        ),
    )


def _named(values: Iterable[float], form: str) -> list[str]:
    return [format(value, form) for value in values]


def _middle_and_dense(study: SagStudy) -> str:
    """Angle and density of the cables that are drawn, for a caption."""
    return f"at φ = {n(ANGLE, unit='rad')}, ρ = {n(study.sampling.densities[DENSE], unit='kg/m')}"


def _away(fit: Array, values: Array) -> float:
    """Largest distance of a fit, over the largest value along the fitted axis, the last but one."""
    return float((np.abs(fit - values).max(axis=-2) / values.max(axis=-2)).max())

"""Chapters about figures 6 to 15, and about the effect of the sampled tensions on the fitted constants."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes

from sagline.article import regressions as fits
from sagline.article.drawing import axes, chapter, finding, shades
from sagline.cables.model import CableState
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, GREEN, PURPLE, VERMILLION
from sagline.present.page import Chapter, Finding, table_of

MIDDLE, DENSE = 2, -1  # indices of the angle 0.754 rad and of the largest density among the samples
LOWEST = np.geomspace(40.0, 800.0, 12)  # values of the lowest sampled tension [N]
HIGHEST = np.geomspace(300.0, 40_000.0, 12)  # values of the highest sampled tension [N]
FACTORS = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0])


def intercept_chapter() -> Chapter:
    """Chapter about figures 6 and 7."""
    sampling = fits.published_sampling()
    platform, frame = fits.intercept_studies(sampling)
    return chapter(
        "intercept",
        (_over_chord(platform, frame), _over_density(platform, frame)),
        **{name: getattr(sampling, name)[[0, -1]] for name in ("chords", "densities", "tensions")},
    )


def constants_chapter() -> Chapter:
    """Chapter about the dependence of k_h and k_p on the sampled tensions."""
    sampling = fits.published_sampling()
    found = fits.published_range(sampling)
    over_lowest = [fits.constants(sampling.between(low, found.highest)) for low in LOWEST]
    over_highest = [fits.constants(sampling.between(found.lowest, high)) for high in HIGHEST]
    scaled = [fits.constants(sampling.between(f * found.lowest, f * found.highest)) for f in FACTORS]
    return chapter("constants", (_range(found, over_lowest, over_highest), _limit(scaled)))


def _over_chord(platform: fits.InterceptStudy, frame: fits.InterceptStudy) -> Finding:
    sampling = platform.sampling
    figure, ax = axes("$D$ [m]", r"$b_\pi$ [N]")
    picked = range(1, sampling.densities.size, 2)
    for k, color in zip(picked, shades(len(picked)), strict=True):
        label = f"{sampling.densities[k]:.1f}"
        ax.plot(sampling.chords, platform.intercept[MIDDLE, :, k], color=color, marker="o", markersize=3.0, label=label)
        ax.plot(sampling.chords, frame.intercept[MIDDLE, :, k], color=color, marker="s", markersize=3.0, linestyle="--")
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    caption = "b_π at φ = 0.754 rad: platform end (circles, solid), frame end (squares, dashed)."
    return finding(
        "b-over-chord",
        numbers={"nonproportional_share_platform": platform.bend, "nonproportional_share_frame": frame.bend},
        panels=((figure, caption, r"$\rho$ [kg/m]"),),
    )


def _over_density(platform: fits.InterceptStudy, frame: fits.InterceptStudy) -> Finding:
    sampling = platform.sampling
    figure, ax = axes(r"$\rho$ [kg/m]", r"$h_b$ [N/m]")
    for k, color in enumerate(shades(sampling.angles.size)):
        look: dict[str, Any] = {"color": color, "markersize": 2.6, "linewidth": 0.9}
        ax.plot(sampling.densities, platform.h_b[k], "o-", **look, label=f"{sampling.angles[k]:g}")
        ax.plot(sampling.densities, frame.h_b[k], "s--", **look)
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    caption = "h_b at five angles: platform end (circles), frame end (squares, dashed)."
    spread = np.ptp(frame.k_h_of_angle) / abs(frame.k_h)
    return finding(
        "h-over-density",
        numbers={
            "k_h_frame": frame.k_h,
            "k_h_platform": platform.k_h,
            "k_h_frame_of_angle": frame.k_h_of_angle,
            "k_h_platform_of_angle": platform.k_h_of_angle,
            "half_gravity": fits.SHALLOW_K_H,
            "k_h_spread_over_angles": spread,
        },
        panels=((figure, caption, r"$\varphi$ [rad]"),),
    )


def _range(
    found: fits.Constants, over_lowest: Sequence[fits.Constants], over_highest: Sequence[fits.Constants]
) -> Finding:
    figure, ax = axes("lowest sampled $T_x$ [N]", "$k_p$ [m²/s⁴]")
    _course(ax, over_lowest, "lowest", "k_p", BLUE, "regression")
    _references(ax, fits.PUBLISHED_K_P, fits.SHALLOW_K_P, "$g^2/24$")
    _logarithmic(ax, (50, 100, 200, 500))
    second, bx = axes("highest sampled $T_x$ [N]", "$|k_h|$ [m/s²]")
    _course(bx, over_highest, "highest", "k_h_frame", BLUE, "frame end")
    _course(bx, over_highest, "highest", "k_h_platform", PURPLE, "platform end")
    _references(bx, fits.PUBLISHED_K_H, fits.SHALLOW_K_H, "$g/2$")
    _logarithmic(bx, (500, 2000, 10_000, 40_000))
    all_k_p = [c.k_p for c in over_lowest]
    return finding(
        "published-range",
        numbers={
            "published_range": found._asdict(),
            "over_lowest": [c._asdict() for c in over_lowest],
            "over_highest": [c._asdict() for c in over_highest],
        },
        panels=(
            (figure, f"k_p over the lowest tension; the highest is {n(found.highest, '.3g', 'N')}."),
            (second, f"|k_h| over the highest tension; the lowest is {n(found.lowest, '.3g', 'N')}."),
        ),
        k_h=abs(found.k_h_frame),
        least_k_p=min(all_k_p),
        largest_k_p=max(all_k_p),
    )


def _limit(scaled: Sequence[fits.Constants]) -> Finding:
    figure, ax = axes("factor of both ends of the range", "deviation from the limit [%]")
    limits = {"k_p": fits.SHALLOW_K_P, "k_h_frame": fits.SHALLOW_K_H, "k_h_platform": fits.SHALLOW_K_H}
    labels = {"k_p": "$k_p$ from $g^2/24$", "k_h_frame": "$|k_h|$, frame end", "k_h_platform": "$|k_h|$, platform end"}
    for (name, limit), color in zip(limits.items(), (BLUE, VERMILLION, PURPLE), strict=True):
        away = [100.0 * abs(abs(getattr(c, name)) / limit - 1.0) for c in scaled]
        ax.semilogy(FACTORS, away, color=color, marker="o", markersize=3.0, linewidth=1.1, label=labels[name])
    _logarithmic(ax, tuple(FACTORS.astype(int)))
    shown = table_of(
        "The constants by the article's regressions",
        ("factor", [*(f"{factor:g}" for factor in FACTORS), "limit"], ""),
        ("lowest T_x [N]", [*(c.lowest for c in scaled), "∞"], ",.0f"),
        ("highest T_x [N]", [*(c.highest for c in scaled), "∞"], ",.0f"),
        ("k_h platform end [m/s²]", [*(c.k_h_platform for c in scaled), fits.SHALLOW_K_H], "+.5f"),
        ("k_h frame end [m/s²]", [*(c.k_h_frame for c in scaled), -fits.SHALLOW_K_H], ".5f"),
        ("k_p [m²/s⁴]", [*(c.k_p for c in scaled), fits.SHALLOW_K_P], ".5f"),
    )
    return finding(
        "taut-limit",
        numbers={"scaled": [c._asdict() for c in scaled], "factors": FACTORS, "g_squared_over_24": fits.SHALLOW_K_P},
        panels=((figure, "Deviation of |k_h| from g/2, and of k_p from g²/24."),),
        data=(shown,),
        factor=FACTORS[-1],
        last=scaled[-1],
    )


def _course(ax: Axes, course: Sequence[fits.Constants], x: str, y: str, color: str, label: str) -> None:
    places, values = ([abs(getattr(c, name)) for c in course] for name in (x, y))
    ax.plot(places, values, "o-", color=color, markersize=3.0, linewidth=1.1, label=label)


def _references(ax: Axes, published: float, shallow: float, label: str) -> None:
    """Draw the published value of a constant, and its value for taut cables with the text `label`."""
    ax.axhline(published, color=VERMILLION, linewidth=0.9, linestyle="--", label="published")
    ax.axhline(shallow, color="0.4", linewidth=0.9, linestyle=":", label=label)


def _logarithmic(ax: Axes, ticks: tuple[int, ...]) -> None:
    ax.set_xscale("log")
    ax.minorticks_off()
    ax.set_xticks(ticks, labels=[str(tick) for tick in ticks])


CHORD = 10.0  # [m]
TENSIONS = np.linspace(10.0, 500.0, 150)  # [N]
PICKED = (1, 3, 5, 7)  # indices of the chords that are drawn
DRAWN = (1, 3, 5, 7, 9)  # indices of the densities that are drawn


def sag_chapter() -> Chapter:
    """Chapter about the regressions that lead from the adjusting length to k_p."""
    end = fits.end_at_angle(CHORD)
    stiff, soft, printed, right = fits.stretch_study(fits.simulated_cable(), end, TENSIONS)
    sag = fits.SagStudy(fits.published_sampling())
    fitted = [find(sag) for find in (_tension, _chord, _angle, _density)]
    return chapter("sag", [_with_stretch(stiff, soft), _relieved(stiff, printed, right), *fitted], chord=CHORD)


def _with_stretch(stiff: CableState, soft: CableState) -> Finding:
    figure, ax = axes("$T_x$ [N]", "$d$ [mm]")
    ax.plot(stiff.horizontal_tension, 1e3 * stiff.adjusting_length, color=BLUE, linewidth=1.3, label="does not stretch")
    ax.plot(stiff.horizontal_tension, 1e3 * soft.adjusting_length, color=VERMILLION, linewidth=1.3, label="stretches")
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    hooke = stiff.platform_end_tension[-1] * CHORD / float(fits.simulated_cable().axial_stiffness)
    numbers = {
        "least_unstretchable_m": stiff.adjusting_length.min(),
        "last_stretchable_m": soft.adjusting_length[-1],
        "share_of_hooke": -soft.adjusting_length[-1] / hooke,
    }
    return finding("d-over-tension", numbers=numbers, panels=((figure, "Adjusting length as a function of T_x."),))


def _relieved(stiff: CableState, printed: Array, right: Array) -> Finding:
    """Finding about lengths [m] without elongation: `printed` by (36) and (38), `right` by the mean tension."""
    force, length = stiff.platform_end_tension, stiff.adjusting_length
    off, left = (1e3 * (each - length) for each in (printed, right))
    numbers = {"error_of_36_mm": np.abs(off).max(), "error_with_mean_tension_mm": np.abs(left).max()}
    figure, ax = axes("$|T|$ [N]", "$d$ [mm]")
    ax.plot(force, 1e3 * length, color=BLUE, linewidth=2.4, alpha=0.5, label="does not stretch")
    ax.plot(force, 1e3 * printed, color=VERMILLION, linewidth=1.1, label="without stretch by (38)")
    ax.set_yscale("log")
    second, bx = axes("$|T|$ [N]", "error of $d$ [mm]")
    bx.plot(force, off, color=VERMILLION, linewidth=1.3, label="(36), (38)")
    bx.plot(force, left, color=GREEN, linewidth=1.3, label="without stretch by the mean tension")
    caption = "d over |T|: of the cable that does not stretch, and of the elastic cable with (38)."
    panels = (figure, caption), (second, "The difference between both.")
    return finding("stretch-removed", numbers=numbers, panels=panels)


def _tension(study: fits.SagStudy) -> Finding:
    tensions = study.sampling.tensions
    figure, ax = axes("$T_x$ [N]", "$d$ [m]")
    ax.set_xscale("log")
    ax.set_yscale("log")
    d, a_d = (values[MIDDLE, PICKED, DENSE] for values in (study.adjusting_length, study.a_d))
    curves = a_d[:, None] * tensions**-2
    _draw_courses(ax, (tensions, d, tensions, curves, _named(study.sampling.chords[[*PICKED]], "g")))
    share = study.adjusting_length / study.fitted_length
    numbers = {"exact_over_fit_min": share.min(), "exact_over_fit_max": share.max()}
    return finding(
        "d-model", numbers=numbers, panels=((figure, f"d {_middle_and_dense(study)}, with fits.", "$D$ [m]"),)
    )


def _chord(study: fits.SagStudy) -> Finding:
    sampling = study.sampling
    fine = np.linspace(0.0, sampling.chords[-1], 80)
    curves = study.q_a[:, DENSE, None] * fine**3
    courses = sampling.chords, study.a_d[..., DENSE], fine, curves, _named(sampling.angles, "g")
    captions = (f"a_d {_middle_and_dense(study)} with its cubic (figure 11).", "The same at five angles (figure 12).")
    numbers = {"cubic_away_share": _away(study.fitted_a_d, study.a_d)}
    labels = "$D$ [m]", "$a_d$ [m N²]", r"$\varphi$ [rad]"
    return _course_finding("a-over-chord", numbers, courses, labels, MIDDLE, captions)


def _angle(study: fits.SagStudy) -> Finding:
    sampling = study.sampling
    fine = np.linspace(0.0, 0.5 * np.pi, 100)
    curves = study.p_q[[*DRAWN], None] * np.cos(fine) ** 4
    legend = _named(sampling.densities[[*DRAWN]], ".1f")
    courses = sampling.angles, study.q_a[:, DRAWN].T, fine, curves, legend
    captions = (
        f"q_a at ρ = {n(sampling.densities[DENSE], unit='kg/m')} (figure 13).",
        "The same at five densities (figure 14).",
    )
    numbers = {"cos4_away_share": _away(study.fitted_q_a, study.q_a)}
    labels = r"$\varphi$ [rad]", "$q_a$ [N²/m²]", r"$\rho$ [kg/m]"
    return _course_finding("q-over-angle", numbers, courses, labels, DENSE, captions)


def _density(study: fits.SagStudy) -> Finding:
    densities = study.sampling.densities
    fine = np.linspace(0.0, densities[-1], 80)
    figure, ax = axes(r"$\rho$ [kg/m]", "$p_q$ [N²/m²]")
    _with_fit(ax, densities, study.p_q, fine, study.k_p * fine**2)
    each = study.p_q / densities**2
    second, bx = axes(r"$\rho$ [kg/m]", r"$p_q/\rho^2$ [m²/s⁴]")
    bx.plot(densities, each, "o-", color=BLUE, markersize=3.0, linewidth=1.1, label="density by density")
    _references(bx, fits.PUBLISHED_K_P, fits.SHALLOW_K_P, "$g^2/24$")
    return finding(
        "p-over-density",
        numbers={
            "k_p": study.k_p,
            "shallow_k_p": fits.SHALLOW_K_P,
            "k_p_of_density": each,
            "densities_kg_per_m": densities,
        },
        panels=((figure, "p_q with the fitted parabola."), (second, "p_q/ρ²; by (45) it would not depend on ρ.")),
        heaviest=each[-1],
    )


def _with_fit(ax: Axes, x: Array, y: Array, fine: Array, fit: Array) -> None:
    """Draw samples `y` at `x`, and the curve `fit` at `fine`, which was fitted to the samples."""
    ax.plot(x, y, "o", color=BLUE, markersize=3.5, label="exact")
    ax.plot(fine, fit, color="black", linewidth=0.9, label="fit")


# k curves: abscissae (n,) and values (k, n) of samples, abscissae (l,) and values (k, l) of fitted curves, k names
_Courses: TypeAlias = tuple[Array, Array, Array, Array, list[str]]


def _draw_courses(ax: Axes, courses: _Courses) -> None:
    """Draw the samples and fitted curves of all `courses`; the colors change from dark to light."""
    x, rows, fine, curves, names = courses
    for row, fit, name, color in zip(rows, curves, names, shades(len(names)), strict=True):
        ax.plot(x, row, "o", color=color, markersize=2.6, label=name)
        ax.plot(fine, fit, color=color, linewidth=0.9)


def _course_finding(
    key: str,
    numbers: dict[str, Any],
    courses: _Courses,
    labels: tuple[str, str, str],
    one: int,
    captions: tuple[str, str],
) -> Finding:
    """Finding with two panels: the curve with the index `one`, and all curves."""
    # labels: label of x, label of y, title of the legend
    x, rows, fine, curves, _ = courses
    figure, ax = axes(*labels[:2])
    _with_fit(ax, x, rows[one], fine, curves[one])
    second, bx = axes(*labels[:2])
    _draw_courses(bx, courses)
    return finding(key, numbers, panels=((figure, captions[0]), (second, captions[1], labels[2])))


def _named(values: Iterable[float], form: str) -> list[str]:
    return [format(value, form) for value in values]


def _middle_and_dense(study: fits.SagStudy) -> str:
    """Part of a caption: angle and density of the drawn cables."""
    return f"at φ = {n(fits.ANGLE, unit='rad')}, ρ = {n(study.sampling.densities[DENSE], unit='kg/m')}"


def _away(fit: Array, values: Array) -> float:
    """Largest difference between fit and values along the axis -2, divided by the largest value."""
    return float((np.abs(fit - values).max(axis=-2) / values.max(axis=-2)).max())

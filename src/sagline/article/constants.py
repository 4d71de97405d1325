"""Chapters: figures 6 and 7, and the dependence of the constants on the sampled tensions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.article.drawing import Drawings, axes, legend, shades
from sagline.article.regressions import (
    PUBLISHED_K_H,
    PUBLISHED_K_P,
    SHALLOW_K_H,
    SHALLOW_K_P,
    Constants,
    ConstantsStudy,
    InterceptStudy,
    constants_study,
    intercept_studies,
    published_sampling,
)
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, PURPLE, VERMILLION
from sagline.present.page import Chapter, Finding, Verdict, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MIDDLE = 2  # of the sampled angles: the article's 0.754 rad
LOWEST = np.geomspace(40.0, 800.0, 12)  # N
HIGHEST = np.geomspace(300.0, 40_000.0, 12)  # N
FACTORS = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0])


def intercept_chapter() -> Chapter:
    """Figures 6 and 7."""
    sampling = published_sampling()
    platform, frame = intercept_studies(sampling)
    draw = Drawings("intercept")
    return Chapter(
        "intercept",
        "The intercept of π",
        f"Lines T_z(T_x) fitted to exact cables: chords {n(sampling.chords[0])} to "
        f"{n(sampling.chords[-1], unit='m')}, ρ up to "
        f"{n(sampling.densities[-1], unit='kg/m')}, T_x from {n(sampling.tensions[0], '.3g', 'N')} to "
        f"{n(sampling.tensions[-1], '.3g', 'N')}, the range in which the article's constants come out "
        "(see below). Each at both ends of the cable.",
        (_over_chord(platform, frame, draw), _over_density(platform, frame, draw)),
    )


def constants_chapter() -> Chapter:
    """Dependence of k_h and k_p on the sampled tensions."""
    study = constants_study(published_sampling(), LOWEST, HIGHEST, FACTORS)
    draw = Drawings("constants")
    return Chapter(
        "constants",
        "What the constants depend on",
        "The article does not print the tensions it sampled. They decide what the regressions give.",
        (_range(study, draw), _limit(study, draw)),
    )


def _over_chord(platform: InterceptStudy, frame: InterceptStudy, draw: Drawings) -> Finding:
    sampling = platform.sampling
    figure, ax = axes("$D$ [m]", r"$b_\pi$ [N]")
    picked = range(1, sampling.densities.size, 2)
    for k, color in zip(picked, shades(len(picked)), strict=True):
        label = f"{sampling.densities[k]:.1f}"
        ax.plot(sampling.chords, platform.intercept[MIDDLE, :, k], color=color, marker="o", markersize=3.0, label=label)
        ax.plot(sampling.chords, frame.intercept[MIDDLE, :, k], color=color, marker="s", markersize=3.0, linestyle="--")
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    legend(ax, r"$\rho$ [kg/m]")
    bent = [_bend(sampling.chords[:, None], study.intercept, study.h_b[:, None, :]) for study in (platform, frame)]
    return Finding(
        key="b-over-chord",
        figures=(6,),
        title="b_π is proportional to D",
        statement="(27): b_π = h_b(ρ) D.",
        measured=f"So it is: away from the proportion by at most {n(100 * bent[0], '.2g', '%')} of the largest b_π at "
        "the "
        f"platform end and {n(100 * bent[1], '.2g', '%')} at the frame end.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers={"nonproportional_share_platform": bent[0], "nonproportional_share_frame": bent[1]},
        panels=(
            draw.panel(figure, "b_π at φ = 0.754 rad: platform end (circles, solid), frame end (squares, dashed)."),
        ),
    )


def _over_density(platform: InterceptStudy, frame: InterceptStudy, draw: Drawings) -> Finding:
    sampling = platform.sampling
    figure, ax = axes(r"$\rho$ [kg/m]", r"$h_b$ [N/m]")
    for k, color in enumerate(shades(sampling.angles.size)):
        label = f"{sampling.angles[k]:g}"
        ax.plot(
            sampling.densities, platform.h_b[k], color=color, marker="o", markersize=2.6, linewidth=0.9, label=label
        )
        ax.plot(
            sampling.densities, frame.h_b[k], color=color, marker="s", markersize=2.6, linewidth=0.9, linestyle="--"
        )
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    legend(ax, r"$\varphi$ [rad]")
    spread = np.ptp(frame.k_h_of_angle) / abs(frame.k_h)
    return Finding(
        key="h-over-density",
        figures=(7,),
        title="h_b is proportional to ρ, and k_h",
        statement="h_b is linearly decreasing in ρ and does not depend on β; h_b = k_h ρ with |k_h| ≈ 4.845, "
        "approximately half of g; (28): h_b = −ρg/2.",
        measured=f"k_h = {n(frame.k_h, '.4f', 'm/s²')} at the frame end, {n(platform.k_h, '+.4f', 'm/s²')} at the "
        "platform "
        f"end; g/2 = {n(SHALLOW_K_H)}. The decreasing h_b of the article's figure is the frame end's; the force on the "
        f"platform needs the other, rising one. Over the angles k_h varies by {n(100 * spread, '.2g', '%')}.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers={
            "k_h_frame": frame.k_h,
            "k_h_platform": platform.k_h,
            "k_h_frame_of_angle": frame.k_h_of_angle,
            "k_h_platform_of_angle": platform.k_h_of_angle,
            "half_gravity": SHALLOW_K_H,
            "k_h_spread_over_angles": spread,
        },
        panels=(draw.panel(figure, "h_b at five angles: platform end (circles), frame end (squares, dashed)."),),
    )


def _range(study: ConstantsStudy, draw: Drawings) -> Finding:
    found = study.published
    figure, ax = axes("lowest sampled $T_x$ [N]", "$k_p$ [m²/s⁴]")
    _course(ax, study.over_lowest, "lowest", "k_p", BLUE, "regression")
    ax.axhline(PUBLISHED_K_P, color=VERMILLION, linewidth=0.9, linestyle="--", label="published")
    ax.axhline(SHALLOW_K_P, color="0.4", linewidth=0.9, linestyle=":", label="$g^2/24$")
    _logarithmic(ax, (50, 100, 200, 500))
    legend(ax)
    second, bx = axes("highest sampled $T_x$ [N]", "$|k_h|$ [m/s²]")
    _course(bx, study.over_highest, "highest", "k_h_frame", BLUE, "frame end")
    _course(bx, study.over_highest, "highest", "k_h_platform", PURPLE, "platform end")
    bx.axhline(PUBLISHED_K_H, color=VERMILLION, linewidth=0.9, linestyle="--", label="published")
    bx.axhline(SHALLOW_K_H, color="0.4", linewidth=0.9, linestyle=":", label="$g/2$")
    _logarithmic(bx, (500, 2000, 10_000, 40_000))
    legend(bx)
    all_k_p = [c.k_p for c in study.over_lowest]
    return Finding(
        key="published-range",
        title="the range of tensions that gives the published constants",
        statement="“Based on our taken data” k_h ≈ 4.845; “based on the non-linear regression method” k_p ≈ 4.385. "
        "The tensions are not given.",
        measured=f"With T_x evenly spaced from {n(found.lowest, '.1f', 'N')} to {n(found.highest, '.2f', 'N')} the "
        f"article's regressions give both: |k_h| = {n(abs(found.k_h_frame), '.4f')} at the frame end and k_p = "
        f"{n(found.k_p, '.4f')}. With other lower ends k_p runs from {n(min(all_k_p), '.3g')} to "
        f"{n(max(all_k_p), '.3g')}: the least squares of d = a_d/T_x² hear the slackest cables alone. This is one "
        "range that fits, for our choice of chords, angles and densities, not proof that it was theirs.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers={
            "published_range": found._asdict(),
            "over_lowest": [c._asdict() for c in study.over_lowest],
            "over_highest": [c._asdict() for c in study.over_highest],
        },
        panels=(
            draw.panel(figure, f"k_p over the lowest tension, up to {n(found.highest, '.3g', 'N')}."),
            draw.panel(second, f"|k_h| over the highest tension, from {n(found.lowest, '.3g', 'N')}."),
        ),
    )


def _limit(study: ConstantsStudy, draw: Drawings) -> Finding:
    last = study.scaled[-1]
    figure, ax = axes("factor on both ends of the range", "distance from the limit [%]")
    limits = {"k_p": SHALLOW_K_P, "k_h_frame": SHALLOW_K_H, "k_h_platform": SHALLOW_K_H}
    labels = {"k_p": "$k_p$ from $g^2/24$", "k_h_frame": "$|k_h|$, frame end", "k_h_platform": "$|k_h|$, platform end"}
    for (name, limit), color in zip(limits.items(), (BLUE, VERMILLION, PURPLE), strict=True):
        away = [100.0 * abs(abs(getattr(c, name)) / limit - 1.0) for c in study.scaled]
        ax.semilogy(FACTORS, away, color=color, marker="o", markersize=3.0, linewidth=1.1, label=labels[name])
    _logarithmic(ax, tuple(FACTORS.astype(int)))
    legend(ax)
    return Finding(
        key="taut-limit",
        title="taut cables: g/2 and g²/24",
        statement="k_h is “approximately equal to half of gravitational acceleration”; k_p cannot be "
        "formulated exactly.",
        measured=f"As tensions grow, |k_h| tends to g/2 at both ends and k_p to g²/24: at {n(FACTORS[-1])} times the "
        f"range they are {n(last.k_h_platform, '.4f')}, {n(last.k_h_frame, '.4f')} and {n(last.k_p, '.4f')}. Both "
        "follow from the exact equations to first order in sag.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers={"scaled": [c._asdict() for c in study.scaled], "factors": FACTORS, "g_squared_over_24": SHALLOW_K_P},
        panels=(draw.panel(figure, "How far the constants are from g/2 and g²/24."),),
        data=(
            table_of(
                "The constants by the article's regressions",
                ("factor", [*(f"{factor:g}" for factor in FACTORS), "limit"], ""),
                ("lowest T_x [N]", [*(c.lowest for c in study.scaled), "∞"], ",.0f"),
                ("highest T_x [N]", [*(c.highest for c in study.scaled), "∞"], ",.0f"),
                ("k_h platform end [m/s²]", [*(c.k_h_platform for c in study.scaled), SHALLOW_K_H], "+.5f"),
                ("k_h frame end [m/s²]", [*(c.k_h_frame for c in study.scaled), -SHALLOW_K_H], ".5f"),
                ("k_p [m²/s⁴]", [*(c.k_p for c in study.scaled), SHALLOW_K_P], ".5f"),
            ),
        ),
    )


def _course(ax: Axes, course: tuple[Constants, ...], x: str, y: str, color: str, label: str) -> None:
    values = [abs(getattr(c, y)) for c in course]
    ax.plot(
        [getattr(c, x) for c in course], values, color=color, marker="o", markersize=3.0, linewidth=1.1, label=label
    )


def _logarithmic(ax: Axes, ticks: tuple[int, ...]) -> None:
    ax.set_xscale("log")
    ax.minorticks_off()
    ax.set_xticks(ticks, labels=[str(tick) for tick in ticks])


def _bend(chords: Array, intercept: Array, h_b: Array) -> float:
    return float(np.abs(intercept - h_b * chords).max() / np.abs(intercept).max())

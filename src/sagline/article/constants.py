"""Chapters about figures 6 and 7, and about the dependence of the constants on the sampled tensions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.article.drawing import Drawings, axes, legend_above, shades
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
from sagline.article.texts import chapter, finding
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, PURPLE, VERMILLION
from sagline.present.page import Chapter, Finding, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MIDDLE = 2  # index of the article's angle of 0.754 rad among the samples
LOWEST = np.geomspace(40.0, 800.0, 12)  # lowest sampled tensions [N]
HIGHEST = np.geomspace(300.0, 40_000.0, 12)  # highest sampled tensions [N]
FACTORS = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0])


def intercept_chapter() -> Chapter:
    """Chapter about figures 6 and 7."""
    sampling = published_sampling()
    platform, frame = intercept_studies(sampling)
    draw = Drawings("intercept")
    return chapter(
        "intercept",
        (_over_chord(platform, frame, draw), _over_density(platform, frame, draw)),
        **{name: getattr(sampling, name)[[0, -1]] for name in ("chords", "densities", "tensions")},
    )


def constants_chapter() -> Chapter:
    """Chapter about the dependence of k_h and k_p on the sampled tensions."""
    study = constants_study(published_sampling(), LOWEST, HIGHEST, FACTORS)
    draw = Drawings("constants")
    return chapter("constants", (_range(study, draw), _limit(study, draw)))


def _over_chord(platform: InterceptStudy, frame: InterceptStudy, draw: Drawings) -> Finding:
    sampling = platform.sampling
    figure, ax = axes("$D$ [m]", r"$b_\pi$ [N]")
    picked = range(1, sampling.densities.size, 2)
    for k, color in zip(picked, shades(len(picked)), strict=True):
        label = f"{sampling.densities[k]:.1f}"
        ax.plot(sampling.chords, platform.intercept[MIDDLE, :, k], color=color, marker="o", markersize=3.0, label=label)
        ax.plot(sampling.chords, frame.intercept[MIDDLE, :, k], color=color, marker="s", markersize=3.0, linestyle="--")
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    legend_above(ax, r"$\rho$ [kg/m]")
    bent = [_bend(sampling.chords[:, None], study.intercept, study.h_b[:, None, :]) for study in (platform, frame)]
    return finding(
        "b-over-chord",
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
    legend_above(ax, r"$\varphi$ [rad]")
    spread = np.ptp(frame.k_h_of_angle) / abs(frame.k_h)
    return finding(
        "h-over-density",
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
    legend_above(ax)
    second, bx = axes("highest sampled $T_x$ [N]", "$|k_h|$ [m/s²]")
    _course(bx, study.over_highest, "highest", "k_h_frame", BLUE, "frame end")
    _course(bx, study.over_highest, "highest", "k_h_platform", PURPLE, "platform end")
    bx.axhline(PUBLISHED_K_H, color=VERMILLION, linewidth=0.9, linestyle="--", label="published")
    bx.axhline(SHALLOW_K_H, color="0.4", linewidth=0.9, linestyle=":", label="$g/2$")
    _logarithmic(bx, (500, 2000, 10_000, 40_000))
    legend_above(bx)
    all_k_p = [c.k_p for c in study.over_lowest]
    return finding(
        "published-range",
        numbers={
            "published_range": found._asdict(),
            "over_lowest": [c._asdict() for c in study.over_lowest],
            "over_highest": [c._asdict() for c in study.over_highest],
        },
        panels=(
            draw.panel(figure, f"k_p over the lowest tension; the highest is {n(found.highest, '.3g', 'N')}."),
            draw.panel(second, f"|k_h| over the highest tension; the lowest is {n(found.lowest, '.3g', 'N')}."),
        ),
        k_h=abs(found.k_h_frame),
        least_k_p=min(all_k_p),
        largest_k_p=max(all_k_p),
    )


def _limit(study: ConstantsStudy, draw: Drawings) -> Finding:
    last = study.scaled[-1]
    figure, ax = axes("factor of both ends of the range", "deviation from the limit [%]")
    limits = {"k_p": SHALLOW_K_P, "k_h_frame": SHALLOW_K_H, "k_h_platform": SHALLOW_K_H}
    labels = {"k_p": "$k_p$ from $g^2/24$", "k_h_frame": "$|k_h|$, frame end", "k_h_platform": "$|k_h|$, platform end"}
    for (name, limit), color in zip(limits.items(), (BLUE, VERMILLION, PURPLE), strict=True):
        away = [100.0 * abs(abs(getattr(c, name)) / limit - 1.0) for c in study.scaled]
        ax.semilogy(FACTORS, away, color=color, marker="o", markersize=3.0, linewidth=1.1, label=labels[name])
    _logarithmic(ax, tuple(FACTORS.astype(int)))
    legend_above(ax)
    return finding(
        "taut-limit",
        numbers={"scaled": [c._asdict() for c in study.scaled], "factors": FACTORS, "g_squared_over_24": SHALLOW_K_P},
        panels=(draw.panel(figure, "Deviation of |k_h| from g/2, and of k_p from g²/24."),),
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
        factor=FACTORS[-1],
        last=last,
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

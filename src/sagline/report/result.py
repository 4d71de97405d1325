"""The picture of the first screen: what each cable model costs."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.ticker import FixedLocator, NullLocator

from sagline.article.simulation import ERROR_BAND
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, VERMILLION
from sagline.report.blocks import Chapter, Panel
from sagline.report.drawing import NAMES, Drawings, axes, legend

KEY = "five-models"  # of the finding whose numbers it shows
FIRST, LAST = 1e-3, 1e4  # mm, of the axis; what is smaller is written at its edge
ROBOTS = (("suspended", BLUE, -0.16), ("mixed", VERMILLION, 0.16))


def picture(chapters: Sequence[Chapter]) -> Panel | None:
    """The largest position error of each model for both robots; None where the report does not have them."""
    numbers = next((f.numbers for c in chapters for f in c.findings if f.key == KEY), None)
    if numbers is None:
        return None
    models = numbers["largest_error"]
    figure, ax = axes("largest position error [mm]", "", height=2.7)
    figure.subplots_adjust(left=0.2)
    ax.axvline(1e3 * ERROR_BAND, color="0.4", linewidth=0.9, linestyle=":", label=f"article: {n(ERROR_BAND, unit='m')}")
    for robot, color, shift in ROBOTS:
        errors = [model[f"{robot}_mm"] for model in models.values()]
        ax.plot(errors, [k + shift for k in range(len(errors))], "o", color=color, markersize=5.0, label=robot)
        for k, error in enumerate(errors):
            text = n(error, ".2g", "mm", size=1e3 * numbers["longest_length_m"])
            place, away = (max(error, FIRST), k + shift), -7.0 if FIRST < error < 1e3 * ERROR_BAND else 7.0
            side = "left" if away > 0.0 else "right"  # of the line of the article
            ax.annotate(text, place, (away, 0.0), textcoords="offset points", fontsize=NAMES, va="center", ha=side)
    ax.set_xscale("log")
    ax.set_xlim(FIRST, LAST)
    ax.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(-3, 4)]))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_yticks(range(len(models)), labels=list(models))
    ax.set_ylim(len(models) - 0.5, -0.5)
    legend(ax)
    return Drawings("result").panel(
        figure, "Lengths planned with each cable model, wound onto exact cables along the article's path."
    )

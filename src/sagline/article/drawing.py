"""Findings and chapters of the report with texts from data/report.toml, and drawings that are readable on a phone."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from math import ceil
from string import Formatter
from typing import Any, TypeAlias, cast

import matplotlib
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.contour import ContourSet
from matplotlib.path import Path

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.labels import ABOVE as LEGEND
from sagline.plot.labels import legend_columns
from sagline.plot.sheet import GAP_COLOR, LABEL, TICK, Sheet, cable_look, format_axes, svg_text, unique_names
from sagline.present.page import Chapter, Finding, Panel, Table, Verdict


class _Numbers(Formatter):
    """Formatter of numbers in texts with fields such as {extent:.3g mm}, {100*share:.1f %} and {errors[2]:.2f}."""

    def get_field(self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> tuple[Any, Any]:
        """Value of the field `field_name`, multiplied by the factor before its name, as in 100*share."""
        factor, _, name = field_name.rpartition("*")
        value, key = super().get_field(name, args, kwargs)
        return (float(factor) * value if factor else value), key

    def format_field(self, value: Any, format_spec: str) -> str:
        """Text of a number with the format and the unit that `format_spec` contains, as in .3g mm."""
        form, _, unit = format_spec.partition(" ")
        return n(value, form or ".4g", unit) if format_spec else str(value)


@cache
def _texts() -> dict[str, dict[str, Any]]:
    return tomllib.loads(files("sagline.article").joinpath("data/report.toml").read_text(encoding="utf-8"))


def finding(
    key: str,
    numbers: dict[str, Any] | None = None,
    *,
    verdict: Verdict | None = None,
    panels: Sequence[Drawing] = (),
    data: Sequence[Table] = (),
    **words: Any,
) -> Finding:
    """Create the finding `key` with texts that contain values from `numbers` and `words`; `numbers` are also saved."""
    entry, known = _texts()["findings"][key], numbers or {}
    statement, measured = (_Numbers().format(entry.get(part, ""), **{**known, **words}) for part in _PARTS)
    chosen = Verdict[entry["verdict"]] if verdict is None else verdict
    return Finding(
        key,
        entry["title"],
        statement,
        measured,
        chosen,
        known,
        figures=tuple(entry.get("figures", ())),
        tables=tuple(entry.get("tables", ())),
        panels=tuple(panel_of(f"{key}-{k}", *drawing) for k, drawing in enumerate(panels)),
        data=tuple(data),
    )


def chapter(key: str, findings: Sequence[Finding], **words: Any) -> Chapter:
    """Create the chapter `key`; its introduction contains values from `words`."""
    entry = _texts()["chapters"][key]
    return Chapter(key, entry["title"], _Numbers().format(entry["lead"], **words), tuple(findings))


_PARTS = ("statement", "measured")


WIDTH, HEIGHT = 4.6, 3.1  # size of a drawing on a desktop screen [in]; a phone shows four fifths of this size
LEFT, RIGHT, BELOW, ABOVE = 0.16, 0.975, 0.5, 0.12  # margins; left, right: relative to the width, below, above: [in]
POINT = 1.0 / 72.0  # [in]
APART = 40.0  # smallest distance between the numbers that are written at two contour lines [pt]
NAME_SIZE = TICK  # text size of legends [pt]
SHARES = np.array([0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8])  # possible positions of a number along its contour line
SHADES = "viridis"
MOST_POINTS = 400  # largest number of points of a curve over time, because the size of the page is limited

_remarks = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|\n\s*(?=\n)", flags=re.DOTALL)
_size = re.compile(r' (?:width|height)="[^"]*pt"')
HALO = (patheffects.withStroke(linewidth=2.2, foreground="white"),)
LOOK: dict[str, Any] = {"colors": "black", "linestyles": "-", "linewidths": 0.8}
MAP_LEFT, MAP_RIGHT = 0.13, 0.9  # margins with space for a color bar


# figure, caption, and the title of its legend; a figure has a legend if its curves have labels
Drawing: TypeAlias = tuple[Sheet, str] | tuple[Sheet, str, str]


def panel_of(name: str, figure: Sheet, caption: str, legend: str = "") -> Panel:
    """Convert a `Drawing` to a drawing of a page, whose identifiers begin with `name`."""
    if figure.axes[0].get_legend_handles_labels()[1]:
        legend_above(figure.axes[0], legend)
    svg = svg_text(figure, 200, **{"svg.hashsalt": "sagline", "svg.fonttype": "path"})
    svg = _size.sub("", _remarks.sub("", svg).strip(), count=2)  # the page determines the size
    svg = svg.replace("<svg ", f'<svg role="img" aria-label="{escape(caption)}" ', 1)
    return Panel(unique_names(svg, f"{name}-"), caption)


def axes(x: str, y: str, height: float = HEIGHT) -> tuple[Sheet, Axes]:
    """A small figure with one pair of axes."""
    figure = Sheet(figsize=(WIDTH, height))  # fixed margins take half of the time of an automatic layout
    figure.subplots_adjust(left=LEFT, right=RIGHT, bottom=BELOW / height, top=1.0 - ABOVE / height)
    ax = figure.add_subplot()
    format_axes(ax, x, y)
    return figure, ax


def legend_above(ax: Axes, title: str = "") -> None:
    """Draw a legend above the axes, with as many columns as fit, and make the figure higher by the legend's height."""
    figure = cast(Sheet, ax.get_figure(root=True))
    handles, labels = ax.get_legend_handles_labels()
    room = ax.get_position().width * figure.get_figwidth()
    columns = legend_columns(labels, room, NAME_SIZE)
    rows = ceil(len(labels) / columns) + bool(title)
    grown = (1.45 * rows + 0.4) * NAME_SIZE * POINT
    _grow(figure, grown)
    look = {**LEGEND, "fontsize": NAME_SIZE, "title_fontsize": NAME_SIZE, "ncols": columns}
    ax.legend(handles, labels, title=title or None, **look, borderaxespad=0.2, labelspacing=0.25)


def _grow(figure: Sheet, more: float) -> None:
    """Add `more` [in] to the height of the figure above the axes; the size of the axes does not change."""
    before, place = figure.get_figheight(), figure.subplotpars
    after = before + more
    figure.set_figheight(after)
    figure.subplots_adjust(bottom=place.bottom * before / after, top=1.0 - ((1.0 - place.top) * before + more) / after)


def logarithmic_with_floor(ax: Axes, floor: float, told: str) -> None:
    """Make the vertical axis logarithmic, with the lower end `floor`; the text `told` explains smaller values."""
    # A shaded area with a text covers the curves below the floor. If no value is below the floor, there is no such
    # area.
    ax.set_yscale("log")
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=np.float64) for line in ax.get_lines()])
    seen = values[np.isfinite(values)]
    if not np.any(seen < floor):
        return
    high = 3.0 * max(float(seen.max()), 10.0 * floor)
    strip = floor * (floor / high) ** 0.09  # the shaded area is as high as a line of text
    ax.set_ylim(strip, high)
    ax.axhspan(strip, floor, facecolor=GAP_COLOR, linewidth=0.0, zorder=3.0)
    look: dict[str, Any] = {"fontsize": NAME_SIZE, "ha": "center", "va": "center", "zorder": 3.1}
    ax.text(0.5, (floor * strip) ** 0.5, told, transform=ax.get_yaxis_transform(), **look)


def shades(number: int) -> list[tuple[float, float, float, float]]:
    """Colors from dark to light, all visible on white."""
    colors = matplotlib.colormaps[SHADES]
    return [colors(0.85 * k / max(number - 1, 1)) for k in range(number)]


def thinning(number: int) -> slice:
    """Slice that selects at most about `MOST_POINTS` of `number` samples, with equal steps of the index."""
    return slice(None, None, max(1, number // MOST_POINTS))


def cables_over_time(
    time: Array, values: Array, label: str, width: float, name: str = "", stops: Iterable[float] = ()
) -> Sheet:
    """Draw one line per cable over `time` from `values` (N, m), and a vertical line at each of the `stops`."""
    figure, ax = axes("time without stops [s]" if stops else "time [s]", label, height=2.7)
    part = thinning(len(time))
    for i, course in enumerate(values[part].T):
        ax.plot(time[part], course, **cable_look(i), linewidth=width, label=name.format(i))
    for stop in stops:
        ax.axvline(stop, color="0.75", linewidth=0.6, linestyle="--")
    return figure


def error_panels(
    names: Sequence[str], position: Array, series: Sequence[tuple[str, Array, float, str]], caption: str
) -> list[Drawing]:
    """Draw errors as areas of circles at `position` (N, 3), in two views; `series`: label, errors, scale, color."""
    panels: list[Drawing] = []
    for column, name in ((0, "x"), (1, "y")):
        figure, ax = axes(f"${name}$ [m]", "$z$ [m]")
        place = position[:, [column, 2]]
        for label, errors, scale, color in series:
            ax.scatter(place[:, 0], place[:, 1], s=scale * errors, color=color, alpha=0.3, linewidths=0.0, label=label)
        for point, at in zip(names, place, strict=True):
            ax.annotate(point, at, fontsize=TICK, ha="center", va="center")
        ax.margins(0.16)
        panels.append((figure, caption.format(name)))
    return panels


def map_axes(x: str, y: str) -> tuple[Sheet, Axes]:
    """A figure with one pair of axes, and with space for a color bar."""
    figure, ax = axes(x, y)
    figure.subplots_adjust(left=MAP_LEFT, right=MAP_RIGHT)
    ax.grid(visible=False)
    return figure, ax


def draw_errors(
    ax: Axes, x: Array, y: Array, error: Array, edges: Array, ticks: tuple[float, ...], lines: tuple[float, ...]
) -> None:
    """Draw a map of errors with contour `lines`; each color represents the errors between two `edges`."""
    # The sign of errors is kept for the interpolation, because absolute values would make bands around zero too wide.
    # Errors smaller than the first edge are gray, as in the color bar.
    colors = matplotlib.colormaps["magma_r"](np.linspace(0.04, 0.92, len(edges)))
    filled = [*colors[::-1], matplotlib.colors.to_rgba(GAP_COLOR), *colors]
    ax.contourf(x, y, error, levels=[*-edges[::-1], *edges], colors=filled, extend="both").set_rasterized(True)
    drawn = [
        ax.contour(x, y, error, levels=sorted(sign * line for line in lines), **LOOK)
        for sign, seen in ((1.0, np.max(error) >= lines[0]), (-1.0, np.min(error) <= -lines[0]))
        if seen
    ]
    _number_lines(ax, max(drawn, key=lambda one: sum(np.shape(path.vertices)[0] for path in one.get_paths())))
    key = ListedColormap(colors[:-1], under=GAP_COLOR, over=colors[-1])
    scale = matplotlib.cm.ScalarMappable(BoundaryNorm(edges, len(edges) - 1), key)
    bar = ax.figure.colorbar(scale, ax=ax, pad=0.02, extend="both", spacing="uniform")
    bar.set_ticks(list(ticks), labels=[n(tick, ".3g", "m") for tick in ticks])
    bar.set_label(f"gray: below {n(edges[0], '.3g', 'm')}", fontsize=LABEL)
    bar.ax.tick_params(labelsize=TICK)
    bar.ax.minorticks_off()


def _number_lines(ax: Axes, drawn: ContourSet) -> None:
    """Write the value of each contour line near its middle, with a halo, and far enough from other numbers."""
    figure: Any = ax.get_figure(root=True)
    apart, places = APART * POINT * figure.dpi, list[Array]()  # [pixels]
    inside = ax.bbox.padded(-0.5 * apart)
    for path in drawn.get_paths():
        for place in _along_longest(ax, path):
            if inside.contains(*place) and all(np.hypot(*(place - other)) > apart for other in places):
                places.append(place)
                break
    names = ax.clabel(
        drawn,
        manual=ax.transData.inverted().transform(np.reshape(places, (-1, 2))).tolist(),
        fmt=lambda level: n(abs(level), ".3g", "m"),
        fontsize=TICK,
        inline_spacing=3,
    )
    for text in names:
        text.set_path_effects([*HALO])


def _along_longest(ax: Axes, path: Path) -> Array:
    """Points (n, 2) on the longest piece of a contour line [pixels]; points near the middle of the piece come first."""
    polygons = map(np.asarray, path.to_polygons(closed_only=False))
    pieces = [ax.transData.transform(piece) for piece in polygons if len(piece) > 1]
    passed = [np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(piece, axis=0).T)))) for piece in pieces]
    if not pieces:
        return np.empty((0, 2))
    way, piece = max(zip(passed, pieces, strict=True), key=lambda pair: float(pair[0][-1]))
    return np.column_stack([np.interp(SHARES * way[-1], way, along) for along in piece.T])

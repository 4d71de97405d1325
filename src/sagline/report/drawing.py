"""Small drawings that stay readable on a phone, and how they get into the page."""

from __future__ import annotations

import re
from io import StringIO
from itertools import count
from math import ceil
from typing import TYPE_CHECKING, NamedTuple, cast

import matplotlib
import numpy as np
from matplotlib.textpath import TextPath

from sagline.core.arrays import Array
from sagline.plot.sheet import BLUE, GAP_COLOR, TICK, Sheet, dressed
from sagline.report.blocks import Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, HEIGHT = 4.6, 3.1  # in: drawn at its own size on a desk, at four fifths of it on a phone
LEFT, RIGHT, BELOW, ABOVE = 0.16, 0.975, 0.5, 0.12  # margins around axes: shares of the width, then in
POINT = 1.0 / 72.0  # in
NAMES = TICK - 0.5  # pt, of legends
SHADES = "viridis"
MOST_POINTS = 400  # of a course over time: a page is not a data file

_referred = re.compile(r'(href="#|url\(#)([^")]+)')
_named = re.compile(r' id="([^"]+)"')
_remarks = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|\n\s*(?=\n)", flags=re.DOTALL)
_size = re.compile(r' (?:width|height)="[^"]*pt"')


class Drawings:
    """Turns figures into drawings of one page: every name inside them is used once in it."""

    def __init__(self, page: str) -> None:
        """Drawings whose names begin with that of their part of the page."""
        self._names = (f"{page}-{k}-" for k in count(1))

    def panel(self, figure: Sheet, caption: str) -> Panel:
        """The figure as a drawing inside the page; the caption is its text for those who do not see it."""
        buffer = StringIO()
        with matplotlib.rc_context({"svg.hashsalt": "sagline", "svg.fonttype": "path"}):
            figure.savefig(buffer, format="svg", dpi=200, metadata={"Date": None, "Creator": None}, transparent=True)
        text = buffer.getvalue()
        svg = _remarks.sub("", text[text.index("<svg") :]).strip()
        svg = _size.sub("", svg, count=2).replace("<svg ", '<svg role="img" ', 1)  # as large as its place in the page
        name, used = next(self._names), {found[1] for found in _referred.findall(svg)}
        svg = _named.sub(lambda found: f' id="{name}{found[1]}"' if found[1] in used else "", svg)
        return Panel(_referred.sub(lambda found: f"{found[1]}{name}{found[2]}", svg), caption)


def axes(x: str, y: str, height: float = HEIGHT) -> tuple[Sheet, Axes]:
    """A small figure with one pair of axes."""
    figure = Sheet(figsize=(WIDTH, height))  # fixed margins: half the time of a layout that measures every label
    figure.subplots_adjust(left=LEFT, right=RIGHT, bottom=BELOW / height, top=1.0 - ABOVE / height)
    ax = figure.add_subplot()
    dressed(ax, x, y)
    return figure, ax


def legend(ax: Axes, title: str = "") -> None:
    """A legend above the axes, off the curves, in as many columns as fit; the figure grows by its height."""
    figure = cast(Sheet, ax.get_figure(root=True))
    handles, labels = ax.get_legend_handles_labels()
    widest = max(TextPath((0.0, 0.0), label, size=NAMES).get_extents().width for label in labels)
    room = ax.get_position().width * figure.get_figwidth() / POINT
    columns = min(len(labels), max(1, int((room + 1.2 * NAMES) / (widest + 3.6 * NAMES))))
    rows = ceil(len(labels) / columns) + bool(title)
    grown = (1.45 * rows + 0.4) * NAMES * POINT
    _grow(figure, grown)
    ax.legend(
        handles,
        labels,
        title=title or None,
        alignment="left",
        fontsize=NAMES,
        title_fontsize=NAMES,
        frameon=False,
        ncols=columns,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
        borderpad=0.1,
        labelspacing=0.25,
        handlelength=1.8,
        handletextpad=0.5,
        columnspacing=1.2,
    )


def _grow(figure: Sheet, more: float) -> None:
    """Make room above the axes [in]; they keep their size."""
    before, place = figure.get_figheight(), figure.subplotpars
    after = before + more
    figure.set_figheight(after)
    figure.subplots_adjust(bottom=place.bottom * before / after, top=1.0 - ((1.0 - place.top) * before + more) / after)


def floored(ax: Axes, floor: float, told: str) -> None:
    """A logarithmic vertical axis that ends at a floor.

    Curves below it run under a shaded strip that says what is there; none is lifted onto the floor. Without any the
    axis is an ordinary one.

    Args:
        ax: Axes on which all curves are drawn.
        floor: In units of the axis, > 0.
        told: What the strip holds, such as "below 1 nm".
    """
    ax.set_yscale("log")
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=np.float64) for line in ax.get_lines()])
    seen = values[np.isfinite(values)]
    if not np.any(seen < floor):
        return
    high = 3.0 * max(float(seen.max()), 10.0 * floor)
    strip = floor * (floor / high) ** 0.09  # a share of the axis that holds a line of text
    ax.set_ylim(strip, high)
    ax.axhspan(strip, floor, facecolor=GAP_COLOR, linewidth=0.0, zorder=3.0)
    ax.text(
        0.5,
        (floor * strip) ** 0.5,
        told,
        transform=ax.get_yaxis_transform(),
        zorder=3.1,
        fontsize=NAMES,
        ha="center",
        va="center",
    )


def shades(number: int) -> list[tuple[float, float, float, float]]:
    """As many colors, in order, dark to light, each still seen on white."""
    colors = matplotlib.colormaps[SHADES]
    return [colors(0.85 * k / max(number - 1, 1)) for k in range(number)]


def thinned(number: int) -> slice:
    """Every so many samples."""
    return slice(None, None, max(1, number // MOST_POINTS))


def with_fit(ax: Axes, x: Array, y: Array, fine: Array, fit: Array) -> None:
    """Draw one course, sampled at x, with its fit."""
    ax.plot(x, y, "o", color=BLUE, markersize=3.5, label="exact")
    ax.plot(fine, fit, color="black", linewidth=0.9, label="fit")
    legend(ax)


class Courses(NamedTuple):
    """Several courses with their fits.

    Attributes:
        x: Where they are sampled, shape (n,).
        rows: The samples, shape (k, n).
        fine: Where the fits are drawn, shape (l,).
        fits: The fits, shape (k, l).
        names: What the courses are called in the legend.
    """

    x: Array
    rows: Array
    fine: Array
    fits: Array
    names: list[str]

    def draw(self, ax: Axes, title: str) -> None:
        """All of them, dark to light."""
        for row, fit, name, color in zip(self.rows, self.fits, self.names, shades(len(self.names)), strict=True):
            ax.plot(self.x, row, "o", color=color, markersize=2.6, label=name)
            ax.plot(self.fine, fit, color=color, linewidth=0.9)
        legend(ax, title)

    def panels(
        self, labels: tuple[str, str, str], one: int, captions: tuple[str, str], draw: Drawings
    ) -> tuple[Panel, Panel]:
        """One of them alone, and all; labels of both axes and of the legend."""
        figure, ax = axes(*labels[:2])
        with_fit(ax, self.x, self.rows[one], self.fine, self.fits[one])
        second, bx = axes(*labels[:2])
        self.draw(bx, labels[2])
        return draw.panel(figure, captions[0]), draw.panel(second, captions[1])

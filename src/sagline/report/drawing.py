"""Small drawings that stay readable on a phone, and how they get into the page."""

from __future__ import annotations

import re
from io import StringIO
from itertools import count
from typing import TYPE_CHECKING, Literal, NamedTuple

import matplotlib

from sagline.arrays import Array
from sagline.plot.sheet import BLUE, TICK, Sheet, dressed
from sagline.report.blocks import Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Place = Literal["best", "upper left", "upper right", "lower left", "lower right"]
WIDTH, HEIGHT = 4.6, 3.1  # in: drawn at its own size on a desk, at four fifths of it on a phone
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
            figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
        text = buffer.getvalue()
        svg = _remarks.sub("", text[text.index("<svg") :]).strip()
        svg = _size.sub("", svg, count=2).replace("<svg ", '<svg role="img" ', 1)  # as large as its place in the page
        name, used = next(self._names), {found[1] for found in _referred.findall(svg)}
        svg = _named.sub(lambda found: f' id="{name}{found[1]}"' if found[1] in used else "", svg)
        return Panel(_referred.sub(lambda found: f"{found[1]}{name}{found[2]}", svg), caption)


def axes(x: str, y: str, height: float = HEIGHT) -> tuple[Sheet, Axes]:
    """A small figure with one pair of axes."""
    figure = Sheet(figsize=(WIDTH, height))  # fixed margins: half the time of a layout that measures every label
    figure.subplots_adjust(left=0.16, right=0.975, bottom=0.5 / height, top=1.0 - 0.12 / height)
    ax = figure.add_subplot()
    dressed(ax, x, y)
    return figure, ax


def legend(ax: Axes, title: str = "", columns: int = 1, loc: Place = "best") -> None:
    """A legend inside the axes."""
    size = TICK - 0.5
    ax.legend(title=title or None, fontsize=size, title_fontsize=size, frameon=False, ncols=columns, loc=loc)


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

"""Maps of errors: filled between round errors, with numbers on lines, and what is too small shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib import patheffects
from matplotlib.colors import BoundaryNorm, ListedColormap

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import GAP_COLOR, LABEL, TICK, Sheet
from sagline.report.drawing import axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import ContourSet
    from matplotlib.path import Path

HALO = (patheffects.withStroke(linewidth=2.2, foreground="white"),)
LOOK: dict[str, Any] = {"colors": "black", "linestyles": "-", "linewidths": 0.8}
LEFT, RIGHT = 0.13, 0.9  # margins: room for a color bar


def map_axes(x: str, y: str) -> tuple[Sheet, Axes]:
    """Axes with room for a color bar."""
    figure, ax = axes(x, y)
    figure.subplots_adjust(left=LEFT, right=RIGHT)
    ax.grid(visible=False)
    return figure, ax


def draw_errors(
    ax: Axes, x: Array, y: Array, error: Array, edges: Array, ticks: tuple[float, ...], lines: tuple[float, ...]
) -> None:
    """Fill a map between round errors and draw some errors as lines, interpolated between the samples.

    An error with a sign is followed through zero: bands around it are as narrow as they are. What is below the first
    edge is gray, which the color bar says.

    Args:
        ax: Axes of `map_axes`; a color bar is put beside them.
        x: Where the columns are, shape (c,).
        y: Where the rows are, shape (r,).
        error: Errors, with or without a sign [m], shape (r, c).
        edges: The errors between which it is filled, rising; what is beyond the last has its own color [m], shape (k,).
        ticks: Edges that are named beside the color bar [m].
        lines: Errors that are drawn as lines with their numbers [m].
    """
    colors = matplotlib.colormaps["magma_r"](np.linspace(0.04, 0.92, len(edges)))
    filled = [*colors[::-1], matplotlib.colors.to_rgba(GAP_COLOR), *colors]
    ax.contourf(x, y, error, levels=[*-edges[::-1], *edges], colors=filled, extend="both").set_rasterized(True)
    drawn = [
        ax.contour(x, y, error, levels=sorted(sign * line for line in lines), **LOOK)
        for sign, seen in ((1.0, np.max(error) >= lines[0]), (-1.0, np.min(error) <= -lines[0]))
        if seen
    ]
    _number(ax, max(drawn, key=_points))
    key = ListedColormap(colors[:-1], under=GAP_COLOR, over=colors[-1])
    scale = matplotlib.cm.ScalarMappable(BoundaryNorm(edges, len(edges) - 1), key)
    bar = ax.figure.colorbar(scale, ax=ax, pad=0.02, extend="both", spacing="uniform")
    bar.set_ticks(list(ticks), labels=[n(tick, ".3g", "m") for tick in ticks])
    bar.set_label(f"gray: below {n(edges[0], '.3g', 'm')}", fontsize=LABEL - 1.0)
    bar.ax.tick_params(labelsize=TICK - 1.0)
    bar.ax.minorticks_off()


def _number(ax: Axes, drawn: ContourSet) -> None:
    """Numbers in the middle of the lines, with a halo so that they are read on the darkest ground."""
    middles = [middle for path in drawn.get_paths() if (middle := _middle(ax, path)) is not None]
    names = ax.clabel(
        drawn, manual=middles, fmt=lambda level: n(abs(level), ".3g", "m"), fontsize=TICK - 0.5, inline_spacing=3
    )
    for text in names:
        text.set_path_effects([*HALO])


def _middle(ax: Axes, path: Path) -> tuple[float, float] | None:
    """Where half of the longest piece of a line is passed on the sheet; None of a line that is not there."""
    polygons = map(np.asarray, path.to_polygons(closed_only=False))
    pieces = [ax.transData.transform(piece) for piece in polygons if len(piece) > 1]
    if not pieces:
        return None
    passed = [np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(piece, axis=0).T)))) for piece in pieces]
    k = int(np.argmax([way[-1] for way in passed]))
    place = pieces[k][int(np.searchsorted(passed[k], 0.5 * passed[k][-1]))]
    x, y = ax.transData.inverted().transform(place)
    return float(x), float(y)


def _points(drawn: ContourSet) -> int:
    return sum(np.shape(path.vertices)[0] for path in drawn.get_paths())

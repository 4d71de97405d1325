"""Labels in figures: axis labels with units, names at the ends of lines, legends, and headings that fit the width."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import ceil
from textwrap import fill
from typing import Any, Final, TypeGuard, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.lines import Line2D
from matplotlib.textpath import TextPath
from scipy.optimize import isotonic_regression

from sagline.core.arrays import Array
from sagline.plot.style import SANS, SERIF, current

TIME: Final = "time [s]"
PLACE: Final = ("$x$ [m]", "$y$ [m]", "$z$ [m]")
TENSIONS = {  # quantity -> label with unit, and factor from SI
    "chord_tension": (r"chord tension $\tau$ [N]", 1.0),
    "horizontal_tension": (r"horizontal tension $T_x$ [N]", 1.0),
    "vertical_force": (r"vertical force $T_z$ [N]", 1.0),
    "frame_end_tension": (r"tension at the frame end $T_A$ [N]", 1.0),
    "platform_end_tension": (r"tension at the platform end $T_B$ [N]", 1.0),
}
LENGTHS = {
    "unstrained_length": (r"unstrained length $L$ [m]", 1.0),
    "adjusting_length": (r"adjusting length $d = L - D$ [mm]", 1e3),
}
POINT = 1.0 / 72.0  # [in]
WIDE = {SANS: 0.58, SERIF: 0.48}  # mean width of a letter, in units of the text size
SHARE = 0.9  # largest width of a heading, as a share of the figure's width
MOST = 0.3  # largest width of names next to the axes, as a share of the figure's width
SPACING = 1.15  # distance between two names, in units of the text size
END = 0.02  # a line that ends farther from the right side (share of the axes' width) has no name there
LEADER = 8.0  # distance from the end of a line to its name [pt]
# arguments of a legend above its axes
ABOVE: dict[str, Any] = {
    "loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "alignment": "left", "frameon": False,
    "borderpad": 0.1, "handlelength": 1.8, "handletextpad": 0.5, "columnspacing": 1.2,
}  # fmt: skip


def name_lines(ax: Axes) -> None:
    """Name the lines of axes at their ends, or in a legend above the axes."""
    handles, labels = ax.get_legend_handles_labels()
    if ends := _ends(ax, handles):
        _write(ax, ends)
        labels = [label for handle, label in zip(handles, labels, strict=True) if not _is_line(handle)]
        handles = [handle for handle in handles if not _is_line(handle)]
    if handles:
        ax.legend(handles, labels, **legend_above(ax, labels))


def figure_legend(figure: FigureBase, panels: Iterable[Axes], place: Any = "outside upper center") -> None:
    """Draw one legend for all lines of several axes."""
    look = current()
    handles = {label: line for ax in panels for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    columns = legend_columns(list(handles), figure.get_figure(root=True).get_figwidth(), look.tick)
    figure.legend(handles.values(), list(handles), loc=place, ncols=columns, fontsize=look.tick, frameon=False)


def legend_above(ax: Axes, labels: Sequence[str]) -> dict[str, Any]:
    """Arguments for a legend above the axes `ax`, with as many columns as fit with one more entry."""
    size, width = current().tick, cast(Figure, ax.get_figure(root=True)).get_figwidth()
    return {**ABOVE, "ncols": legend_columns([*labels, ""], 0.85 * width, size), "fontsize": size, "borderaxespad": 0.1}


def legend_columns(labels: Sequence[str], width: float, size: float) -> int:
    """Number of legend columns, at least 1: as many as fit the width without empty columns."""
    widest = max((TextPath((0.0, 0.0), label, size=size).get_extents().width for label in labels if label), default=0.0)
    columns = max(1, min(len(labels), int((width / POINT + 1.2 * size) / (widest + 3.6 * size))))
    return ceil(len(labels) / ceil(len(labels) / columns))


def set_heading(target: FigureBase | Axes, text: str, size: float | None = None, **look: Any) -> None:
    """Add a heading without formulas to a figure or to axes, broken into lines to fit the width."""
    style, add = current(), target.suptitle if isinstance(target, FigureBase) else target.set_title
    size = style.label if size is None else size
    lines = fill(text, int(SHARE * style.width / POINT / (WIDE[style.font] * size)))
    add(lines, fontsize=size, parse_math=False, **look)  # names may contain dollar signs


def _is_line(handle: Artist) -> TypeGuard[Line2D]:
    """True for a line with more than two points, but not for a mark across the axes or a set of points."""
    if not isinstance(handle, Line2D) or handle.get_linestyle() in ("None", "", " "):
        return False
    return np.size(np.asarray(handle.get_xdata())) > 2


def _ends(ax: Axes, handles: Sequence[Artist]) -> list[tuple[Line2D, Array, float]]:
    """Lines, their ends in data units, and heights of the ends in the axes, 0 to 1. Empty if names have no space."""
    # Names have no space if an end is not at the right side, or if they are too many or too long.
    figure, look = cast(Figure, ax.get_figure(root=True)), current()
    lines = [handle for handle in handles if _is_line(handle)]
    longest = max((len(str(line.get_label())) for line in lines), default=0)
    if longest * WIDE[look.font] * look.tick * POINT > MOST * figure.get_figwidth():
        return []
    figure.draw_without_rendering()  # the layout determines the height of the axes
    found = []
    for line in lines:
        course = np.asarray(line.get_xydata(), dtype=np.float64)
        known = course[np.isfinite(course).all(axis=1)]
        if not len(known):
            return []
        across, height = ax.transAxes.inverted().transform(line.get_transform().transform(known[-1]))
        if across < 1.0 - END or not 0.0 <= height <= 1.0:
            return []
        found.append((line, known[-1], float(height)))
    return found if len(found) * _spacing(ax) <= 1.0 else []


def _spacing(ax: Axes) -> float:
    """Distance between names, as a share of the axes' height."""
    figure = cast(Figure, ax.get_figure(root=True))
    return SPACING * current().tick * figure.dpi * POINT / ax.bbox.height


def _write(ax: Axes, ends: Sequence[tuple[Line2D, Array, float]]) -> None:
    """Write names next to the ends of lines, without overlap. A common prefix is written above all names."""
    look, title, names = current(), "", [str(line.get_label()) for line, _, _ in ends]
    if len(names) > 1 and len({name.rpartition(" ")[0] for name in names}) == 1:
        title, names = names[0].rpartition(" ")[0], [name.rpartition(" ")[2] for name in names]
    heights = spread_heights(np.array([height for _, _, height in ends]), _spacing(ax))
    for (line, end, at), name, height in zip(ends, names, heights, strict=True):
        color, up = line.get_color(), (height - at) * ax.bbox.height * _points(ax)
        leader = {"arrowstyle": "-", "color": color, "linewidth": 0.5 * look.line, "relpos": (0.0, 0.5)}
        leader |= {"shrinkA": 1.0, "shrinkB": 1.0}
        write_beside(ax, name, end, (LEADER, up), ha="left", color=color, arrowprops=leader)
    if title:
        up = (heights.max() - 1.0 + _spacing(ax)) * ax.bbox.height * _points(ax)
        write_beside(ax, title, (1.0, 1.0), (LEADER, up), ha="left", xycoords="axes fraction")


def write_beside(ax: Axes, text: str, place: Any, offset: Any, **look: Any) -> None:
    """Write `text` at `offset` [pt] from `place`. The unit of `place` is that of the data, or as `xycoords` says."""
    defaults: dict[str, Any] = {"fontsize": current().tick, "ha": "center", "va": "center", "annotation_clip": False}
    (x, y), (right, up) = place, offset
    ax.annotate(text, (x, y), xytext=(right, up), textcoords="offset points", **(defaults | look))


def _points(ax: Axes) -> float:
    """Points per pixel."""
    return 1.0 / (cast(Figure, ax.get_figure(root=True)).dpi * POINT)


def spread_heights(heights: Array, spacing: float) -> Array:
    """Ordered `heights` of names, moved apart to at least `spacing`. The sum of the squared movements is least."""
    order = np.argsort(heights, kind="stable")
    steps = spacing * np.arange(heights.size)
    placed = np.asarray(isotonic_regression(heights[order] - steps).x)
    top = 1.0 - 0.5 * spacing - steps[-1]
    spaced = np.empty_like(heights)
    spaced[order] = np.clip(placed, min(0.5 * spacing, top), top) + steps
    return spaced

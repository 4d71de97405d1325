"""Figures without pyplot: size and style, axes, lines over time, and files with embedded fonts."""

from __future__ import annotations

import os
import re
from base64 import b64encode
from collections.abc import Iterable
from io import BytesIO
from itertools import pairwise
from typing import Any, Final, Literal, cast
from xml.etree import ElementTree

import matplotlib
import numpy as np
from fontTools import subset
from fontTools.ttLib import TTFont
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, fontManager
from matplotlib.ticker import MaxNLocator

from sagline.core.arguments import brief, file_path, optional
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.writing import atomic_file
from sagline.plot.labels import PLACE, TIME
from sagline.plot.style import PLAIN, SANS, SERIF, Using, current

# Okabe and Ito 2008, "Color universal design"; two colors that are too pale for lines on white are left out
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
COLORS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
GAP_COLOR = "#BBBBBB"
DASHED: Final[Any] = (0, (4.0, 1.6))  # a line style of Matplotlib
LINE_STYLES: Final[Any] = ("-", DASHED, (0, (1.0, 1.2)), (0, (5.0, 1.5, 1.0, 1.5)), (0, (7.0, 2.0)))
MAP_COLORS: Final = "cividis"  # a color map that is readable with all kinds of color vision
MOST_POINTS: Final = 4000  # largest number of points of a line; of a longer line, extrema of its parts are drawn
LABEL, TICK = PLAIN.label, PLAIN.tick  # text sizes in the documentation [pt]
RESOLUTION = 300  # dots per inch


_reference = re.compile(r'(href="#|url\(#)([^")]+)')
_name = re.compile(r' id="([^"]+)"')
SVG = "{http://www.w3.org/2000/svg}"
FAMILY = re.compile(r"font-family:\s*([^;]+)")
OWN = frozenset({SANS, SERIF})  # fonts that come with Matplotlib and may be embedded in documents by their licenses
_Face = tuple[str, str, str]  # family, style and weight


class Sheet(Figure):
    """A figure without pyplot that a notebook can show, and that keeps the style in which it was created."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        """Create a figure. The arguments are the same as for a figure of Matplotlib."""
        super().__init__(*arguments, **named)
        self.style = current()
        self._fitted = False

    def draw(self, renderer: Any) -> None:
        """Draw in the style of the figure. Objects that Matplotlib creates while drawing thus also have this style."""
        with Using(self.style):
            if not self._fitted:
                self._fitted = True  # the figure has not been drawn yet
                _thicken(self, self.style.line)
                self.draw_without_rendering()  # the layout determines the length of the axes
                _break_labels(self)
            super().draw(renderer)

    def savefig(self, *arguments: Any, **named: Any) -> None:
        """Write the figure in its own style."""
        with Using(self.style):
            super().savefig(*arguments, **named)

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png", dpi=150)
        return buffer.getvalue()


def sheet(height: float) -> Sheet:
    """An empty figure in the current style, with space for labels outside its axes."""
    return Sheet(figsize=current().size(height), layout="constrained")


def _break_labels(figure: Figure) -> None:
    """Break vertical axis labels into two lines if they are longer than their axes."""
    for ax in figure.axes:
        words = ax.yaxis.get_label_text().split(" ")
        length, height = ax.yaxis.label.get_window_extent().height, ax.bbox.height
        if length > height and len(words) > 2 and "\n" not in ax.yaxis.get_label_text():
            lines = [(" ".join(words[:k]), " ".join(words[k:])) for k in range(1, len(words))]
            whole = [pair for pair in lines if all(line.count("$") % 2 == 0 for line in pair)]  # no broken formulas
            if whole:
                ax.yaxis.label.set_text("\n".join(min(whole, key=lambda pair: max(map(len, pair)))))


def _thicken(figure: Figure, factor: float) -> None:
    """Multiply line widths and marker sizes by `factor`. Frames and ticks do not change."""
    owners: list[Any] = [*figure.axes, *figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    for line in (line for owner in owners for line in owner.get_lines()):
        line.set_linewidth(factor * line.get_linewidth())
        line.set_markersize(factor * line.get_markersize())
    for collection in (each for ax in figure.axes for each in ax.collections):
        collection.set_linewidth((factor * np.asarray(collection.get_linewidth())).tolist())
        if isinstance(collection, PathCollection):
            collection.set_sizes(factor**2 * collection.get_sizes())


def axes_or_new(ax: Axes | None, height: float = 3.0) -> Axes:
    """The Axes `ax`, or the Axes of a new figure if None. InvalidValueError for other objects and for 3D axes."""
    optional(ax, Axes, "ax")
    if ax is None:
        return sheet(height).add_subplot()
    if ax.name != "rectilinear":
        raise InvalidValueError("ax", f"Axes of the projection {ax.name}", "flat ones", "Make them with add_subplot().")
    return ax


def format_axes(ax: Axes, x: str, y: str) -> None:
    """Set labels, a light grid, and a frame that has only its left and lower line."""
    look = current()
    ax.set_xlabel(x, fontsize=look.label)
    ax.set_ylabel(y, fontsize=look.label)
    ax.tick_params(labelsize=look.tick, length=3.0 * look.line, width=0.6 * look.line)
    ax.grid(color="0.9", linewidth=0.6 * look.line)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_linewidth(0.6 * look.line)


def format_clock(ax: Axes, clock: Array, label: str, axis: str = TIME) -> None:
    """Set labels and limits of axes over time, or over pose numbers."""
    format_axes(ax, axis, label)
    if axis != TIME:
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    if clock.size > 1:
        ax.set_xlim(clock[0], clock[-1])


def hide_shared_labels(ax: Axes) -> None:
    """Hide repeated numbers and labels in a grid of axes: on the left if they share y, below if they share x."""
    place: Any = ax.get_subplotspec()
    if ax.get_shared_x_axes().get_siblings(ax) != [ax] and not place.is_last_row():
        ax.tick_params(axis="x", which="both", labelbottom=False)
        ax.set_xlabel("")
    if ax.get_shared_y_axes().get_siblings(ax) != [ax] and not place.is_first_col():
        ax.tick_params(axis="y", which="both", labelleft=False)
        ax.set_ylabel("")


def draw_map(ax: Axes, x: Array, y: Array, values: Array, scale: Normalize, title: str) -> None:
    """Draw values (nx, ny) at the points of a level grid as colors. Cells without a value are white and hatched."""
    ax.patch.set(facecolor="white", hatch="////", edgecolor="0.6")
    edges = _cell_edges(x), _cell_edges(y)
    ax.pcolormesh(*edges, np.ma.masked_invalid(values.T), norm=scale, cmap=MAP_COLORS, rasterized=True)
    ax.set_title(title, fontsize=current().tick)
    format_axes(ax, *PLACE[:2])
    ax.grid(visible=False)
    ax.set_aspect("equal")
    hide_shared_labels(ax)


def _cell_edges(middles: Array) -> Array:
    """Edges of the cells around points of a grid."""
    if middles.size == 1:
        return np.asarray(middles[0] + np.array([-0.5, 0.5]))
    between = 0.5 * (middles[1:] + middles[:-1])
    return np.concatenate(([2.0 * middles[0] - between[0]], between, [2.0 * middles[-1] - between[-1]]))


def color_bar(shown: ScalarMappable, axes: Any, label: str, **look: Any) -> Colorbar:
    """Draw a color bar next to axes, with its label."""
    figure = np.ravel(axes)[0].figure
    bar: Colorbar = figure.colorbar(shown, ax=axes, **look)
    bar.set_label(label, fontsize=current().label)
    bar.ax.tick_params(labelsize=current().tick)
    return bar


def cable_look(cable: int) -> dict[str, Any]:
    """Color and line style of a cable. Two neighbors have equal colors, because most robots have pairs of winches."""
    return {"color": COLORS[cable // 2 % len(COLORS)], "linestyle": "-" if cable % 2 == 0 else DASHED}


def draw_series(ax: Axes, clock: Array, course: Array, **look: Any) -> None:
    """Draw a line over time. A sample without neighbors is drawn as a point."""
    if clock.size > MOST_POINTS:
        few = 2 * -(-clock.size // MOST_POINTS)
        rows = np.arange(clock.size // few * few).reshape(-1, few)
        values = course[rows]
        low = np.where(np.isnan(values), np.inf, values).argmin(axis=1)
        high = np.where(np.isnan(values), -np.inf, values).argmax(axis=1)
        ends = np.sort(np.take_along_axis(rows, np.stack((low, high), axis=1), axis=1), axis=1).ravel()
        kept = np.append(ends, np.arange(rows.size, clock.size))
        clock, course = clock[kept], course[kept]
    known = np.concatenate(([False], np.isfinite(course), [False]))
    alone = np.flatnonzero(known[1:-1] & ~known[:-2] & ~known[2:])
    points: dict[str, Any] = {"marker": "o", "markersize": 3.5, "markevery": alone.tolist()} if alone.size else {}
    ax.plot(clock, course, **look, **points)


def draw_cables(ax: Axes, clock: Array, values: Array, linewidth: float = 1.1) -> None:
    """Draw one line over time for each cable. `values`: (N, m)."""
    for i, course in enumerate(values.T):
        draw_series(ax, clock, course, **cable_look(i), linewidth=linewidth, label=f"cable {i}")


def draw_components(ax: Axes, clock: Array, courses: Array, name: str = "{}") -> None:
    """Draw the components (N, 3) along x, y and z over time. `name` formats the symbol of each component."""
    for axis, course, color, style in zip("xyz", courses.T, COLORS, LINE_STYLES, strict=False):
        draw_series(ax, clock, course, color=color, linestyle=style, linewidth=1.2, label=f"${name.format(axis)}$")


def shade_spans(
    ax: Axes, clock: Array, spans: Iterable[Any], label: str, color: str = GAP_COLOR, alpha: float = 0.5
) -> None:
    """Shade `spans` of samples (first, end). Each span is extended halfway to the neighboring samples."""
    if clock.size > 1:
        middles = [0.5 * (before + after) for before, after in pairwise(clock)]
        edges = np.array([clock[0], *middles, clock[-1]])
    else:
        edges = clock[0] + np.array([-0.5, 0.5])
    for k, (first, end) in enumerate(spans):
        name = label if k == 0 else "_"
        ax.axvspan(edges[first], edges[end], color=color, alpha=alpha, linewidth=0.0, label=name, zorder=0.5)


def svg_text(figure: Figure, dots: int, **settings: str) -> str:
    """The figure as an SVG element for a page. Without date and creator, so that each call gives the same text."""
    written = BytesIO()
    with matplotlib.rc_context(cast(Any, settings)):
        figure.savefig(written, format="svg", dpi=dots, metadata={"Date": None, "Creator": None}, transparent=True)
    text = written.getvalue().decode("utf-8")
    return text[text.index("<svg") :]


def unique_names(svg: str, prefix: str) -> str:
    """`svg` whose identifiers begin with `prefix`, for pages with several drawings. Unused identifiers are removed."""
    used = {found[1] for found in _reference.findall(svg)}
    svg = _name.sub(lambda found: f' id="{prefix}{found[1]}"' if found[1] in used else "", svg)
    return _reference.sub(lambda found: f"{found[1]}{prefix}{found[2]}", svg)


def save(drawing: Figure | Axes, file: os.PathLike[str] | str) -> None:
    """Write a figure to a file atomically; the suffix (.png, .svg, .pdf) selects the format.

    Args:
        drawing: A figure, or Axes of a figure, which is saved as a whole.
        file: The file; an existing file is replaced.

    Raises:
        InvalidValueError: If `drawing` is not a figure or Axes.
        FileError: If the file cannot be written. If matplotlib does not support the suffix of the file.

    Examples:
        >>> import sagline as sl
        >>> sl.plot.save(sl.plot.path(sl.article_path()), "path.svg")
    """
    if not isinstance(drawing, Figure | Axes):
        raise InvalidValueError("drawing", brief(drawing), "a figure of matplotlib, or its Axes", "Draw one first.")
    figure = drawing if isinstance(drawing, Figure) else cast(Figure, drawing.get_figure(root=True))
    path = file_path(file)
    kind = path.suffix.lstrip(".").lower()
    known = sorted(figure.canvas.get_supported_filetypes().keys() - {"pgf"})  # .pgf would need LaTeX
    if kind not in known:
        raise FileError(path, f"the suffix is {path.suffix or 'missing'}", f"Choose one of {', '.join(known)}.")
    # without date and random names, equal figures give equal bytes
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    drawn = BytesIO()  # matplotlib would leave a file open after a write error
    with matplotlib.rc_context({"svg.hashsalt": "sagline"}):
        figure.savefig(drawn, format=kind, dpi=RESOLUTION, metadata=metadata)
    content = drawn.getvalue()
    if kind == "svg" and isinstance(figure, Sheet) and figure.style.name:
        content = _with_fonts(content.decode("utf-8")).encode("utf-8")
    with atomic_file(path) as partial:
        partial.write_bytes(content)


def _with_fonts(svg: str) -> str:
    """Embed the fonts of a drawing. Each font contains only the letters that the drawing uses."""
    faces = [_face(face, "".join(sorted(used))) for face, used in sorted(_letters(svg).items()) if used]
    if not faces:
        return svg
    head, opening, rest = re.split(r"(<svg\b[^>]*>)", svg, maxsplit=1)
    return f'{head}{opening}\n <style type="text/css">\n{"".join(faces)} </style>{rest}'


def _letters(svg: str) -> dict[_Face, set[str]]:
    """The letters that the drawing uses, by font."""
    found: dict[_Face, set[str]] = {}

    def visit(element: ElementTree.Element, style: str) -> None:
        style = f"{style};{element.get('style', '')}"
        if element.tag in (f"{SVG}text", f"{SVG}tspan") and element.text and (families := FAMILY.findall(style)):
            names = [name.strip().strip("'\"") for name in families[-1].split(",")]
            for name in OWN.intersection(names):
                face = (name, _last(style, "font-style", "normal"), _last(style, "font-weight", "400"))
                found.setdefault(face, set()).update(element.text)
        for child in element:
            visit(child, style)

    visit(ElementTree.fromstring(svg), "")
    return found


def _last(style: str, name: str, default: str) -> str:
    values = re.findall(rf"(?:^|;)\s*{name}:\s*([^;]+)", style)
    return values[-1].strip() if values else default


def _face(face: _Face, letters: str) -> str:
    """Style sheet rule that contains `letters` of a font."""
    family, style, weight = face
    properties = FontProperties(family=[family], weight=int(weight) if weight.isdigit() else weight)
    properties.set_style(cast(Literal["normal", "italic", "oblique"], style))
    options = subset.Options(notdef_outline=True)
    options.drop_tables += ["FFTM"]  # the font's table of time stamps cannot be reduced
    with TTFont(fontManager.findfont(properties), recalcTimestamp=False) as font:
        subsetter = subset.Subsetter(options)
        subsetter.populate(text=letters)
        subsetter.subset(font)
        font.flavor = "woff"
        written = BytesIO()
        font.save(written)
    source = f"url(data:font/woff;base64,{b64encode(written.getvalue()).decode()})"
    return (
        f"  @font-face{{font-family:'{family}';font-style:{style};font-weight:{weight};src:{source} format('woff')}}\n"
    )

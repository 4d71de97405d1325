"""Defects of figures for a reader: axes without numbers or unit, small, cut or overlapping text, equal looks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox

UNIT = re.compile(r"\[[^\]]+\]")
NUMBER = re.compile(r"[-−\d.,]+(e[-−]?\d+)?|\$\\mathdefault.*")
WITHOUT_UNIT = re.compile(r"pose|candidate|row of the log|factor\b.*|correlation|workspace share\b.*")
TOUCHING = 1.0  # pixels of permitted overlap of two texts
SHOWN, SMALLEST = 8.0 / 2.54, 6.0  # width of a figure on a phone or in a column [in], and its smallest text [pt]


def defects(figure: Figure, shown: float = SHOWN) -> list[str]:
    """Defects of a figure at a width of `shown` [in], or at its own width if that is smaller, one sentence each."""
    texts = drawn_texts(figure)
    return [
        *bare_axes(figure),
        *cut_texts(figure, texts),
        *overlaps(texts),
        *equal_looks(figure),
        *small_texts(figure, shown),
    ]


def drawn_texts(figure: Figure) -> list[tuple[str, Bbox]]:
    """All texts of a drawing with their boxes in pixels."""
    canvas, drawn, draw = FigureCanvasAgg(figure), dict[int, tuple[str, Bbox]](), Text.draw

    def note(text: Text, renderer: Any) -> None:
        draw(text, renderer)
        if text.get_visible() and text.get_text().strip():
            drawn[id(text)] = text.get_text(), Text.get_window_extent(text, renderer)

    Text.draw = note  # type: ignore[method-assign, assignment]
    try:
        canvas.draw()  # type: ignore[no-untyped-call]
    finally:
        Text.draw = draw  # type: ignore[method-assign]
    return list(drawn.values())


def bare_axes(figure: Figure) -> Iterator[str]:
    """Axes without numbers and unit of their own or of axes that share them; words need no unit."""
    common = {"x": figure.get_supxlabel(), "y": figure.get_supylabel()}
    flat = [ax for ax in figure.axes if ax.get_visible() and ax.axison and ax.name == "rectilinear"]
    for number, ax in enumerate(flat):
        for axis in "xy":
            group = getattr(ax, f"get_shared_{axis}_axes")().get_siblings(ax)
            ticks = [text for other in group for text in tick_texts(other, axis)]
            labels = [text for text in (*(label_of(other, axis) for other in group), common[axis]) if text]
            if not ticks and (ax.get_label() == "<colorbar>" or ax.images or not ax.spines["left"].get_visible()):
                continue  # the narrow side of a color bar; rows of a matrix have names; a band has no scale
            if not ticks or not (labels or any(map(without_number, ticks))):
                yield f"axes {number}: {axis} has no {'label' if ticks else 'numbers'}"
            elif all(NUMBER.fullmatch(text) for text in ticks) and not any(map(has_unit, labels)):
                yield f"axes {number}: {axis} has no unit in {labels}"


def tick_texts(ax: Axes, axis: str) -> list[str]:
    """Visible texts at the ticks."""
    return [t.get_text() for t in getattr(ax, f"get_{axis}ticklabels")() if t.get_visible() and t.get_text()]


def label_of(ax: Axes, axis: str) -> str:
    """Label of an axis, "" for none."""
    return str(getattr(ax, f"get_{axis}label")())


def without_number(text: str) -> bool:
    """True for words and for numbers with a unit."""
    return NUMBER.fullmatch(text) is None


def has_unit(label: str) -> bool:
    """True for a label with a unit, or of a quantity that has none."""
    return bool(UNIT.search(label) or WITHOUT_UNIT.fullmatch(label))


def cut_texts(figure: Figure, texts: list[tuple[str, Bbox]]) -> Iterator[str]:
    """Texts beyond the edge of the figure."""
    sheet = figure.bbox.padded(TOUCHING)
    for text, box in texts:
        if not (sheet.contains(box.x0, box.y0) and sheet.contains(box.x1, box.y1)):
            yield f"{text!r} is cut"


def small_texts(figure: Figure, shown: float) -> Iterator[str]:
    """Texts that are too small at the shown width."""
    scale = min(1.0, shown / figure.get_figwidth())
    texts: list[Any] = figure.findobj(Text)
    for text in texts:
        size = scale * float(text.get_fontsize())
        if text.get_visible() and text.get_text().strip() and size < SMALLEST:
            yield f"{text.get_text()!r} has {size:.1f} pt"


def overlaps(texts: list[tuple[str, Bbox]]) -> Iterator[str]:
    """Overlapping texts."""
    for (one, a), (other, b) in combinations(texts, 2):
        if min(a.x1, b.x1) - max(a.x0, b.x0) > TOUCHING and min(a.y1, b.y1) - max(a.y0, b.y0) > TOUCHING:
            yield f"{one!r} is over {other!r}"


def equal_looks(figure: Figure) -> Iterator[str]:
    """Entries of a legend with equal looks."""
    for legend in figure.findobj(Legend):
        looks: dict[str, str] = {}
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
            name, look = text.get_text(), look_of(handle)
            if look in looks:
                yield f"{name!r} looks like {looks[look]!r}"
            looks[look] = name


def look_of(handle: Any) -> str:
    """Colors, line style, marker and filling of an entry."""
    names = ("color", "facecolor", "linestyle", "dashes", "marker", "markerfacecolor", "hatch", "alpha")
    found = [repr(getattr(handle, f"get_{name}")()) for name in names if hasattr(handle, f"get_{name}")]
    pattern = getattr(handle, "_unscaled_dash_pattern", None)  # Matplotlib has no method for it
    return " ".join([*found, repr(pattern)])

"""Styles of figures for journals and slides: width, fonts, line widths, and names at the ends of lines."""

from __future__ import annotations

from contextlib import ContextDecorator, ExitStack
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Any, Final, cast

import matplotlib

from sagline.core.arguments import choice, whole_number

SANS, SERIF = "DejaVu Sans", "STIXGeneral"  # fonts of Matplotlib, on any computer; the second resembles Times
SLIDE_HEIGHT, PAGE_HEIGHT = 6.0, 9.0  # largest heights of a figure [in]


@dataclass(frozen=True, slots=True)
class Style:
    """A style of figures, activated by `style`."""

    name: str  # "" for the style of the documentation
    width: float  # width of every figure [in]
    height: float  # factor by which heights of figures are multiplied; 1 in the documentation
    tallest: float  # largest height of a figure [in]
    font: str  # font family of all text
    mathematics: str  # Matplotlib's name for the font of formulas
    label: float  # font size of axis labels, titles and labels of bars [pt]
    tick: float  # font size of numbers and of the names of lines [pt]
    line: float  # factor by which line widths and marker sizes are multiplied; 1 in the documentation

    def size(self, height: float) -> tuple[float, float]:
        """Width and height [in] of a figure in this style, from the requested height."""
        return self.width, min(self.height * height, self.tallest)

    @property
    def narrow(self) -> bool:
        """True if two panels do not fit side by side."""
        return self.width < 40.0 * self.tick / 72.0

    @property
    def settings(self) -> dict[str, Any]:
        """Settings for Matplotlib. Text is stored as text in files, and fonts are embedded."""
        if not self.name:
            return {}
        sizes = dict.fromkeys(("axes.labelsize", "axes.titlesize", "figure.titlesize"), self.label)
        sizes |= dict.fromkeys(("font.size", "xtick.labelsize", "ytick.labelsize", "legend.fontsize"), self.tick)
        return {
            **sizes,
            "font.family": [self.font, SANS],
            "mathtext.fontset": self.mathematics,
            "figure.figsize": self.size(3.0),
            "lines.linewidth": 1.1 * self.line,
            "axes.linewidth": 0.6 * self.line,
            "pdf.fonttype": 42,  # embed TrueType fonts, because journals reject Type 3 fonts
            "ps.fonttype": 42,
            "svg.fonttype": "none",
        }


# text has at least 6 pt even if the figure is only 8 cm wide, on a phone or in a column
PLAIN: Final = Style("", 4.7, 0.85, PAGE_HEIGHT, SANS, "dejavusans", 10.0, 9.0, 1.0)
_IEEE = Style("ieee", 3.5, 0.75, PAGE_HEIGHT, SERIF, "stix", 9.0, 8.0, 1.0)
_MDPI = Style("mdpi", 5.45, 0.85, PAGE_HEIGHT, SERIF, "stix", 10.0, 9.0, 1.0)
_SLIDES = Style("slides", 6.0, 1.5, SLIDE_HEIGHT, SANS, "dejavusans", 16.0, 14.0, 1.8)
STYLES: Final = {  # for each name, the styles for one column and for two columns
    # IEEE Author Center, "Size requirements for graphics": 3.5 in and 7.16 in
    "ieee": (_IEEE, replace(_IEEE, width=7.16, height=0.9)),
    # mdpi.cls: the text is 394.36 pt wide, or 525.5 pt with the margin next to it; an inch has 72.27 pt
    "mdpi": (_MDPI, replace(_MDPI, width=7.27, height=0.95)),
    # half a slide or a whole slide of 13.33 in by 7.5 in, with space for a heading
    "slides": (_SLIDES, replace(_SLIDES, width=12.4, height=1.9, label=18.0, tick=16.0, line=2.0)),
}
_current: ContextVar[Style] = ContextVar("style", default=PLAIN)


def current() -> Style:
    """Current style. New figures have this style."""
    return _current.get()


def style(name: str, columns: int = 1) -> Using:
    """Style of figures for a journal or a slide. Figures created inside its `with` statement keep this style.

    Figures have the width of the column, fonts of Matplotlib (available on any computer), and text sizes for print at
    this width. Names are at the ends of lines if there is space. Inside the block, figures that are created directly
    with Matplotlib have the same fonts and sizes. In PDF and SVG, text is stored as text, with embedded fonts.

    Args:
        name: "ieee" for widths of 3.5 in or 7.16 in, "mdpi" for 5.45 in or 7.27 in, "slides" for half a slide or a
            whole slide of 13.33 in by 7.5 in.
        columns: Width of the figure: 1 for one column, 2 for the whole width.

    Returns:
        Context manager for a `with` statement, which can also be used as a decorator. Its value is the `Style`.

    Raises:
        InvalidValueError: If the style does not exist. If `columns` is not 1 or 2.

    Examples:
        >>> import sagline as sl
        >>> with sl.plot.style("ieee"):
        ...     ax = sl.plot.velocity(sl.article_path())
        >>> float(ax.figure.get_figwidth())
        3.5
    """
    return Using(STYLES[choice(name, "name", STYLES)][whole_number(columns, "columns", 1, 2) - 1])


class Using(ContextDecorator):
    """Context manager of a style, which can be used repeatedly and nested."""

    def __init__(self, chosen: Style) -> None:
        """Store the style, which the `with` statement activates."""
        self.style = chosen
        self._open: list[ExitStack] = []

    def __enter__(self) -> Style:
        """Activate the style."""
        stack = ExitStack()
        stack.callback(_current.reset, _current.set(self.style))
        stack.enter_context(matplotlib.rc_context(cast(Any, self.style.settings)))
        self._open.append(stack)
        return self.style

    def __exit__(self, *_: object) -> None:
        """Restore the previous style."""
        self._open.pop().close()

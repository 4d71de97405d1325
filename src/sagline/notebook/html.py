"""A piece of a notebook's page: the verdict and a figure, in the notebook's own colors, light or dark."""

from __future__ import annotations

import re
from base64 import b64encode
from contextlib import suppress
from hashlib import sha1
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING, Final

from sagline.notebook.verdicts import told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST: Final = 200_000  # bytes of a figure
MOST_MARKS: Final = 1500  # points, that are drawn as such; more are one picture within the figure
DOTS: Final = 110  # dots an inch of that
GOOD, BAD, NEITHER = "#009E73", "#D55E00", "#888888"
FONT: Final = "'DejaVu Sans', Verdana, sans-serif"
_remarks = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|<defs>\s*<style.*?</style>\s*</defs>", flags=re.DOTALL)
_gray = re.compile(r"\b(fill|stroke): #([0-9a-f]{2})\2\2(?![0-9a-f])")
_family = re.compile(r"font-family: 'DejaVu Sans'(?:, 'DejaVu Sans')?;? ?")
_named = re.compile(r' id="([^"]+)"')
_referred = re.compile(r'(href="#|url\(#)([^")]+)')


def html_of(thing: object) -> str | None:
    """What a notebook shows of something.

    Args:
        thing: A robot, a path, a plan or a result.

    Returns:
        HTML that needs nothing else; None where the ordinary text says as much.
    """
    found = told(thing)
    if found is None:
        return None
    color = NEITHER if found.good is None else GOOD if found.good else BAD
    lines = "\n".join(found.lines)
    rest = f'<pre style="margin:.3em 0;white-space:pre-wrap;background:none">{escape(lines)}</pre>' if lines else ""
    return (
        f'<div class="sagline" style="max-width:46em"><div style="border-left:4px solid {color};padding-left:.6em">'
        f"<strong>{escape(found.name)}</strong>: {escape(found.verdict)}{rest}</div>"
        f"{_drawn(thing, f'{found.name}: {found.verdict}')}</div>"
    )


def _drawn(thing: object, description: str) -> str:
    """The figure; nothing where there is none, or it cannot be drawn."""
    with suppress(Exception):  # the verdict is there without it; Matplotlib may be missing
        from sagline.notebook.figures import STYLE, figure_of
        from sagline.plot.style import Using

        with Using(STYLE):
            figure = figure_of(thing)
            if figure is not None:
                return _inside(figure, description)
    return ""


def _inside(figure: Figure, description: str) -> str:
    """The figure as a drawing, or as a picture if that is smaller; nothing if both are too large."""
    lines = [line for ax in figure.findobj(lambda each: hasattr(each, "get_lines")) for line in ax.get_lines()]  # type: ignore[attr-defined]
    if sum(len(line.get_xdata()) for line in lines if line.get_marker() not in ("None", None)) > MOST_MARKS:
        for line in lines:
            line.set_rasterized(True)
    written = BytesIO()
    figure.savefig(written, format="svg", dpi=DOTS, metadata={"Date": None, "Creator": None}, transparent=True)
    text = written.getvalue().decode("utf-8")
    drawing = themed(text[text.index("<svg") :], description)
    if len(drawing.encode()) <= LARGEST:
        return drawing
    written = BytesIO()
    figure.savefig(written, format="png", dpi=DOTS, facecolor="white")
    picture = b64encode(written.getvalue()).decode()
    if len(picture) > LARGEST:
        return ""
    return f'<img style="max-width:100%" alt="{escape(description)}" src="data:image/png;base64,{picture}">'


def _ink(gray: re.Match[str]) -> str:
    return f"{gray[1]}: currentColor; {gray[1]}-opacity: {1.0 - int(gray[2], 16) / 255.0:.2f}"


def themed(svg: str, description: str) -> str:
    """A drawing in the colors of the page: what is black has the color of its text, what is gray has less of it.

    Names inside are made its own, so that many drawings stand on one page.

    Args:
        svg: As Matplotlib writes it.
        description: What it shows, for those who do not see it.

    Returns:
        The drawing, to be put into a page.
    """
    svg = _family.sub("", _remarks.sub("", svg)).strip()
    svg = _gray.sub(_ink, svg)
    own, used = f"s{sha1(svg.encode()).hexdigest()[:8]}-", {found[1] for found in _referred.findall(svg)}
    svg = _named.sub(lambda found: f' id="{own}{found[1]}"' if found[1] in used else "", svg)
    svg = _referred.sub(lambda found: f"{found[1]}{own}{found[2]}", svg)
    look = f"max-width:100%;height:auto;color:inherit;fill:currentColor;stroke-linejoin:round;font-family:{FONT}"
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(description)}" style="{look}" ', 1)

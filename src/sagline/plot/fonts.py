"""The fonts of a drawing, inside it: its text is text, and looks the same on a machine that has none of them."""

from __future__ import annotations

import re
from base64 import b64encode
from io import BytesIO
from typing import Literal, cast
from xml.etree import ElementTree

from fontTools import subset
from fontTools.ttLib import TTFont
from matplotlib.font_manager import FontProperties, fontManager

from sagline.plot.style import SANS, SERIF

SVG = "{http://www.w3.org/2000/svg}"
FAMILY = re.compile(r"font-family:\s*([^;]+)")
OWN = frozenset({SANS, SERIF})  # come with Matplotlib, under licenses that let them be passed on inside documents
_Face = tuple[str, str, str]  # family, style and weight


def with_fonts(svg: str) -> str:
    """Put the fonts of the text of a drawing into it, each with the letters that are used.

    Args:
        svg: The drawing, with its text as text.

    Returns:
        The same with a style sheet that holds the fonts; those that do not come with Matplotlib are left out.
    """
    letters = _letters(svg)
    faces = [_face(face, "".join(sorted(used))) for face, used in sorted(letters.items()) if used]
    if not faces:
        return svg
    head, opening, rest = re.split(r"(<svg\b[^>]*>)", svg, maxsplit=1)
    return f'{head}{opening}\n <style type="text/css">\n{"".join(faces)} </style>{rest}'


def _letters(svg: str) -> dict[_Face, set[str]]:
    """The letters of each font of ours that text is written in."""
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
    """A rule of a style sheet that holds the letters of a font."""
    family, style, weight = face
    properties = FontProperties(family=[family], weight=int(weight) if weight.isdigit() else weight)
    properties.set_style(cast(Literal["normal", "italic", "oblique"], style))
    options = subset.Options(notdef_outline=True)
    options.drop_tables += ["FFTM"]  # when it was made; it is not known how to take a part of that
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

"""Formulas: LaTeX between dollars becomes MathML, which a browser sets by itself, without a script or a network."""

from __future__ import annotations

import re
from html import unescape
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
UNKNOWN = re.compile(r"\\[A-Za-z]+|&(?!#?\w+;)")
SPACE = '<mspace width="0.17em" />'
MENDED = {  # what latex2mathml writes and how browsers set it as TeX would
    re.compile(r"<mo>(\w{2,})</mo>"): r"<mi>\1</mi>",  # names of functions stand upright, without the space of a sign,
    re.compile(r"((?:<msup>)?<mi>[a-z]{2,}</mi>(?:<mn>\d</mn></msup>)?)(?=<m(?:i|n|row|sub|sup|frac|sqrt)\b)"): (
        rf"\1{SPACE}"  # and apart from what follows
    ),
    re.compile(
        r"(</m(?:i|n|sub|sup|subsup|row)>)(?=(?:<msup>)?<mi>[a-z]{2,}</mi>)"
    ): rf"\1{SPACE}",  # or is before them
    re.compile(r"<mo>(&#x0007C;|&#x0002F;)</mo>"): r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>',  # |x|, a/b
    re.compile(r"(<mo[^>]*>[^<]*</mo>)<mo>(&#x0002B;|&#x02212;)</mo>"): r'\1<mo form="prefix">\2</mo>',  # = +1
}


def on_page_content(html: str, **_: Any) -> str:
    """Replace the formulas of a page."""
    return FORMULA.sub(lambda found: mathml(unescape(found[2]), block=found[1] == "div"), html)


def mathml(latex: str, *, block: bool) -> str:
    """One formula; LaTeX that is not understood stops the build."""
    text = convert(latex.strip(), display="block" if block else "inline")
    if unknown := UNKNOWN.search(text):
        raise PluginError(f"{unknown[0]} is not understood in the formula {latex}")
    for written, mended in MENDED.items():
        text = written.sub(mended, text)
    return f'<div class="formula">{text}</div>' if block else text

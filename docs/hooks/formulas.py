"""Formulas: LaTeX between dollars becomes MathML, which browsers draw without a script or a network."""

from __future__ import annotations

import re
from html import unescape
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

BLOCK = re.compile(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', re.DOTALL)
INLINE = re.compile(r'(\(?)<span class="arithmatex">\\\((.*?)\\\)</span>([.,;:)]*)', re.DOTALL)
UNKNOWN = re.compile(r"\\[A-Za-z]+|&(?!#?\w+;)")
SPACE = '<mspace width="0.17em" />'
MENDED = (  # output of latex2mathml -> form that browsers draw like TeX
    # a function name is upright, without the space of an operator, but with space around it
    (r"<mo>(\w{2,})</mo>", r"<mi>\1</mi>"),
    (r"((?:<msup>)?<mi>[a-z]{2,}</mi>(?:<mn>\d</mn></msup>)?)(?=<m(?:i|n|row|sub|sup|frac|sqrt)\b)", rf"\1{SPACE}"),
    (r"(</m(?:i|n|sub|sup|subsup|row)>)(?=(?:<msup>)?<mi>[a-z]{2,}</mi>)", rf"\1{SPACE}"),
    # |x| and a/b without spaces
    (r"<mo>(&#x0007C;|&#x0002F;)</mo>", r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>'),
    # = +1, (-1, [-1 and , -1 with a sign rather than an operation
    (r"(<mo[^>]*>&#x000(?:3D|28|2C|5B);</mo>)<mo>(&#x0002B;|&#x02212;)</mo>", r'\1<mo form="prefix">\2</mo>'),
)


def on_page_content(html: str, **_: Any) -> str:
    """Replace the formulas of a page."""
    html = BLOCK.sub(lambda found: f'<div class="formula">{mathml(unescape(found[1]), "block")}</div>', html)
    return INLINE.sub(lambda found: kept(found[1], mathml(unescape(found[2]), "inline"), found[3]), html)


def kept(before: str, formula: str, after: str) -> str:
    """A formula with its adjacent punctuation, kept on one line."""
    return f'<span class="kept">{before}{formula}{after}</span>' if before or after else formula


def mathml(latex: str, display: str) -> str:
    """One formula; unknown LaTeX stops the build."""
    text = convert(latex.strip(), display=display)
    if unknown := UNKNOWN.search(text):
        raise PluginError(f"{unknown[0]} is unknown LaTeX in the formula {latex}")
    for written, mended in MENDED:
        text = re.sub(written, mended, text)
    return text

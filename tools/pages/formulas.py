"""Formulas: LaTeX between dollars becomes MathML, which browsers draw without a script or a network."""

from __future__ import annotations

import re
from typing import Final

CODE: Final = re.compile(r"^( *)```.*?^\1```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
FORMULA: Final = re.compile(  # a block, or one in a line with its adjacent punctuation
    r"^ *\$\$\n(?P<block>.*?)\n *\$\$$|(?P<before>\(?)\$(?P<line>[^$\s](?:[^$\n]*[^$\s])?)\$(?P<after>[.,;:)]*)",
    re.MULTILINE | re.DOTALL,
)
EITHER: Final = re.compile(f"{CODE.pattern}|{FORMULA.pattern}", re.MULTILINE | re.DOTALL)
UNKNOWN: Final = re.compile(r"\\[A-Za-z]+|&(?!#?\w+;)")
SPACE: Final = '<mspace width="0.17em" />'
MENDED: Final = (  # output of latex2mathml -> form that browsers draw like TeX
    # a function name is upright, without the space of an operator, but with space around it
    (r"<mo>(\w{2,})</mo>", r"<mi>\1</mi>"),
    (r"((?:<msup>)?<mi>[a-z]{2,}</mi>(?:<mn>\d</mn></msup>)?)(?=<m(?:i|n|row|sub|sup|frac|sqrt)\b)", rf"\1{SPACE}"),
    (r"(</m(?:i|n|sub|sup|subsup|row)>)(?=(?:<msup>)?<mi>[a-z]{2,}</mi>)", rf"\1{SPACE}"),
    # |x| and a/b without spaces
    (r"<mo>(&#x0007C;|&#x0002F;)</mo>", r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>'),
    # = +1, (-1, [-1 and , -1 with a sign rather than an operation
    (r"(<mo[^>]*>&#x000(?:3D|28|2C|5B);</mo>)<mo>(&#x0002B;|&#x02212;)</mo>", r'\1<mo form="prefix">\2</mo>'),
)


def with_formulas(page: str) -> str:
    """A page with MathML in place of the formulas outside of code."""
    return EITHER.sub(_typeset, page)


def _typeset(found: re.Match[str]) -> str:
    """A formula, kept on one line with its adjacent punctuation; code as it is."""
    if found["block"]:
        indent = " " * (len(found[0]) - len(found[0].lstrip()))
        return f'{indent}<span class="formula">{mathml(found["block"], "block")}</span>'
    if found["line"]:
        return f'<span class="kept">{found["before"]}{mathml(found["line"], "inline")}{found["after"]}</span>'
    return found[0]


def mathml(latex: str, display: str) -> str:
    """One formula; unknown LaTeX stops the build."""
    from latex2mathml.converter import convert

    text = str(convert(latex.strip(), display=display))
    if unknown := UNKNOWN.search(text):
        raise ValueError(f"{unknown[0]} is unknown LaTeX in the formula {latex}")
    for written, mended in MENDED:
        text = re.sub(written, mended, text)
    return text

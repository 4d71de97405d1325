"""A report as one HTML page that needs nothing else: styles and drawings are inside."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files

from sagline.report.blocks import Chapter, Finding, Table, Verdict

SENTENCE = 40  # characters from which on a cell of a table is text

_subscript = re.compile(r"(?<=[A-Za-zα-ωΑ-Ω])_([A-Za-zα-ω0-9]{1,3}(?:,min)?)(?![A-Za-zα-ω0-9_])")

CLASSES = {
    Verdict.HOLDS: "holds",
    Verdict.HOLDS_WITHIN: "within",
    Verdict.FAILS: "fails",
    Verdict.OPEN: "open",
    Verdict.ERRATUM: "fails",
    Verdict.OURS: "ours",
}


def page(title: str, lead: str, chapters: Sequence[Chapter], footer: str) -> str:
    """The whole page.

    Args:
        title: Of the page.
        lead: The first paragraph.
        chapters: What it consists of.
        footer: How it was made.

    Returns:
        The text of an HTML file.
    """
    style = files("sagline.report").joinpath("page.css").read_text(encoding="utf-8")
    body = "\n".join(_chapter(number, chapter) for number, chapter in enumerate(chapters, start=1))
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>{escape(title)}</h1>\n<p>{escape(lead)}</p>\n</header>\n"
        f"{_contents(chapters)}\n<main>\n{body}\n</main>\n<footer>{escape(footer)}</footer>\n</body>\n</html>\n"
    )


def _contents(chapters: Sequence[Chapter]) -> str:
    """The overview: every finding with its verdict, one line each."""
    lines = []
    for number, chapter in enumerate(chapters, start=1):
        lines.append(
            f'<tr class="part"><th colspan="2" scope="rowgroup"><a href="#{chapter.key}">'
            f"{number}. {_text(chapter.title)}</a></th></tr>"
        )
        lines += [
            f'<tr><td><a href="#{finding.key}">{_text(_headline(finding))}</a></td><td>{_badge(finding)}</td></tr>'
            for finding in chapter.findings
        ]
    return f'<nav aria-label="Overview">\n<h2>Overview</h2>\n<table>\n{"".join(lines)}\n</table>\n</nav>'


def _chapter(number: int, chapter: Chapter) -> str:
    findings = "\n".join(_finding(finding) for finding in chapter.findings)
    return (
        f'<section class="chapter" id="{chapter.key}">\n<h2>{number}. {_text(chapter.title)}</h2>\n'
        f"<p>{_text(chapter.lead)}</p>\n{findings}\n</section>"
    )


def _finding(finding: Finding) -> str:
    said = f'<div class="said"><h4>The article</h4><p>{_text(finding.statement)}</p></div>' if finding.statement else ""
    paragraphs = "".join(f"<p>{_text(part)}</p>" for part in finding.measured.split("\n\n"))
    found = f'<div class="found"><h4>Computed</h4>{paragraphs}</div>'
    panels = "".join(
        f"<figure>{panel.svg}<figcaption>{_text(panel.caption)}</figcaption></figure>" for panel in finding.panels
    )
    drawn = f'<div class="panels">{panels}</div>\n' if panels else ""
    tables = "\n".join(_table(table) for table in finding.data)
    return (
        f'<article id="{finding.key}">\n<h3>{_text(_headline(finding))} {_badge(finding)}</h3>\n'
        f'<div class="pair">{said}{found}</div>\n{drawn}{tables}\n</article>'
    )


def _headline(finding: Finding) -> str:
    """Number and title: "Figures 6, 7: ..."."""
    labels = [
        f"{word}{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
        for word, numbers in (("Table", finding.tables), ("Figure", finding.figures))
        if numbers
    ]
    return f"{', '.join(labels)}: {finding.title}" if labels else finding.title[0].upper() + finding.title[1:]


def _text(text: str) -> str:
    """Text with its subscripts set as such: T_x, b_π, ε_max."""
    return _subscript.sub(r"<sub>\1</sub>", escape(text))


def _badge(finding: Finding) -> str:
    return f'<span class="badge {CLASSES[finding.verdict]}">{finding.verdict}</span>'


def _cell(text: str) -> str:
    """A number on one line, or a sentence that may wrap."""
    return f'<td class="words">{_text(text)}</td>' if len(text) > SENTENCE else f"<td>{_text(text)}</td>"


def _table(table: Table) -> str:
    head = "".join(f'<th scope="col">{_text(cell)}</th>' for cell in table.head)
    rows = "".join(f'<tr><th scope="row">{_text(row[0])}</th>{"".join(map(_cell, row[1:]))}</tr>' for row in table.rows)
    return (
        f'<div class="scroll" tabindex="0"><table><caption>{_text(table.caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )

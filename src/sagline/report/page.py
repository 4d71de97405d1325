"""A report as one HTML page that needs nothing else: styles and drawings are inside."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files

from sagline.report.blocks import Chapter, Finding, Table, Verdict

CLASSES = {
    Verdict.HOLDS: "holds",
    Verdict.HOLDS_WITHIN: "within",
    Verdict.FAILS: "fails",
    Verdict.OPEN: "open",
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
            f"{number}. {escape(chapter.title)}</a></th></tr>"
        )
        lines += [
            f'<tr><td><a href="#{finding.key}">{escape(_headline(finding))}</a></td><td>{_badge(finding)}</td></tr>'
            for finding in chapter.findings
        ]
    return f'<nav aria-label="Overview">\n<h2>Overview</h2>\n<table>\n{"".join(lines)}\n</table>\n</nav>'


def _chapter(number: int, chapter: Chapter) -> str:
    findings = "\n".join(_finding(finding) for finding in chapter.findings)
    return (
        f'<section class="chapter" id="{chapter.key}">\n<h2>{number}. {escape(chapter.title)}</h2>\n'
        f"<p>{escape(chapter.lead)}</p>\n{findings}\n</section>"
    )


def _finding(finding: Finding) -> str:
    said = (
        f'<div class="said"><h4>The article</h4><p>{escape(finding.statement)}</p></div>' if finding.statement else ""
    )
    found = f'<div class="found"><h4>Computed</h4><p>{escape(finding.measured)}</p></div>'
    panels = "".join(
        f"<figure>{panel.svg}<figcaption>{escape(panel.caption)}</figcaption></figure>" for panel in finding.panels
    )
    drawn = f'<div class="panels">{panels}</div>\n' if panels else ""
    tables = "\n".join(_table(table) for table in finding.data)
    return (
        f'<article id="{finding.key}">\n<h3>{escape(_headline(finding))} {_badge(finding)}</h3>\n'
        f'<div class="pair">{said}{found}</div>\n{drawn}{tables}\n</article>'
    )


def _headline(finding: Finding) -> str:
    """Number and title: "Figures 6, 7: ..."."""
    labels = [
        f"{word}{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
        for word, numbers in (("Table", finding.tables), ("Figure", finding.figures))
        if numbers
    ]
    return f"{', '.join(labels)}: {finding.title}" if labels else finding.title


def _badge(finding: Finding) -> str:
    return f'<span class="badge {CLASSES[finding.verdict]}">{finding.verdict}</span>'


def _table(table: Table) -> str:
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in table.head)
    rows = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in row[1:])}</tr>'
        for row in table.rows
    )
    return (
        f'<div class="scroll" tabindex="0"><table><caption>{escape(table.caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )

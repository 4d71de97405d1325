"""HTML page of findings in a single file: chapters, verdicts, tables and drawings."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

from sagline.core.numbers import n
from sagline.files.writing import atomic_files, create_folder, json_text

SENTENCE = 40  # largest number of characters of a cell that does not wrap
NARROW = 3  # largest number of columns of a table beside the text
_subscript = re.compile(r"(?<=[A-Za-zα-ωΑ-Ω])_([A-Za-zα-ω0-9]{1,3}(?:,min)?)(?![A-Za-zα-ω0-9_])")


class Verdict(StrEnum):
    """Verdict on a statement of the article."""

    HOLDS = "holds"
    HOLDS_WITHIN = "holds within limits"
    FAILS = "does not hold"
    OPEN = "cannot be decided"
    ERRATUM = "erratum"
    OURS = "not in the article"


class Panel(NamedTuple):
    """Drawing with a caption."""

    svg: str  # the drawing as text
    caption: str  # text of the figure


class Table(NamedTuple):
    """Table of texts."""

    caption: str  # content of the table
    head: Sequence[str]  # column heads with units
    rows: Sequence[Sequence[str]]  # the cells; the first cell of a row is the name of the row


def table_of(caption: str, *columns: tuple[str, Iterable[Any], str]) -> Table:
    """Create a table from `columns`: head, values, and format of the numbers for `n`. Texts are not formatted."""
    cells = [[each if isinstance(each, str) else n(each, form) for each in values] for _, values, form in columns]
    return Table(caption, [head for head, _, _ in columns], list(zip(*cells, strict=True)))


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """One statement or figure of the article, compared with the computed result."""

    key: str  # HTML id of the finding, and key of its numbers in the results: letters, digits and hyphens
    title: str  # a few words
    statement: str  # statement of the article, with its figure or equation; empty if the article has none
    measured: str  # the computed result
    verdict: Verdict  # verdict on the statement
    numbers: dict[str, Any]  # the unformatted numbers of the finding, for the JSON file
    figures: tuple[int, ...] = ()  # numbers of the figures of the article that the finding reproduces
    tables: tuple[int, ...] = ()  # numbers of the tables of the article that the finding reproduces
    panels: tuple[Panel, ...] = ()
    data: tuple[Table, ...] = field(default=())


@dataclass(frozen=True, slots=True, eq=False)
class Chapter:
    """Chapter of the report."""

    key: str  # name of the chapter
    title: str  # heading of the chapter
    lead: str  # introduction of the chapter
    findings: tuple[Finding, ...]  # findings of the chapter


_SHOWN = {  # for each verdict: its class in page.css, and its text for several statements
    Verdict.HOLDS: ("holds", "hold"),
    Verdict.HOLDS_WITHIN: ("within", "hold within limits"),
    Verdict.FAILS: ("fails", "do not hold"),
    Verdict.OPEN: ("open", "cannot be decided"),
    Verdict.ERRATUM: ("fails", "errata"),
    Verdict.OURS: ("ours", "not in the article"),
}


def page(
    title: str,
    lead: str,
    notation: str,
    chapters: Sequence[Chapter],
    picture: Panel | None,
    footer: str,
    *,
    summary: bool = True,
) -> str:
    """Compose the whole page: a summary on one screen, then all findings."""
    style = files("sagline.present").joinpath("page.css").read_text(encoding="utf-8")
    before = f"{_result(chapters, picture)}\n{_contents(chapters)}\n" if summary else ""
    body = "\n".join(_chapter(number, chapter) for number, chapter in enumerate(chapters, start=1))
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>{escape(title)}</h1>\n<p>{escape(lead)}</p>\n</header>\n"
        f"{before}<p>{_text(notation)}</p>\n"
        f"<main>\n{body}\n</main>\n<footer>{escape(footer)}</footer>\n</body>\n</html>\n"
    )


def write_page(folder: Path | str, names: tuple[str, str], text: str, numbers: dict[str, Any]) -> tuple[Path, Path]:
    """Write the page `text`, and its `numbers` as JSON, to `folder` (created if missing). Both or none are written."""
    place = create_folder(folder)
    with atomic_files(place, names) as (page_file, numbers_file):
        page_file.write_text(text, encoding="utf-8")
        numbers_file.write_text(json_text(numbers) + "\n", encoding="utf-8")
    return place / names[0], place / names[1]


def _result(chapters: Sequence[Chapter], picture: Panel | None) -> str:
    """Counts of statements by verdict and chapter, and one drawing."""
    counts = Counter(finding.verdict for chapter in chapters for finding in chapter.findings)
    verdicts = [verdict for verdict in Verdict if counts[verdict]]
    tiles = ""
    for verdict in verdicts:
        look, several = _SHOWN[verdict]
        text = verdict if counts[verdict] == 1 else several
        tiles += f'<li class="{look}"><strong>{counts[verdict]}</strong> {text}</li>'
    names = ["chapter", *(f"<span>{verdict}</span>" for verdict in verdicts)]
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    rows = ""
    for number, chapter in enumerate(chapters, start=1):
        found = Counter(finding.verdict for finding in chapter.findings)
        cells = "".join(f'<td class="{_SHOWN[verdict][0]}">{found[verdict] or ""}</td>' for verdict in verdicts)
        rows += f'<tr><th scope="row">{_link(number, chapter)}</th>{cells}</tr>'
    return (
        f'<section class="result" aria-label="Result">\n<ul class="tiles">{tiles}</ul>\n<div class="beside">\n'
        f'<div class="scroll" tabindex="0"><table class="counts"><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>\n{_figure(picture) if picture else ''}</div>\n</section>"
    )


def _contents(chapters: Sequence[Chapter]) -> str:
    """List of all findings with their verdicts, one per line."""
    parts = []
    for number, chapter in enumerate(chapters, start=1):
        lines = "".join(
            f'<li><a href="#{finding.key}">{_text(_headline(finding))}</a> {_badge(finding)}</li>'
            for finding in chapter.findings
        )
        parts.append(f"<section><h3>{_link(number, chapter)}</h3><ul>{lines}</ul></section>")
    return f'<nav aria-label="All findings">\n<h2>All findings</h2>\n<div>{"".join(parts)}</div>\n</nav>'


def _link(number: int, chapter: Chapter) -> str:
    return f'<a href="#{chapter.key}">{number}. {_text(chapter.title)}</a>'


def _chapter(number: int, chapter: Chapter) -> str:
    findings = "\n".join(_finding(finding) for finding in chapter.findings)
    return (
        f'<section class="chapter" id="{chapter.key}">\n<h2>{number}. {_text(chapter.title)}</h2>\n'
        f'<p class="lead">{_text(chapter.lead)}</p>\n{findings}\n</section>'
    )


def _finding(finding: Finding) -> str:
    """HTML of a finding. A single drawing or a narrow table is placed beside the text."""
    said = f'<div class="said"><h4>The article</h4><p>{_text(finding.statement)}</p></div>' if finding.statement else ""
    paragraphs = "".join(f"<p>{_text(part)}</p>" for part in finding.measured.split("\n\n"))
    pair = f'<div class="pair">{said}<div class="found"><h4>Computed</h4>{paragraphs}</div></div>'
    drawn = "".join(map(_figure, finding.panels))
    tables = "\n".join(map(_table, finding.data))
    if len(finding.panels) == 1:
        content = f'<div class="beside">\n{pair}\n{drawn}</div>\n{tables}'
    elif finding.panels:
        content = f'{pair}\n<div class="panels{" three" * (len(finding.panels) % 3 == 0)}">{drawn}</div>\n{tables}'
    elif all(len(table.head) <= NARROW for table in finding.data):
        content = f'<div class="beside">\n{pair}\n<div>{tables}</div></div>'
    else:
        content = f"{pair}\n{tables}"
    return (
        f'<article id="{finding.key}">\n<h3>{_text(_headline(finding))} {_badge(finding)}</h3>\n{content}\n</article>'
    )


def _figure(panel: Panel) -> str:
    return f"<figure>{panel.svg}<figcaption>{_text(panel.caption)}</figcaption></figure>"


def _headline(finding: Finding) -> str:
    """Heading of a finding: numbers and title, as in "Figures 6, 7: ..."."""
    labels = [
        f"{word}{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
        for word, numbers in (("Table", finding.tables), ("Figure", finding.figures))
        if numbers
    ]
    return f"{', '.join(labels)}: {finding.title}" if labels else finding.title[0].upper() + finding.title[1:]


def _text(text: str) -> str:
    """HTML of a text with subscripts, as in T_x, b_π, ε_max."""
    return _subscript.sub(r"<sub>\1</sub>", escape(text))


def _badge(finding: Finding) -> str:
    return f'<span class="badge {_SHOWN[finding.verdict][0]}">{finding.verdict}</span>'


def _cell(text: str) -> str:
    """HTML of a table cell. A sentence may wrap, a number does not."""
    return f'<td class="words">{_text(text)}</td>' if len(text) > SENTENCE else f"<td>{_text(text)}</td>"


def _table(table: Table) -> str:
    head = "".join(f'<th scope="col">{_text(cell)}</th>' for cell in table.head)
    rows = "".join(f'<tr><th scope="row">{_text(row[0])}</th>{"".join(map(_cell, row[1:]))}</tr>' for row in table.rows)
    return (
        f'<div class="scroll" tabindex="0"><table><caption>{_text(table.caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )

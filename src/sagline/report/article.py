"""The report on the article: an HTML page and its numbers, both written whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sagline.files.writing import atomic_files, check_files, create_folder, json_text, plain
from sagline.report.blocks import Chapter
from sagline.report.page import page
from sagline.report.parts import selection
from sagline.report.result import picture

NAMES = ("article.html", "article.json")  # both or neither is written
TITLE = "The article, redone"
LEAD = (
    "Gia Luan & Truong Thinh, “Empirical Quasi-Static and Inverse Kinematics of Cable-Driven Parallel Manipulators "
    "Including Presence of Sagging”, Appl. Sci. 2020, 10(15), 5318, doi:10.3390/app10155318, beside what sagline "
    "computes with exact elastic catenaries."
)
NOTATION = (
    "Notation: z up, T acts on the cable at its platform end, φ is the article's β. Every number on the computed side "
    "was computed when this page was made; one that is rounding of the arithmetic alone is told as such."
)

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True, eq=False)
class ArticleReport:
    """A report that has been written.

    Attributes:
        page: The HTML file.
        data: The JSON file of its numbers.
        chapters: What is in it.
        numbers: Chapter -> finding -> the numbers behind it, plain.
    """

    page: Path
    data: Path
    chapters: tuple[Chapter, ...]
    numbers: dict[str, dict[str, Any]]


def write_article(folder: Path | str, parts: Sequence[str] = (), progress: Progress | None = None) -> ArticleReport:
    """Redo the article's studies and write a self-contained HTML page and a JSON file of its numbers.

    Args:
        folder: Where to; created if missing. The files are article.html and article.json.
        parts: What to redo: chapter keys, "figures 6-9", "table 2"; nothing for everything.
        progress: Called before each chapter with the number of chapters done, their total, and the next one's key.

    Returns:
        What was written.

    Raises:
        InvalidValueError: If a part is unknown.
        FileError: If the folder cannot be written; then nothing has been.
    """
    wanted = selection(parts)
    check_files(folder, NAMES)
    chapters = []
    for done, part in enumerate(wanted.parts):
        if progress is not None:
            progress(done, len(wanted.parts), part.key)
        chapters.append(wanted.cut(part.build()))
    if progress is not None:
        progress(len(chapters), len(chapters), "done")
    numbers = {c.key: {finding.key: plain(finding.numbers) for finding in c.findings} for c in chapters}
    made = f"Made by sagline {version('sagline')}: sagline article {' '.join(parts)}".rstrip() + "."
    contents = page(TITLE, LEAD, NOTATION, chapters, picture(chapters), made), json_text(numbers) + "\n"
    place = create_folder(folder)
    with atomic_files(place, NAMES) as files:
        for file, content in zip(files, contents, strict=True):
            file.write_text(content, encoding="utf-8")
    return ArticleReport(place / NAMES[0], place / NAMES[1], tuple(chapters), numbers)

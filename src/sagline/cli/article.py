"""`sagline article`: the article's studies, figures and tables redone, as one page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from sagline.cli.entries import FORWARD, INVERSE
from sagline.cli.terminal import counting, note, show_json
from sagline.files.whole import check_files
from sagline.report.article import NAMES, write_article


def write_report(folder: Path, parts: Sequence[str], *, as_json: bool) -> None:
    """Write the report and say where it is.

    Raises:
        SaglineError: If a part is unknown or the folder cannot be written; then nothing has been.
    """
    check_files(folder, NAMES)
    needed = () if parts else (INVERSE, FORWARD)  # single parts need neither, or one
    with counting("redoing the article", *needed) as progress:
        report = write_article(folder, parts, progress)
    if as_json:
        show_json(report.numbers)
        return
    verdicts = Counter(finding.verdict for chapter in report.chapters for finding in chapter.findings)
    note("", ", ".join(f"{count} × {verdict}" for verdict, count in verdicts.items()))
    note("", f"The report: {report.page.resolve()}; its numbers: {report.data.name}")

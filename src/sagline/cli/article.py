"""`sagline article`: a page that reproduces the article's studies, figures and tables."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

from sagline.cli.options import JsonOption, OutOption, argument
from sagline.cli.output import Output
from sagline.cli.terminal import show_json, show_note, working


def article(
    parts: Annotated[
        list[str] | None,
        argument(
            "PART",
            "figures N-M, table 2, or a chapter: feasible-sets, intercept, sag, constants, identify, models, "
            "simulation, poses, workspace, errata. Default: everything.",
        ),
    ] = None,
    folder: OutOption = Path("output"),
    as_json: JsonOption = False,
) -> None:
    """Reproduce the article's figures, tables and errata, as one page that compares the article with computed values.

    The page is DIR/article.html and needs no other file. The numbers are in DIR/article.json.

    For example:

        sagline article
        sagline article figures 6-9 --out results
        sagline article errata table 2
    """
    from sagline.article.report import NAMES, write_article

    Output(folder, "", NAMES)  # `Outputs` raises an error if a file cannot be written
    what = "reproducing the studies of the article"
    with working(what) as line:

        def progress(done: int, total: int, name: str) -> None:
            line.name(f"{what}: {name}")
            line.progress(done, total)

        report = write_article(folder, parts or [], progress)
    if as_json:
        show_json(report.numbers)
        return
    verdicts = Counter(finding.verdict for chapter in report.chapters for finding in chapter.findings)
    show_note("", ", ".join(f"{count} × {verdict}" for verdict, count in verdicts.items()))
    show_note("", f"The report: {report.page.resolve()}; its numbers: {report.data.name}")

"""The whole report, once for all tests of this folder, with the figures that were drawn for it."""

from typing import NamedTuple

import pytest

from sagline.plot.sheet import Sheet
from sagline.report.article import ArticleReport, write_article
from sagline.report.blocks import Panel
from sagline.report.drawing import Drawings


class Written(NamedTuple):
    """A report, and the drawings in it with their captions."""

    report: ArticleReport
    figures: list[tuple[str, Sheet]]


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """The whole report; its seconds are the longest of this folder."""
    figures: list[tuple[str, Sheet]] = []
    panel = Drawings.panel

    def kept(self: Drawings, figure: Sheet, caption: str) -> Panel:
        figures.append((caption, figure))
        return panel(self, figure, caption)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Drawings, "panel", kept)
        report = write_article(tmp_path_factory.mktemp("report"))
    return Written(report, figures)


@pytest.fixture(scope="session")
def report(written: Written) -> ArticleReport:
    """The report alone."""
    return written.report

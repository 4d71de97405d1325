"""Reports for all tests of this folder, with their figures: one of three chapters and one of all chapters."""

from pathlib import Path
from typing import Any, NamedTuple

import pytest
from matplotlib.figure import Figure

from sagline.article import drawing
from sagline.article import report as page
from sagline.article.report import ArticleReport, write_article
from sagline.present.page import Panel
from tests.tiers import wide

QUICK = ("feasible-sets", "intercept", "errata")  # chapters that take less than a second in total


class Written(NamedTuple):
    """A report and its drawings with their captions.

    Attributes:
        report: The report.
        figures: Captions and drawings.
        is_whole: False for the quick chapters alone.
    """

    report: ArticleReport
    figures: list[tuple[str, Figure]]
    is_whole: bool


def written_with_figures(folder: Path, parts: tuple[str, ...] = ()) -> Written:
    figures: list[tuple[str, Figure]] = []
    panel = drawing.panel_of

    def report_kept_for_all_tests(name: str, figure: Any, caption: str, legend: str = "") -> Panel:
        figures.append((caption, figure))
        return panel(name, figure, caption, legend)

    with pytest.MonkeyPatch.context() as patch:
        for module in (drawing, page):
            patch.setattr(module, "panel_of", report_kept_for_all_tests)
        return Written(write_article(folder, parts), figures, not parts)


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Report of the quick chapters."""
    return written_with_figures(tmp_path_factory.mktemp("quick"), QUICK)


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Report of all chapters; it takes the longest time of this folder."""
    return written_with_figures(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="session", params=wide(["quick", "written"]))
def either(request: pytest.FixtureRequest) -> Written:
    """Quick chapters in the first tier, all chapters in the second."""
    found: Written = request.getfixturevalue(request.param)
    return found


@pytest.fixture(scope="session")
def report(written: Written) -> ArticleReport:
    """Page of the whole report."""
    return written.report

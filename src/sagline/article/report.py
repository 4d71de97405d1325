"""The report on the article: selected chapters as an HTML page and a JSON file."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.ticker import FixedLocator, NullLocator

import sagline as sl
from sagline.article.drawing import NAME_SIZE, axes, panel_of
from sagline.article.simulation import ERROR_BAND
from sagline.core.numbers import n
from sagline.files.writing import check_files, plain
from sagline.plot.sheet import BLUE, VERMILLION
from sagline.present.page import Chapter, Finding, Panel, page, write_page

NAMES = ("article.html", "article.json")  # if one file cannot be written, neither is written
TITLE = "The article, reproduced"
LEAD = (
    "Gia Luan & Truong Thinh, “Empirical Quasi-Static and Inverse Kinematics of Cable-Driven Parallel Manipulators "
    "Including Presence of Sagging”, Appl. Sci. 2020, 10(15), 5318, doi:10.3390/app10155318, compared with "
    "computations of sagline with exact elastic catenaries."
)
NOTATION = (
    "Notation: z up, T acts on the cable at its platform end, φ is the article's β. All numbers of sagline "
    "were computed when this page was made; rounding errors are marked."
)

Progress = Callable[[int, int, str], None]
_numbers = re.compile(r"(\d+)(?:-(\d+))?")
REDONE = "3-15, 17-22 and 25-27; the others are drawings and photographs without data"
KEY = "five-models"  # key of the finding that contains the numbers of the drawing
FIRST, LAST = 1e-3, 1e4  # limits of the axis [mm]; for smaller values, a text is written at the edge
ROBOTS = (("suspended", BLUE, -0.16), ("mixed", VERMILLION, 0.16))


@dataclass(frozen=True, slots=True, eq=False)
class ArticleReport:
    """A report that was written: its files, chapters and numbers."""

    page: Path  # the HTML file
    data: Path  # the JSON file of its numbers
    chapters: tuple[Chapter, ...]  # chapters of the report
    numbers: dict[str, dict[str, Any]]  # unformatted numbers by chapter and finding


def write_article(folder: Path | str, parts: Sequence[str] = (), progress: Progress | None = None) -> ArticleReport:
    """Repeat the studies of the article, and write a self-contained HTML page and a JSON file with its numbers."""
    selected, wanted = selection(parts)
    check_files(folder, NAMES)
    chapters = []
    for done, part in enumerate(selected):
        if progress is not None:
            progress(done, len(selected), part.key)
        chapter = part.build()
        if part.key not in wanted:
            chapter = replace(chapter, findings=tuple(f for f in chapter.findings if wanted & _numbers_of(f)))
        chapters.append(chapter)
    if progress is not None:
        progress(len(chapters), len(chapters), "done")
    numbers = {c.key: {finding.key: plain(finding.numbers) for finding in c.findings} for c in chapters}
    made = f"Made by sagline {version('sagline')}: sagline article {' '.join(parts)}".rstrip() + "."
    text = page(TITLE, LEAD, NOTATION, chapters, _picture(chapters), made)
    return ArticleReport(*write_page(folder, NAMES, text, numbers), tuple(chapters), numbers)


class _ReportPart(NamedTuple):
    """A chapter of the report that a user can select."""

    key: str  # name of the chapter
    figures: tuple[int, ...]  # figures of the article in the chapter
    tables: tuple[int, ...]  # tables of the article in the chapter
    module: str  # module that builds the chapter, loaded on demand
    function: str  # function that builds the chapter

    def build(self) -> Chapter:
        """Build the chapter."""
        function: Callable[[], Chapter] = getattr(import_module(f"sagline.article.{self.module}"), self.function)
        return function()


PARTS = (
    _ReportPart("feasible-sets", (3, 4, 5), (), "feasible_sets", "feasible_chapter"),
    _ReportPart("intercept", (6, 7), (), "constants", "intercept_chapter"),
    _ReportPart("sag", tuple(range(8, 16)), (), "constants", "sag_chapter"),
    _ReportPart("constants", (), (), "constants", "constants_chapter"),
    _ReportPart("identify", (), (), "identification", "identify_chapter"),
    _ReportPart("models", (), (), "models", "models_chapter"),
    _ReportPart("simulation", tuple(range(17, 23)), (), "simulation", "simulation_chapter"),
    _ReportPart("poses", (25, 26, 27), (2,), "poses", "poses_chapter"),
    _ReportPart("workspace", (), (), "workspace", "workspace_chapter"),
    _ReportPart("errata", (), (), "errata", "errata_chapter"),
)


Wanted = set[str | tuple[str, int]]  # keys of whole chapters; figures and tables, such as ("figures", 6)


def selection(words: Sequence[str]) -> tuple[list[_ReportPart], Wanted]:
    """Chapters with a finding that the command's arguments `words` select, and the selection; default: everything."""
    wanted: Wanted = set() if words else {part.key for part in PARTS}
    kind, open_word = "figures", ""
    for word in (w for text in words for w in text.replace(",", " ").split()):
        lower = word.lower()
        if lower.removesuffix("s") in {"figure", "table"}:
            kind = open_word = f"{lower.removesuffix('s')}s"
        elif found := _numbers.fullmatch(word):
            wanted |= _checked_range(kind, word, int(found[1]), int(found[2] or found[1]))
            open_word = ""
        elif lower in {part.key for part in PARTS}:
            wanted.add(lower)
        else:
            raise _unknown(word)
    if open_word:
        raise sl.InvalidValueError(open_word, "without numbers", f"{open_word} 6-9", "Give numbers after this word.")
    return [part for part in PARTS if part.key in wanted or wanted & _numbers_of(part)], wanted


def _numbers_of(part: _ReportPart | Finding) -> Wanted:
    """Figures and tables of a chapter or of a finding."""
    return {(kind, number) for kind in ("figures", "tables") for number in getattr(part, kind)}


def _checked_range(kind: str, word: str, first: int, last: int) -> Wanted:
    numbers: Wanted = {(kind, number) for number in range(first, last + 1)} if last < 100 else set()
    known = {number for part in PARTS for number in _numbers_of(part)}
    if not numbers & known:
        allowed = REDONE if kind == "figures" else "2; Table 1 is in the presets"
        raise sl.InvalidValueError(f"{kind} {word}", "not repeated here", allowed, "Give one of these.")
    return numbers & known


def _unknown(word: str) -> sl.InvalidValueError:
    keys = [part.key for part in PARTS]
    near = get_close_matches(word.lower(), [*keys, "figures", "tables"], n=1)
    step = f"Did you mean {near[0]}?" if near else "Without a word, everything is selected."
    return sl.InvalidValueError("part", repr(word), f"{', '.join(keys)}, figures N-M, table 2", step)


def _picture(chapters: Sequence[Chapter]) -> Panel | None:
    """Drawing of the largest position error of each model for both robots; None without the chapter of simulations."""
    numbers = next((f.numbers for c in chapters for f in c.findings if f.key == KEY), None)
    if numbers is None:
        return None
    models = numbers["largest_error"]
    figure, ax = axes("largest position error [mm]", "", height=2.7)
    figure.subplots_adjust(left=0.2)
    ax.axvline(1e3 * ERROR_BAND, color="0.4", linewidth=0.9, linestyle=":", label=f"article: {n(ERROR_BAND, unit='m')}")
    for robot, color, shift in ROBOTS:
        errors = [model[f"{robot}_mm"] for model in models.values()]
        ax.plot(errors, [k + shift for k in range(len(errors))], "o", color=color, markersize=5.0, label=robot)
        for k, error in enumerate(errors):
            text = n(error, ".2g", "mm", size=1e3 * numbers["longest_length_m"])
            place, away = (max(error, FIRST), k + shift), -7.0 if FIRST < error < 1e3 * ERROR_BAND else 7.0
            side = "left" if away > 0.0 else "right"  # position of the label of the article's line
            ax.annotate(text, place, (away, 0.0), textcoords="offset points", fontsize=NAME_SIZE, va="center", ha=side)
    ax.set_xscale("log")
    ax.set_xlim(FIRST, LAST)
    ax.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(-3, 4)]))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_yticks(range(len(models)), labels=list(models))
    ax.set_ylim(len(models) - 0.5, -0.5)
    return panel_of(
        "result",
        figure,
        "Position errors of exact cables along the article's path, with lengths that each cable model plans.",
    )

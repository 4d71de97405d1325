"""The report: complete, self-contained, and with correct numbers."""

import json
import re
import statistics
import tomllib
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.article import drawing
from sagline.article.report import PARTS, ArticleReport, selection, write_article
from sagline.present.page import Verdict
from tests.article.conftest import Written
from tests.refusal import refused
from tests.tiers import extended

ZERO, PULLEY = "zero of the lengths", "pulley radius"
VOID = {"meta", "br", "link", "img"}


class Page(HTMLParser):
    """Contents of a page, with a check that its tags are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.open: list[str] = []
        self.counts: dict[str, int] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.counts[tag] = self.counts.get(tag, 0) + 1
        values = {name: value or "" for name, value in attrs}
        if "id" in values:
            self.ids.append(values["id"])
        for name in ("href", "xlink:href"):
            if name in values:
                self.links.append(values[name])
        if "src" in values:
            self.sources.append(values["src"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def page(either: Written) -> Page:
    return Page(either.report.page.read_text())


def test_the_page_is_self_contained(either: Written, page: Page) -> None:
    assert page.open == []
    assert page.sources == []
    assert [link for link in page.links if not link.startswith(("#", "data:image/png;base64,"))] == []
    text = either.report.page.read_text()
    assert re.findall(r"@import|url\((?!#)|<script", text) == []
    assert len(text) < 4_000_000


def test_ids_are_unique_and_links_lead_to_them(page: Page) -> None:
    assert len(page.ids) == len(set(page.ids))
    assert {link[1:] for link in page.links if link.startswith("#")} <= set(page.ids)


def test_every_finding_has_its_drawings_and_text(either: Written, page: Page) -> None:
    findings = [finding for chapter in either.report.chapters for finding in chapter.findings]
    first = int(either.is_whole)  # picture of the first screen
    assert page.counts["svg"] == page.counts["figure"] == first + sum(len(finding.panels) for finding in findings)
    for finding in findings:
        assert finding.panels or finding.data
        assert finding.statement or finding.verdict is Verdict.OURS
        assert not re.search(r"\bnan\b|\binf\b|None|\[\d", finding.measured)


@extended
def test_all_reproducible_figures_are_on_the_page(report: ArticleReport) -> None:
    findings = [finding for chapter in report.chapters for finding in chapter.findings]
    figures = sorted(number for finding in findings for number in finding.figures)
    assert figures == [*range(3, 16), *range(17, 23), 25, 26, 27]
    assert [number for finding in findings for number in finding.tables] == [2]


def test_numbers_of_the_quick_chapters(either: Written) -> None:
    numbers = json.loads(either.report.data.read_text())
    assert numbers == either.report.numbers
    assert numbers["intercept"]["h-over-density"]["k_h_platform"] == pytest.approx(5.0234, abs=1e-3)
    assert numbers["feasible-sets"]["psi"]["extent_N"] == pytest.approx([46.2, 4.62, 0.462], rel=0.01)
    assert numbers["feasible-sets"]["psi-curve"]["strictly_falling"] is True
    assert numbers["feasible-sets"]["line-pi"]["r_squared"] > 0.9999999
    assert len(numbers["errata"]) == 11


@extended
def test_the_numbers_are_in_the_json_file(report: ArticleReport) -> None:
    numbers = json.loads(report.data.read_text())
    found = numbers["constants"]["published-range"]["published_range"]
    assert found["k_h_frame"] == pytest.approx(-4.845, abs=1e-5)
    assert found["k_p"] == pytest.approx(4.385, abs=1e-5)
    assert numbers["sag"]["stretch-removed"]["error_of_36_mm"] == pytest.approx(0.51, abs=0.01)
    assert numbers["sag"]["p-over-density"]["k_p_of_density"][0] == pytest.approx(4.015, abs=2e-3)
    assert numbers["identify"]["empirical-fit"]["k_h"]["value"] == pytest.approx(4.878, abs=2e-3)
    limits = {
        limit["tolerance_m"]: limit["tension_min_N"] for limit in numbers["identify"]["validity-limits"]["limits"]
    }
    assert limits == {0.001: None, 0.002: 150.0, 0.005: 100.0, 0.01: 70.0}
    shares = numbers["models"]["length-error-maps"]["share_within_1_mm"]
    assert shares["Straight"] < shares["Elastic"] < shares["Empirical"] < shares["Parabolic"] < 1.0
    chord, tension = np.meshgrid(np.geomspace(1.0, 30.0, 41), np.geomspace(5.0, 2000.0, 61))
    down = chord * np.sin(np.radians(30.0))
    exact = sl.Catenary().from_tension(sl.Cable(0.067, 44e3), chord * np.sqrt(0.75), -down, tension).unstrained_length
    good = {"Straight": chord, "Elastic": chord / (1.0 + tension / 44e3)}
    assert {name: shares[name] for name in good} == pytest.approx(
        {name: np.mean(np.abs(length - exact) <= 1e-3) for name, length in good.items()}, abs=1e-12
    )
    simulation = numbers["simulation"]
    assert simulation["configurations"]["tension_ratio"] == pytest.approx(2.075, abs=0.005)
    assert simulation["position-error"]["suspended"]["max_mm"] == pytest.approx(1.711, abs=0.005)
    assert simulation["position-error"]["mixed"]["max_mm"] == pytest.approx(1.131, abs=0.005)
    assert simulation["configurations"]["share_of_lower_cables_at_limit"] == pytest.approx(0.52, abs=0.02)
    poses = numbers["poses"]
    assert poses["table-2"]["distance_mm"][1] == pytest.approx(44.7884, abs=1e-4)
    assert poses["error-in-space"]["slope_mm_per_m"] == pytest.approx(-18.17, abs=0.01)
    assert poses["error-in-space"]["lowest_vertical_error_mm"] > 0.0
    tension, distance = np.mean(poses["table-2"]["horizontal_tension_N"], axis=1), poses["table-2"]["distance_mm"]
    against = statistics.correlation(tension.tolist(), distance)
    assert poses["error-in-space"]["correlation_with_tension"] == pytest.approx(against, rel=1e-9)
    best = poses["explanations"]["explanations"][1][0]
    assert best["values"] == pytest.approx({ZERO: -7.26, PULLEY: 38.3}, abs=0.05)
    assert best["deviations"] == pytest.approx({ZERO: 0.55, PULLEY: 2.68}, abs=0.01)
    assert (best["rms_mm"], best["left_out_rms_mm"]) == pytest.approx((3.92, 4.53), abs=0.01)
    assert poses["explanations"]["models"] == 175
    assert poses["ten-points"]["pulley_imitated_by_zero_and_anchor_height"] == pytest.approx(0.990, abs=1e-3)
    where = numbers["workspace"]["volume"]
    assert where["article-suspended"]["volume_m3"] == pytest.approx(789.4, abs=1.0)  # by the program of a study
    assert where["article-suspended"]["change_percent"] == pytest.approx(0.8, abs=0.1)
    for model, key in ((sl.Catenary(), "volume_m3"), (sl.Straight(), "straight_volume_m3")):
        coarse = sl.workspace(sl.load_robot("article-mixed"), model=model, cells=12)
        assert where["article-mixed"][key] == pytest.approx(coarse.volume, abs=coarse.volume_error)
    apart = numbers["workspace"]["boundary"]["farthest_apart_m"]
    assert all(0.01 < value < 0.1 for value in apart.values())
    classes = poses["classes"]
    left = {"anchor height": 9.0, PULLEY: 10.6, ZERO: 11.2, "Young's modulus E": 12.7}
    assert {name: classes["left_mm"][name] for name in left} == pytest.approx(left, abs=0.05)
    assert classes["fall_as_measured"] == ["pulley radius"]
    assert classes["slope_of_best_mm_per_m"]["pulley radius"] == pytest.approx(-18.0, abs=0.1)
    assert set(classes["explain_nothing"]) == {"linear density ρ", "drum radius", "dead cable"}
    assert classes["dead_meter_mm"] == pytest.approx({"P8": 4.8, "P7": -64.0}, abs=0.1)
    assert min(classes["left_mm"].values()) > 0.66 * classes["measured_rms_mm"]  # as in docs/experiment.md
    assert classes["two_left_mm"] < classes["measured_rms_mm"] / 3.0


@extended
def test_the_documentation_has_the_same_volumes(report: ArticleReport) -> None:
    page = " ".join((Path(__file__).parents[2] / "docs" / "article.md").read_text(encoding="utf-8").split())
    suspended, mixed = report.numbers["workspace"]["volume"].values()
    for found, sign in ((suspended, "+"), (mixed, "−")):
        volume, change = f"{found['volume_m3']:.1f} m³", f" {sign}{abs(found['change_percent']):.2f} %"
        assert change in page.partition(volume)[2][:30]


NUMBER = re.compile(r"(?<![\w.])([-−]?\d[\d,]*(?:\.\d+)?)(?:\u00a0([fpnµmkMG](?=[mNgs](?![\w²]))))?")
PREFIX = {"f": -15, "p": -12, "n": -9, "µ": -6, "m": -3, "k": 3, "M": 6, "G": 9}
NAMES = re.compile(r"\(\d+\)|errat(?:um|a) \d+|[Ff]igures? \d+|[Tt]ables? \d+|/24?\b|\(24 ")  # and parts of formulas
SCALES = (1.0, 1e2, 1e3, 1e-3, 1e6)  # unchanged, in percent, in mm, in kN, in micrometers
UNITS = (1.0, 1e-3, 1e-12)  # for lengths with a prefix: m, mm, pm


def leaves(numbers: Any) -> Iterator[float]:
    """All numbers of nested data."""
    match numbers:
        case dict():
            for value in numbers.values():
                yield from leaves(value)
        case list():
            for value in numbers:
                yield from leaves(value)
        case int() | float():
            yield float(numbers)


def is_among(text: str, prefix: str, numbers: list[float]) -> bool:
    """True if a printed number is one of the given numbers, rounded to the printed digits."""
    digits = text.replace("−", "-").replace(",", "")
    power = PREFIX.get(prefix, 0)
    printed, half = abs(float(digits)) * 10.0**power, 0.5001 * 10.0 ** (power - len(digits.partition(".")[2]))
    return any(
        abs(scale * abs(value) - printed) <= half for value in numbers for scale in (UNITS if prefix else SCALES)
    )


def test_numbers_of_the_page_have_no_machine_notation(either: Written) -> None:
    """No exponents, no hyphens as minus signs, and no digits due to rounding."""
    report = either.report
    text = re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]*>", " ", report.page.read_text(), flags=re.DOTALL)
    assert re.findall(r"\d[eE][-+−]?\d+|±\s*\d[\d.]*e|(?<![\w.,])-\d", text) == []
    cells = [
        cell for chapter in report.chapters for f in chapter.findings for t in f.data for row in t.rows for cell in row
    ]
    assert cells.count("0 (rounding)") == (7 if either.is_whole else 3)  # four of the exact model, three of the errata


@extended
def test_uncertain_numbers_have_only_significant_digits(report: ArticleReport) -> None:
    fits = next(f for chapter in report.chapters for f in chapter.findings if f.key == "cable-fit").data[0].rows
    assert [cell.replace("\u00a0", " ") for cell in fits[1][1:3]] == ["55(62) g/m", "43.98(10) kN"]


def test_every_number_in_a_sentence_is_one_of_the_numbers_of_its_finding(either: Written) -> None:
    told, report = 0, either.report
    for chapter in report.chapters:
        for finding in chapter.findings:
            numbers = list(leaves(report.numbers[chapter.key][finding.key]))
            printed = NUMBER.findall(NAMES.sub("", finding.measured))
            told += len(printed)
            assert [told for told in printed if not is_among(told[0], told[1], numbers)] == [], finding.measured
    assert told > (150 if either.is_whole else 15)


@extended
def test_statements_without_numbers_are_true(report: ArticleReport) -> None:
    numbers = report.numbers
    cases = {case["case"]: case for case in numbers["identify"]["cable-fit"]["cases"]}
    both, taut, loose, offset = cases.values()
    assert (
        loose["standard_error"][0] < both["standard_error"][0] < taut["standard_error"][0]
    )  # slack cables determine the density
    assert both["standard_error"][1] < loose["standard_error"][1]  # taut cables determine the stiffness
    assert offset["standard_error"][1] > 1.5 * both["standard_error"][1]
    assert [name for name, case in cases.items() if case["warnings"]] == ["taut only"]
    slopes = numbers["poses"]["one-parameter-off"]["height_slope_mm_per_m"]
    falling = [name for name, slope in slopes.items() if slope < 0.0]
    assert falling == ["linear density ρ", "drum radius", "pulley radius", "dead cable"]
    low = numbers["simulation"]["low-tension"]
    good = [max(a, b) <= 6.0 for a, b in zip(low["suspended_mm"], low["mixed_mm"], strict=True)]
    assert good == sorted(good)  # insufficient below a limit, sufficient above it
    assert numbers["poses"]["tour"]["feasible_share"] == 1.0
    assert numbers["poses"]["ten-points"]["pulley_or_anchor_height_in_all_of_them"]
    explained, measured = numbers["poses"]["explanations"], numbers["poses"]["explanations"]["measured_rms_mm"]
    assert explained["explanations"][2][0]["at_limit"] == [
        "pulley radius"
    ]  # the best third parameter ends at its limit
    assert (
        explained["three_inside_aicc_above_best_two"] > 0.5
    )  # and no other parameter improves the information criterion
    assert min(numbers["poses"]["ten-points"]["single_zero_deviation_mm"]) > 4.0 * measured


def test_single_chapters(tmp_path: Path) -> None:
    told: list[tuple[int, int, str]] = []
    report = write_article(tmp_path, ["figures", "6-7"], lambda *state: told.append(state))
    assert told == [(0, 1, "intercept"), (1, 1, "done")]
    assert [finding.figures for chapter in report.chapters for finding in chapter.findings] == [(6,), (7,)]
    assert "figures 6-7" in report.page.read_text()


@extended
def test_the_same_report_has_the_same_bytes(tmp_path: Path) -> None:
    first, second = (write_article(tmp_path / name, ["figure", "3"]).page.read_bytes() for name in "ab")
    assert first == second


@pytest.mark.parametrize(
    ("words", "keys"),
    [
        ([], [part.key for part in PARTS]),
        (["figures", "6-9"], ["intercept", "sag"]),
        (["figures 6-9"], ["intercept", "sag"]),
        (["Figures", "3,22"], ["feasible-sets", "simulation"]),
        (["table", "2"], ["poses"]),
        (["errata", "figure", "27"], ["poses", "errata"]),
        (["15-17"], ["sag", "simulation"]),
    ],
)
def test_names_of_chapters_are_accepted(words: list[str], keys: list[str]) -> None:
    assert [part.key for part in selection(words)[0]] == keys


@pytest.mark.parametrize(
    ("words", "item", "value", "allowed", "next_step"),
    [
        (["erata"], "part", "'erata'", None, "Did you mean errata?"),
        (["figure", "16"], "figures 16", "not repeated here", None, None),
        (["figures", "23-24"], "figures 23-24", "not repeated here", None, None),
        (["figures"], "figures", "without numbers", "figures 6-9", None),
        (["table", "1"], "tables 1", "not repeated here", "2; Table 1 is in the presets", None),
        (["figures", "3-999999999"], "figures 3-999999999", "not repeated here", None, None),
    ],
)
def test_names_of_other_chapters_are_refused(
    words: list[str], item: str, value: str, allowed: str | None, next_step: str | None, tmp_path: Path
) -> None:
    with refused(item, value, allowed, next_step, kind=sl.InvalidValueError):
        write_article(tmp_path / "new", words)
    assert not (tmp_path / "new").exists()


@extended
def test_an_interrupted_report_leaves_no_files(tmp_path: Path) -> None:
    def interrupt(done: int, total: int, name: str) -> None:
        if done == total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_article(tmp_path, ["figure", "3"], interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with refused(kind=sl.FileError, file=tmp_path / "file"):
        write_article(tmp_path / "file", progress=lambda *_: pytest.fail("it began"))


def test_every_text_belongs_to_a_finding_or_a_chapter() -> None:
    folder = Path(drawing.__file__).parent
    source = "".join(file.read_text(encoding="utf-8") for file in folder.glob("*.py"))
    entries = tomllib.loads((folder / "data" / "report.toml").read_text(encoding="utf-8"))
    for kind, call in (("findings", "finding"), ("chapters", "chapter")):
        for key in entries[kind]:
            assert key.startswith("erratum-") or re.search(rf'{call}\(\s*"{key}"', source), key


def test_numbers_of_texts_have_factors_parts_and_units() -> None:
    known = {"share": 0.25, "errors": [1.0, 2.0], "fit": {"k": 4.385}, "count": 12, "word": "slack"}
    template = "{100*share:.1f %} {1000*errors[1]:.0f mm} {fit[k]:.2f} {count} {word}"
    text = drawing._Numbers().format(template, **known)
    assert text.replace("\N{NO-BREAK SPACE}", " ") == "25.0 % 2 m 4.38 12 slack"

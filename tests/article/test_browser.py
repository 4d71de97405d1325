"""The report in headless Chromium: light and dark theme, on a phone, on a desktop screen and on paper."""

import re
import zlib
from collections.abc import Iterator
from io import BytesIO
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page

from sagline.article.report import ArticleReport
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended
from tests.viewer.reach import broken_rules

FLAGS = "--disable-quic --disable-gpu"
WIDTHS, THEMES = (390, 768, 1440), ("light", "dark")

pytestmark = [extended, NEEDED]

# colors of text and background outside drawings, and of each drawing and its card
CONTRASTS = """() => {
  const parts = color => color.match(/[\\d.]+/g).map(Number);
  const light = color => {
    const curve = c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
    const linear = parts(color).slice(0, 3).map(c => curve(c / 255));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  };
  const ground = element => {
    for (let e = element; e; e = e.parentElement) {
      const color = getComputedStyle(e).backgroundColor;
      if (parts(color).length === 3) return color;
    }
    return 'rgb(255, 255, 255)';
  };
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || element.closest('svg')) continue;
    const [a, b] = [light(getComputedStyle(element).color), light(ground(element))];
    found.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), walker.currentNode.textContent.trim().slice(0, 40)]);
  }
  return found;
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def opened(browser: Browser, report: ArticleReport, width: int, theme: str, height: int = 900) -> Page:
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)  # type: ignore[arg-type]
    page.set_default_timeout(1e3 * PATIENCE)
    page.goto(report.page.as_uri())
    return page


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("width", WIDTHS)
def test_all_text_is_readable_without_horizontal_scrolling(
    browser: Browser, report: ArticleReport, width: int, theme: str
) -> None:
    page = opened(browser, report, width, theme)
    found = page.evaluate(CONTRASTS)
    assert len(found) > 500
    assert broken_rules(page) == {}
    assert [(ratio, text) for ratio, text in found if ratio < 4.5] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.close()


def brightness(color: str) -> float:
    return float(np.mean([int(part) for part in re.findall(r"\d+", color)[:3]]))


def test_the_dark_theme_is_dark_with_drawings_on_light_cards(browser: Browser, report: ArticleReport) -> None:
    page = opened(browser, report, 1440, "dark")
    assert brightness(page.evaluate("getComputedStyle(document.body).backgroundColor")) < 40.0
    cards = page.evaluate("[...document.querySelectorAll('figure svg')].map(e => getComputedStyle(e).backgroundColor)")
    assert {card for card in cards if brightness(card) < 235.0 or card.startswith("rgba")} == set()
    page.close()


@pytest.mark.parametrize("theme", THEMES)
def test_the_first_screen_is_the_result(browser: Browser, report: ArticleReport, theme: str) -> None:
    page = opened(browser, report, 1440, theme)
    for part in (".tiles", ".counts", ".result figure"):
        box = page.locator(part).bounding_box()
        assert box is not None
        assert box["y"] >= 0.0
        assert box["y"] + box["height"] <= 900.0, part
    verdicts = [finding.verdict for chapter in report.chapters for finding in chapter.findings]
    told = [int(text) for text in page.locator(".tiles strong").all_inner_texts()]
    assert sorted(told) == sorted(verdicts.count(verdict) for verdict in set(verdicts))
    cells = page.locator(".counts td").all_inner_texts()
    assert sum(int(cell) for cell in cells if cell) == len(verdicts)
    page.close()


def test_a_single_drawing_is_beside_its_text(browser: Browser, report: ArticleReport) -> None:
    page = opened(browser, report, 1440, "light")
    alone = [f.key for chapter in report.chapters for f in chapter.findings if len(f.panels) == 1]
    assert len(alone) > 5
    for key in alone:
        text, drawn = (page.locator(f"#{key} {part}").first.bounding_box() for part in (".pair", "figure"))
        assert text is not None
        assert drawn is not None
        assert drawn["x"] >= text["x"] + text["width"], key
        assert drawn["y"] < text["y"] + text["height"], key
    page.close()


def edges(table: Locator) -> tuple[float, float, float]:
    """Brightness of the left edge, the background and the right edge without text: frequent values of columns."""
    with Image.open(BytesIO(table.screenshot())) as picture:
        rows = np.asarray(picture.convert("L"), dtype=np.float64)
    columns = np.median(rows, axis=0)
    return float(columns[:4].min()), float(np.median(columns)), float(columns[-4:].min())


@pytest.mark.parametrize("theme", THEMES)
def test_a_table_wider_than_the_page_indicates_it(browser: Browser, report: ArticleReport, theme: str) -> None:
    page = opened(browser, report, 390, theme)
    wide = narrow = 0
    for table in page.locator("main .scroll").all():
        sizes = table.evaluate("e => [e.scrollWidth, e.clientWidth]")
        left, ground, right = edges(table)
        assert left == pytest.approx(ground, abs=2.0)
        if sizes[0] > sizes[1] + 20:
            assert right < ground - 8.0
            table.evaluate("e => e.scrollTo(e.scrollWidth, 0)")
            left, ground, right = edges(table)
            assert left < ground - 8.0
            assert right == pytest.approx(ground, abs=2.0)
            wide += 1
        elif sizes[0] <= sizes[1]:
            assert right == pytest.approx(ground, abs=2.0)
            narrow += 1
    assert wide >= 4
    assert narrow >= 4
    page.close()


class Element(NamedTuple):
    """An element in the structure of a PDF file: its kind and its pages."""

    kind: str
    pages: frozenset[int]


def structure(text: bytes) -> list[Element]:
    """Headings, figures and tables of a tagged file in reading order."""
    objects = {int(k): body for k, body in re.findall(rb"\n(\d+) 0 obj\n(.*?)\nendobj", text, flags=re.DOTALL)}
    numbers = {page: k for k, page in enumerate(k for k in sorted(objects) if b"/Type /Page\n" in objects[k])}
    elements: list[Element] = []

    def visit(key: int) -> frozenset[int]:
        body = objects[key]
        if b"/StructElem" not in body:
            return frozenset()
        kind = re.search(rb"/S /(\w+)", body)
        assert kind is not None
        place = len(elements)
        on = {numbers[int(page)] for page in re.findall(rb"/Pg (\d+) 0 R", body)}
        kids = re.search(rb"/K (\[.*?\]|\d+ 0 R)", re.sub(rb"<<.*?>>", b"", body[2:]), flags=re.DOTALL)
        for kid in re.findall(rb"(\d+) 0 R", kids[1]) if kids else ():
            on |= visit(int(kid))
        if kind[1] in (b"H2", b"H3", b"Figure", b"TR"):
            elements.insert(place, Element(kind[1].decode(), frozenset(on)))
        return frozenset(on)

    root = re.search(rb"/StructTreeRoot (\d+) 0 R", text)
    assert root is not None
    for kid in re.findall(rb"(\d+) 0 R", objects[int(root[1])].partition(b"/K")[2].partition(b"/Parent")[0]):
        visit(int(kid))
    return elements


@pytest.fixture(scope="module")
def paper(browser: Browser, report: ArticleReport) -> bytes:
    page = opened(browser, report, 1440, "dark")
    text = page.pdf(prefer_css_page_size=True, tagged=True)
    page.close()
    return text


def test_paper_is_a4(paper: bytes) -> None:
    sizes = {tuple(map(float, box.split())) for box in re.findall(rb"/MediaBox \[([^\]]*)\]", paper)}
    ((left, low, right, high),) = sizes
    assert (right - left, high - low) == pytest.approx((210 / 25.4 * 72, 297 / 25.4 * 72), abs=1.0)


def test_headings_are_on_the_page_of_their_content(paper: bytes) -> None:
    """A heading is on the page of the first following drawing or table row; no drawing is split."""
    elements = structure(paper)
    kinds = [element.kind for element in elements]
    assert kinds.count("H3") > 40
    assert kinds.count("Figure") > 60
    over = 0
    for element, after in pairwise(elements):
        if element.kind == "Figure":
            assert len(element.pages) <= 1
        if element.kind == "H3" and after.kind in ("Figure", "TR"):
            assert element.pages == after.pages
            over += 1
    assert over > 35


def lines_of_text(text: bytes) -> list[int]:
    """Number of text pieces on each page."""
    found = re.findall(rb"/Type /Page\n.*?/Contents (\d+) 0 R", text, flags=re.DOTALL)
    counts = []
    for key in found:
        stream = re.search(rb"\n" + key + rb" 0 obj\n<<.*?>> stream\n(.*?)\nendstream", text, flags=re.DOTALL)
        assert stream is not None
        counts.append(len(re.findall(rb"\b(?:Tj|TJ)\b", zlib.decompress(stream[1]))))
    return counts


def test_every_printed_page_has_its_number(browser: Browser, report: ArticleReport, paper: bytes) -> None:
    page = opened(browser, report, 1440, "light")
    page.add_style_tag(content="@page { @bottom-right { content: none; } }")
    without = lines_of_text(page.pdf(prefer_css_page_size=True))
    page.close()
    numbered = lines_of_text(paper)
    assert len(numbered) == len(without) > 15
    assert all(more > fewer for more, fewer in zip(numbered, without, strict=True))

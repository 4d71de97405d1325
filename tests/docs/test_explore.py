"""docs/explore.md in headless Chromium: its script computes the numbers of the library, and its controls work."""

import re
import shutil
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import sagline as sl
from sagline.share.packing import page_script
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended
from tools.pages import explore

DOCS = Path(__file__).parents[2] / "docs"
FLAGS = "--disable-gpu --disable-component-update"
ALL = "given => cable.ready.then(() => given.map(cable.%s))"
NAMES = {
    "length": "unstrained_length",
    "sag": "sag",
    "vertical": "vertical_force",
    "horizontal": "horizontal_tension",
    "frameEnd": "frame_end_tension",
    "platformEnd": "platform_end_tension",
}

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page without its theme."""
    folder = tmp_path_factory.mktemp("site")
    for file in (DOCS / "explore.js", DOCS / "extra.css"):
        shutil.copy(file, folder)
    (folder / "sagline.js").write_text(page_script(), encoding="utf-8")
    head = '<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    made = explore.with_cable((DOCS / "explore.md").read_text(encoding="utf-8"))
    assert f'data-span="{explore.SPAN:g}" data-gravity="{explore.GRAVITY:g}"' in made
    (folder / "explore.html").write_text(f'{head}<link rel="stylesheet" href="extra.css">{made}', encoding="utf-8")
    return folder / "explore.html"


@pytest.fixture
def page(browser: Browser, site: Path) -> Iterator[Page]:
    """The page opened from the disk; it reports no errors and requests only its own three files."""
    complaints: list[str] = []
    asked: list[str] = []
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.set_default_timeout(1e3 * PATIENCE)
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(site.as_uri())
    page.locator("[aria-valuetext]").first.wait_for()  # the script has computed the first numbers
    yield page
    page.close()
    assert complaints == []
    assert asked == [
        site.with_name(name).as_uri() for name in ("explore.html", "extra.css", "sagline.js", "explore.js")
    ]


def grid() -> list[dict[str, float]]:
    """Cables over the ranges of all sliders and beyond, including level ones."""
    rises, densities = (-5.0, -4.0, -0.1, 0.0, 3.0), (1e-4, 0.01, 0.067, 0.5)
    every = product(rises, densities, (5e3, 44e3, 5e6), (20.0, 100.0, 2000.0))
    fixed = {"span": explore.SPAN, "gravity": explore.GRAVITY}
    return [fixed | dict(zip(("rise", "density", "stiffness", "tension"), one, strict=True)) for one in every]


@pytest.mark.parametrize(("function", "model"), [("exact", sl.Catenary()), ("empirical", sl.Empirical())])
def test_the_script_computes_the_numbers_of_the_library(page: Page, function: str, model: sl.CableModel) -> None:
    given = grid()
    found: list[dict[str, Any]] = page.evaluate(ALL % function, given)
    column = {name: np.array([one[name] for one in given]) for name in given[0]}
    cable = sl.Cable(column["density"], column["stiffness"])
    state = model.from_tension(cable, column["span"], column["rise"], column["tension"], explore.GRAVITY)
    for name, field in NAMES.items():
        scale = column["tension"] if name not in ("length", "sag") else column["span"]
        error = np.abs([one[name] for one in found] - getattr(state, field)) / scale
        assert error.max() < 1e-12, name
    middle = state.points(81)[:, 24]
    np.testing.assert_allclose([(one["points"][24]["x"], one["points"][24]["z"]) for one in found], middle, atol=1e-12)
    if function == "empirical":
        assert [one["valid"] for one in found] == list(state.status == sl.CableStatus.SOLVED)


def table(page: Page) -> dict[str, list[str]]:
    rows = page.locator("tr[data-row]").all()
    return {str(row.get_attribute("data-row")): row.locator("td").all_text_contents() for row in rows}


def printed_numbers(slider: Any) -> float:
    return float(slider.get_attribute("aria-valuetext").split()[0].replace("−", "-"))


def test_the_keyboard_moves_sliders_and_all_numbers_change(page: Page) -> None:
    weight, stiffness = page.get_by_label("Weight"), page.get_by_label("Stiffness EA")
    tension, height = page.get_by_label("Tension along the chord"), page.get_by_label("Height of the platform end")
    assert [printed_numbers(each) for each in (weight, stiffness, tension, height)] == [67.0, 44.0, 100.0, -4.0]
    for slider, keys in ((weight, "ArrowRight"), (stiffness, "ArrowLeft"), (tension, "PageDown"), (height, "End")):
        slider.focus()
        page.keyboard.press(keys)
    values = [printed_numbers(each) for each in (weight, stiffness, tension, height)]
    assert values[:2] == [70.4, 40.0]  # a step up is 5 %, a step down 10 %
    assert values[2] < 65.0
    assert values[3] == 3.0
    cable = sl.Cable(1e-3 * values[0], 1e3 * values[1])
    exact, closed = (m.from_tension(cable, 12.0, values[3], values[2]) for m in (sl.Catenary(), sl.Empirical()))
    shown = table(page)
    more = 1e3 * (closed.unstrained_length - exact.unstrained_length)
    assert shown["length"] == [
        f"{exact.unstrained_length:.4f}",
        f"{closed.unstrained_length:.4f}",
        f"{more:+.1f} mm".replace("-", "−"),
    ]
    assert shown["sag"][:2] == [f"{1e3 * exact.sag:.1f}", f"{1e3 * closed.sag:.1f}"]
    assert shown["vertical"][0] == f"{exact.vertical_force:.2f}".replace("-", "−")
    assert shown["frameEnd"][0] == f"{exact.frame_end_tension:.2f}"
    assert shown["platformEnd"][1] == f"{closed.platform_end_tension:.2f}"
    said = page.get_by_role("status").text_content() or ""
    assert f"Exact length {exact.unstrained_length:.3f} m" in said


def test_the_pictures_change(page: Page) -> None:
    pictures = page.locator("svg[data-picture]")
    before = [picture.inner_html() for picture in pictures.all()]
    assert len(before) == 2
    page.get_by_role("button", name="Heavy and slack").click()
    assert all(now.inner_html() != then for now, then in zip(pictures.all(), before, strict=True))
    page.get_by_role("button", name="The article’s cable").click()
    assert [picture.inner_html() for picture in pictures.all()] == before


def test_the_verdicts_of_the_page_on_its_cables(page: Page) -> None:
    """Slack cables that are decimeters too short are out of range, and so are taut cables that are too long by half the
    stretch due to their weight, and level cables.
    """
    note = page.get_by_text("Outside the article’s range")
    assert not note.is_visible()
    page.get_by_role("button", name="Heavy and slack").click()
    assert note.is_visible()
    assert re.search(r"[1-9]\d\d\.\d mm shorter", page.get_by_role("status").text_content() or "")
    page.get_by_role("button", name="The article’s cable").click()
    assert not note.is_visible()
    slider = page.get_by_label("Tension along the chord")
    slider.focus()
    page.keyboard.press("End")
    # the force at the lower end is smaller by half the weight along the slope, which reduces the stretch
    chord, less = 160**0.5, 0.5 * 0.067 * explore.GRAVITY * 4.0 / 44e3
    assert table(page)["length"][2] == f"+{1e3 * chord * less / (1.0 + printed_numbers(slider) / 44e3) ** 2:.1f} mm"
    page.get_by_label("Height of the platform end").fill("0")
    assert note.is_visible()


def test_nothing_is_wider_than_the_screen(page: Page) -> None:
    page.get_by_role("button", name="Heavy and slack").click()
    parts = "[...document.querySelectorAll('.explore, .explore *')]"
    over = f"{parts}.filter(each => each.getBoundingClientRect().right > innerWidth).map(each => each.outerHTML)"
    for width in (320, 390, 820, 1440):
        page.set_viewport_size({"width": width, "height": 800})
        assert page.evaluate(over) == []


def test_without_javascript_there_is_a_picture_and_a_table(browser: Browser, site: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.set_default_timeout(1e3 * PATIENCE)
    page.goto(site.as_uri())
    assert page.get_by_role("slider").count() == 0
    assert page.get_by_text("JavaScript").first.is_visible()
    assert page.locator("[data-still]").locator("path").count() == 2 * len(explore.STANDING)
    state = sl.Catenary().from_tension(sl.Cable(0.067, 44e3), 12.0, -4.0, 30.0)
    assert f"| 30 | {state.unstrained_length:.4f} |" in explore.standing()
    context.close()

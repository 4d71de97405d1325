"""The page without mouse and screen: all controls are reached and named, the verdict is announced, keys move."""

import time
from collections.abc import Iterator
from typing import Literal

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import sagline as sl
from sagline.viewer.features.keyboard import KeyboardFeature
from sagline.viewer.page import Page as ViewerPage
from sagline.viewer.playback import PlayedPlan
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended
from tests.viewer.reach import broken_rules, walked
from tests.viewer.test_browser import BACKGROUND, FLAGS, OVERFLOWING, await_that, least_contrast, opened

SIZES = ((390, 640), (1000, 640), (1440, 900))
FOLDED = "div[data-pressed][aria-expanded=false]:visible"

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def unfold(page: Page) -> None:
    """Open all folders that there are, by keys."""
    while page.locator(FOLDED).count():
        folder = page.locator(FOLDED).first.element_handle()
        folder.focus()
        page.keyboard.press("Enter")
        await_that(page, lambda folder=folder: folder.get_attribute("aria-expanded") == "true")  # type: ignore[misc]


def check(page: Page) -> None:
    """All rules for what is open now, once it is dressed."""
    unfold(page)
    end = time.monotonic() + PATIENCE  # names come onto what is new
    while (broken := broken_rules(page)) and time.monotonic() < end:
        page.wait_for_timeout(200)
    assert broken == {}


def walk(page: Page) -> None:
    """Tab meets every control, and each shows it."""
    stops, unseen, left = walked(page)
    assert left == []
    assert unseen == []
    assert len(stops) > 20


def check_all(page: Page, *, walking: bool) -> None:
    """All rules on every tab; Tab is slow, and pressed on all or on the first alone."""
    names = page.get_by_role("tab").all_inner_texts()
    assert [name for name in names if name != "Control"][:3] == ["Readings", "Modes", "Workspace"]
    for name in names[::-1]:
        page.get_by_role("tab", name=name, exact=True).focus()
        page.keyboard.press("Enter")
        await_that(page, lambda name=name: page.get_by_role("tab", name=name, selected=True).count() == 1)  # type: ignore[misc]
        check(page)
        if walking or name == "Readings":
            walk(page)


def said(page: Page) -> str:
    return page.locator("#sagline-said").inner_text()


def place(viewer: ViewerPage) -> np.ndarray:
    assert viewer.view is not None
    return viewer.view.snapshot.pose.position


def keys_move(page: Page, viewer: ViewerPage) -> None:
    """The platform goes where keys send it, and home; what is said follows; a field keeps its keys."""
    start, step = place(viewer), viewer.feature(KeyboardFeature)._step
    scene = page.get_by_role("application")
    scene.focus()
    for key, way in (
        ("ArrowRight", (1, 0, 0)),
        ("ArrowUp", (1, 1, 0)),
        ("PageUp", (1, 1, 1)),
        ("ArrowLeft", (0, 1, 1)),
    ):
        page.keyboard.press(key)
        await_that(page, lambda way=way: np.allclose(place(viewer), start + step * np.array(way)))  # type: ignore[misc]
    x, y, z = (f"{value:.2f}" for value in place(viewer))
    await_that(page, lambda: said(page).startswith(f"x {x}, y {y}, z {z} m. Feasible, tensions "))
    page.keyboard.press("-")
    page.keyboard.press("ArrowDown")
    await_that(page, lambda: np.allclose(place(viewer), start + step * np.array([0.0, 0.5, 1.0])))
    page.keyboard.press("Shift+ArrowLeft")
    await_that(page, lambda: viewer.view is not None and viewer.view.snapshot.pose.quaternion[2] < -1e-3)
    page.keyboard.press("Home")
    await_that(page, lambda: np.array_equal(place(viewer), start))
    page.keyboard.press("?")
    page.get_by_role("dialog", name="Keys").wait_for()
    assert broken_rules(page) == {}
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="hidden")
    assert page.evaluate("document.activeElement.dataset.engine !== undefined")  # back where it was
    field = page.locator("#sagline-pose")
    field.fill("")
    field.press_sequentially("?0")
    assert field.input_value() == "?0"
    assert page.get_by_role("dialog").count() == 0
    field.press("Escape")


def test_all_controls_are_reached_named_and_announced(browser: Browser) -> None:
    robot = sl.load_robot("article-suspended")
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2))
    run = PlayedPlan(sl.inverse(robot, sl.quintic_path(ends, durations=[2.0], rate=20)))
    with opened(browser, robot, run) as (page, viewer):
        check_all(page, walking=False)
        await_that(page, lambda: said(page).startswith("Feasible, tensions "))
        assert "on 8 cables" in (page.get_by_role("application").get_attribute("aria-label") or "")
        keys_move(page, viewer)
        field = page.locator("#sagline-pose")
        field.fill("7.4, 5.4, 1.5")
        field.press("Enter")
        await_that(page, lambda: "Not feasible, short of " in said(page))  # perhaps with the place keys led to
        page.get_by_role("button", name="Settings of the page").press("Enter")
        page.get_by_text("Reset View").wait_for()
        check(page)
        walk(page)


def test_the_rules_find_violations(browser: Browser) -> None:
    page = browser.new_page()
    page.set_default_timeout(1e3 * PATIENCE)
    page.set_content(
        "<main><button><svg width=9 height=9></svg></button><button>a<svg width=9 height=9></svg></button>"
        "<div role=button>b</div><input><svg width=9 height=9></svg>"
        "<button>c<input aria-label=d></button><p tabindex=0 aria-labelledby=none>e</p>"
        "<input aria-label=f style='outline:0'>"
        "<label>g<input></label><button title=h style='outline:2px solid red'></button>"
        "<div id=i style='height:20px;overflow:auto'><p id=i style='height:99px'>j</p></div></main>"
    )
    broken = broken_rules(page)
    assert {rule: len(found) for rule, found in broken.items()} == {
        "unnamed": 2, "unreached": 1, "nested": 1, "pictures": 2, "dangling": 1, "without a name": 3,
        "scrolling": 1, "twice": 1, "page": 2,
    }  # fmt: skip
    stops, unseen, left = walked(page)
    assert len(stops) == 10  # Chromium also stops at regions that scroll
    assert left == []
    assert any('aria-label="f"' in stop for stop in unseen)
    page.close()


@pytest.mark.soak
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["falcon-7", "cogiro", "fast"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_any_robot_at_any_screen_size(
    browser: Browser, name: str, size: tuple[int, int], theme: Literal["light", "dark"]
) -> None:
    with opened(browser, sl.load_robot(name), width=size[0], theme=theme) as (page, viewer):
        page.set_viewport_size({"width": size[0], "height": size[1]})
        check_all(page, walking=True)
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []
        scene = page.get_by_role("application")
        scene.focus()
        page.keyboard.press("Shift+Tab")
        page.keyboard.press("Tab")
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineColor")
        assert outline != page.evaluate(BACKGROUND)
        start = place(viewer)
        page.keyboard.press("PageUp")
        await_that(page, lambda: bool(place(viewer)[2] > start[2]))

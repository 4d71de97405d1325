"""The timeline in headless Chromium with a real mouse: its values are the data, and a drag moves the robot."""

import re
from collections.abc import Iterator
from typing import Literal

import numpy as np
import pytest
from playwright.sync_api import Browser, FloatRect, Page

import sagline as sl
from sagline.viewer.page import Page as ViewerPage
from sagline.viewer.playback import PlayedPlan
from tests.chromium import NEEDED, launched
from tests.tiers import extended
from tests.viewer.test_browser import FLAGS, OVERFLOWING, SCENE, await_that, box, least_contrast, opened

ROBOTS = ("falcon-7", "cogiro", "fast")
SIZES = ((390, 640), (1000, 640), (1440, 900))
THEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")

STRIP = "#sagline-timeline"

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def run_of(robot: sl.Robot) -> PlayedPlan:
    """From the middle of what the robot is meant for, a bit to the side."""
    box = robot.test_box
    assert box is not None
    middle, aside = 0.5 * (box.low + box.high), np.zeros(3)
    aside[np.argmax(box.high - box.low)] = 0.2 * float(np.max(box.high - box.low))
    return PlayedPlan(
        sl.inverse(robot, sl.quintic_path([tuple(middle), tuple(middle + aside)], durations=[2.0], rate=40))
    )


def at(page: Page, share: float) -> tuple[float, float]:
    """A point in the middle of the timeline's height, at a share of its time."""
    slider = box(page, f"{STRIP} [role=slider]")
    return slider["x"] + share * slider["width"], slider["y"] + 0.5 * slider["height"]


def scrubbed(page: Page, viewer: ViewerPage, run: PlayedPlan) -> None:
    """Point, drag, step and play with mouse and keys."""
    page.mouse.move(*at(page, 0.25))
    tip = page.locator("#sagline-timeline .tip")
    tip.wait_for()
    time = float(re.match(r"([\d.]+) s", tip.inner_text())[1])  # type: ignore[index]
    assert time == pytest.approx(0.5, abs=0.01)
    tensions = run.plan.state.limited_tension[run.index_at(time)]
    told = re.findall(r"(\d+): (-?[\d.]+)", tip.locator(".values").inner_text().replace("\n", " "))
    assert [int(cable) for cable, _ in told] == list(range(tensions.size))
    decimals = len(told[0][1].partition(".")[2])
    unit = 1.0 if decimals == 1 else 1e3
    assert [float(value) for _, value in told] == pytest.approx(tensions / unit, abs=0.5001 * 10.0**-decimals)

    page.mouse.down()
    page.mouse.move(*at(page, 0.6), steps=3)
    page.mouse.move(*at(page, 0.75), steps=3)
    page.mouse.up()

    def shows(sample: int) -> bool:
        assert viewer.view is not None
        return np.array_equal(viewer.view.snapshot.pose.position, run.plan.state.pose.position[sample])

    await_that(page, lambda: shows(60) or shows(59))  # a pixel is less than a sample
    slider = page.get_by_role("slider", name="Time", exact=True)
    slider.focus()
    page.keyboard.press("End")
    await_that(page, lambda: shows(80))
    page.keyboard.press("ArrowLeft")
    await_that(page, lambda: shows(79))
    page.keyboard.press("Home")
    await_that(page, lambda: shows(0))
    await_that(page, lambda: (slider.get_attribute("aria-valuetext") or "").startswith("0.000 s; run, "))
    page.keyboard.press("Space")
    await_that(page, lambda: shows(80))
    page.get_by_role("button", name="Play").wait_for()
    whole = page.get_by_role("button", name="Show the whole time")
    page.mouse.move(*at(page, 0.5))
    page.mouse.wheel(0.0, -300.0)
    whole.wait_for()
    page.mouse.move(*at(page, 0.5), steps=2)
    assert float(re.match(r"([\d.]+) s", tip.inner_text())[1]) == pytest.approx(1.0, abs=0.01)  # type: ignore[index]
    whole.click()
    whole.wait_for(state="hidden")
    assert page.evaluate(OVERFLOWING) == []


def test_the_timeline_shows_values_and_is_scrubbed(browser: Browser) -> None:
    run = run_of(sl.load_robot("falcon-7"))
    with opened(browser, run.robot, run) as (page, viewer):
        scrubbed(page, viewer, run)


@pytest.mark.soak
@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("name", ROBOTS)
def test_the_timeline_on_every_screen(
    browser: Browser, name: str, width: int, height: int, theme: Literal["light", "dark"]
) -> None:
    run = run_of(sl.load_robot(name))
    with opened(browser, run.robot, run, width=width, theme=theme) as (page, viewer):
        page.set_viewport_size({"width": width, "height": height})
        scrubbed(page, viewer, run)

        def over(scene: FloatRect, strip: FloatRect) -> bool:
            return scene["y"] + scene["height"] > strip["y"] + 1.0

        await_that(page, lambda: not over(box(page, SCENE), box(page, STRIP)))  # it has made room below itself
        scene, strip = box(page, SCENE), box(page, STRIP)
        assert strip["width"] == width
        assert strip["y"] + strip["height"] == pytest.approx(height, abs=1.0)
        assert scene["height"] > 180.0
        page.mouse.move(*at(page, 0.5))
        page.locator("#sagline-timeline .tip").wait_for()
        least_contrast(page)
        page.get_by_role("button", name="Fold the timeline").click()
        page.get_by_role("button", name="Unfold the timeline").wait_for()
        assert box(page, STRIP)["height"] < strip["height"]

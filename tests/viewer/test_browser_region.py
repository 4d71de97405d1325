"""The region in headless Chromium with a real mouse: it follows a slider, and its near side is highlighted."""

from collections.abc import Iterator
from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

import sagline as sl
from sagline.viewer.features.region import RegionFeature
from sagline.viewer.page import Page as ViewerPage
from tests.chromium import NEEDED, launched
from tests.tiers import extended
from tests.viewer.test_browser import FLAGS, OVERFLOWING, await_that, least_contrast, opened

SCREENS = ((390, 640), (1000, 640), (1440, 900))
ROBOTS = ("falcon-7", "cogiro", "fast")
FAST = ("cogiro", (1000, 640))

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def in_full(show: RegionFeature) -> bool:
    """True if the drawn region is that of the shown state and not a coarse one."""
    known, rough, _ = show._result
    return not rough and known == show._key


def slide(page: Page, label: str, way: float) -> None:
    """Drag a slider by its thumb, so many pixels, in some steps."""
    thumb = page.locator(f"//label[contains(., '{label}')]/following::div[@role='slider']").first
    thumb.scroll_into_view_if_needed()
    box = thumb.bounding_box()
    assert box is not None
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + way, y, steps=4)
    page.mouse.up()


def scene(page: Page) -> np.ndarray:
    """Scene between the panels, or above them, up to the middle of the screen."""
    picture = np.array(Image.open(BytesIO(page.screenshot())).convert("RGB"), dtype=int)
    height, width, _ = picture.shape
    return picture[: height // 2, width // 3 : 3 * width // 5]


def near_the_wall(viewer: ViewerPage) -> np.ndarray:
    """A position inside, half a cell from the wall, as high as the platform is."""
    show = viewer.feature(RegionFeature)
    assert viewer.view is not None
    assert show._levels is not None
    assert show._region is not None
    home = viewer.view.snapshot.pose.position
    along = np.linspace(0.0, 1.0, 2000)[:, None] * np.ptp([show._region.low, show._region.high], axis=0) * (0.7, 0.5, 0)
    first = int(np.argmax(show._levels(home + along) < 0.0))
    assert first > 3
    return np.asarray((home + along)[first - 3])


@pytest.mark.parametrize(
    ("name", "screen"),
    [
        pytest.param(name, screen, marks=() if (name, screen) == FAST else pytest.mark.soak)
        for name in ROBOTS
        for screen in SCREENS
    ],
)
def test_a_region_follows_a_slider_and_its_near_side_is_highlighted(
    browser: Browser, name: str, screen: tuple[int, int]
) -> None:
    with opened(browser, sl.load_robot(name), width=screen[0], theme="dark") as (page, viewer):
        page.set_viewport_size({"width": screen[0], "height": screen[1]})
        show = viewer.feature(RegionFeature)
        page.get_by_role("tab", name="Workspace").click()
        page.get_by_text("Choose one or several of these.").wait_for()
        empty = scene(page)
        page.get_by_label("Region", exact=True).click()
        page.get_by_text("Boundary by limiting cable").wait_for()
        await_that(page, lambda: in_full(show))
        before, mass = show._result[0], viewer.view.snapshot.robot.mass  # type: ignore[union-attr]
        slide(page, "Platform + load", 8.0)
        await_that(page, lambda: viewer.view is not None and viewer.view.snapshot.robot.mass > mass)
        await_that(page, lambda: in_full(show) and show._result[0] != before)  # nothing was asked for again
        viewer.scene.place(sl.Pose(near_the_wall(viewer), np.eye(3)))
        viewer.refresh()
        await_that(page, lambda: viewer.server.scene.get_handle_by_name("/wall/0") is not None)
        page.get_by_text("left, cable").first.wait_for()
        page.get_by_label("Slice", exact=True).click()
        page.get_by_label("Where can I go", exact=True).click()
        page.get_by_text("Boundary", exact=True).wait_for()
        page.get_by_text("Margin [").wait_for()
        await_that(page, lambda: viewer.server.scene.get_handle_by_name("/slice/levels/0") is not None)
        await_that(page, lambda: np.mean(np.abs(scene(page) - empty).max(axis=2) > 8) > 0.03)  # what is drawn is seen
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []

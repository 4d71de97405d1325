"""Balance of the platform in headless Chromium: the dot by mouse, finger and keys, and infeasible poses."""

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import sagline as sl
from sagline.viewer.features.missing import MissingFeature
from sagline.viewer.page import Page as ViewerPage
from sagline.viewer.snapshot import ByHand, Snapshot
from tests.chromium import NEEDED, launched
from tests.tiers import extended
from tests.viewer.test_browser import FLAGS, OVERFLOWING, await_that, least_contrast, opened

SCREENS = ((390, 640), (1000, 640), (1440, 900))
ROBOTS = ("falcon-7", "cogiro", "fast")
HANDLE = "svg[data-dot] .handle"

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def on_all_screens(*fast: tuple[str, tuple[int, int]]) -> list[object]:
    """Robots and screens; all but a few wait for `make soak`."""
    every = [(name, screen) for name in ROBOTS for screen in SCREENS]
    return [pytest.param(*each, marks=() if each in fast else pytest.mark.soak) for each in every]


def tension(viewer: ViewerPage) -> np.ndarray:
    assert viewer.view is not None
    assert isinstance(viewer.view.snapshot, Snapshot)
    return viewer.view.snapshot.tension


def by_hand(viewer: ViewerPage) -> bool:
    return viewer.view is not None and isinstance(viewer.view.settings.tension, ByHand)


def middle(page: Page) -> tuple[float, float]:
    """Position of the dot on the screen at this moment: the drawing may be replaced at any time."""
    x, y = page.evaluate(
        f"(() => {{ const box = document.querySelector('{HANDLE} .dot').getBoundingClientRect();"
        "return [box.x + box.width / 2, box.y + box.height / 2] })()"
    )
    return float(x), float(y)


def brought_into_sight(page: Page) -> None:
    page.locator(HANDLE).wait_for()
    page.locator(".ways button", has_text="Centroid").wait_for()  # all of it is there: nothing moves any more
    places: list[tuple[float, float]] = []

    def stands() -> bool:
        page.locator(HANDLE).evaluate("each => each.scrollIntoView({ block: 'center' })")
        page.wait_for_timeout(300)
        places.append(middle(page))
        return len(places) > 3 and len(set(places[-4:])) == 1

    await_that(page, stands)


@pytest.mark.parametrize(("name", "screen"), on_all_screens(("falcon-7", (390, 640))))
def test_the_dot_is_dragged_stepped_and_reset(browser: Browser, name: str, screen: tuple[int, int]) -> None:
    with opened(browser, sl.load_robot(name), width=screen[0]) as (page, viewer):
        page.set_viewport_size({"width": screen[0], "height": screen[1]})
        if name == "fast":
            page.get_by_text("the force balance determines the tensions").wait_for()
            return
        brought_into_sight(page)
        given = tension(viewer)
        x, y = middle(page)
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 20.0, y - 5.0)
        page.mouse.move(x + 40.0, y - 10.0)
        await_that(page, lambda: abs(middle(page)[0] - x - 40.0) < 1.5)  # the dot is under the pointer
        page.mouse.move(x + 2000.0, y)  # far out of the field: it stays in it
        await_that(page, lambda: "reached by" in page.inner_text("body"))
        page.mouse.move(x + 40.0, y - 10.0)
        page.mouse.up()
        await_that(page, lambda: abs(middle(page)[0] - x - 40.0) < 1.5)
        assert by_hand(viewer)
        before = tension(viewer)
        page.locator(HANDLE).focus()
        page.keyboard.press("ArrowLeft")
        await_that(page, lambda: not np.array_equal(tension(viewer), before))
        stepped = tension(viewer)
        page.keyboard.press("ArrowLeft")  # the dot has kept the focus
        await_that(page, lambda: not np.array_equal(tension(viewer), stepped))
        assert page.get_by_role("slider", name="Tensions in the set").is_visible()
        page.get_by_text("Chosen by hand", exact=True).first.wait_for()
        assert page.evaluate(OVERFLOWING) == []
        page.get_by_role("button", name="Back to MinimumNorm").click()
        await_that(page, lambda: not by_hand(viewer))
        np.testing.assert_allclose(tension(viewer), given, rtol=1e-9)
        page.locator(".ways button", has_text="AnalyticCenter").click()
        await_that(page, lambda: isinstance(viewer.view.settings.tension, sl.AnalyticCenter))  # type: ignore[union-attr]
        least_contrast(page)


@pytest.mark.soak
@pytest.mark.parametrize("name", ["falcon-7", "cogiro"])
def test_a_finger_drags_the_dot(browser: Browser, name: str) -> None:
    with opened(browser, sl.load_robot(name), width=390) as (page, viewer):
        brought_into_sight(page)
        x, y = middle(page)
        finger = page.context.new_cdp_session(page)
        finger.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
        for kind, away in (("touchStart", 0.0), ("touchMove", 15.0), ("touchMove", 30.0), ("touchMove", 40.0)):
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x + away, "y": y}]})
            page.wait_for_timeout(300)
        await_that(page, lambda: abs(middle(page)[0] - x - 40.0) < 1.5)
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        await_that(page, lambda: by_hand(viewer))


@pytest.mark.soak
@pytest.mark.parametrize(("name", "screen"), on_all_screens())
def test_an_infeasible_pose_leads_to_a_feasible_one(browser: Browser, name: str, screen: tuple[int, int]) -> None:
    robot = sl.load_robot(name)
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    with opened(browser, robot, width=screen[0]) as (page, viewer):
        page.set_viewport_size({"width": screen[0], "height": screen[1]})
        viewer.scene.gizmo.position = 0.5 * (low + high) + np.array([0.42, 0.2, 0.3]) * (high - low)
        viewer.refresh()
        page.get_by_text("Nearest feasible").wait_for()
        page.get_by_role("button", name="Go there").wait_for()
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []
        await_that(page, lambda: not viewer.feature(MissingFeature).waiting)
        page.get_by_role("button", name="Go there").click()
        page.get_by_text("Feasible", exact=True).wait_for()
        page.get_by_text("Nearest feasible").wait_for(state="hidden")


@pytest.mark.soak
@pytest.mark.parametrize(("name", "screen"), on_all_screens())
def test_the_proof_is_shown_and_drawn(browser: Browser, name: str, screen: tuple[int, int]) -> None:
    with opened(browser, sl.load_robot(name), width=screen[0], theme="dark") as (page, viewer):
        page.set_viewport_size({"width": screen[0], "height": screen[1]})
        page.get_by_role("tab", name="Proof").click()
        page.get_by_text("sum to zero up to").wait_for()
        assert page.locator("svg.forces").count() == 2
        assert page.locator("table.forces tr").count() == sl.load_robot(name).cable_count + 3
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []
        page.get_by_label("Forces in the scene").click()
        await_that(page, lambda: "/forces" in viewer.server.scene._handle_from_node_name)

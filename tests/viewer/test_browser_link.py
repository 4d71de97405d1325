"""A pose typed, lines copied and a link followed in headless Chromium."""

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser

import sagline as sl
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended
from tests.viewer.reach import broken_rules
from tests.viewer.test_browser import FEWER_PICTURES, FLAGS, await_that, opened
from tests.viewer.test_state_code import executed

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def test_a_pose_is_typed_and_taken_elsewhere(browser: Browser) -> None:
    with opened(browser, sl.load_robot("falcon-7"), complains=True) as (page, viewer):

        def place() -> np.ndarray:
            assert viewer.view is not None
            return viewer.view.snapshot.pose.position

        field = page.locator("#sagline-pose")
        wanted = viewer.home.position + np.array([0.05, 0.0, 0.02])
        field.fill(", ".join(map(str, wanted)))
        field.press("Enter")
        await_that(page, lambda: np.array_equal(place(), wanted))
        field.fill("1, 2")
        field.press("Enter")
        page.get_by_role("alert").filter(has_text="allowed: three or six numbers").wait_for()
        field.press("Escape")
        await_that(page, lambda: field.input_value().startswith(f"{wanted[0]:.4f}".rstrip("0")))

        page.get_by_role("button", name="Copy as code").press("Enter")
        page.get_by_role("dialog", name="Python code of this state").wait_for()
        names = executed(page.locator("dialog textarea").input_value())
        assert viewer.view is not None
        np.testing.assert_array_equal(names["tension"], viewer.view.snapshot.tension)
        await_that(page, lambda: page.locator("dialog [role=status]").inner_text() != "")
        assert page.evaluate("getSelection().toString() || document.activeElement.selectionEnd") not in ("", 0)
        assert broken_rules(page) == {}
        page.get_by_role("dialog").get_by_role("button", name="Close").press("Enter")

        page.get_by_role("tab", name="Modes").press("Enter")
        page.get_by_role("button", name="Copy link").press("Enter")
        page.get_by_role("dialog", name="Link to this state").wait_for()
        link = page.locator("dialog textarea").input_value()
        assert "&tab=Modes" in link
        page.get_by_role("dialog").get_by_role("button", name="Close").press("Enter")
        page.get_by_role("button", name="Platform back home").press("Enter")
        await_that(page, lambda: np.array_equal(place(), viewer.home.position))

        elsewhere = browser.new_page(viewport={"width": 1000, "height": 640})
        elsewhere.set_default_timeout(1e3 * PATIENCE)
        elsewhere.add_init_script(FEWER_PICTURES)
        elsewhere.goto(link)
        await_that(elsewhere, lambda: np.allclose(place(), wanted, atol=1e-12))
        elsewhere.get_by_role("tab", name="Modes", selected=True).wait_for()
        assert "#" not in elsewhere.url
        elsewhere.evaluate("location.hash = '#robot=fast:12345678&pose=0,0,1'")
        elsewhere.get_by_role("alert").filter(has_text="the link is of 'fast'; allowed: falcon-7").wait_for()
        elsewhere.close()
        assert np.allclose(place(), wanted, atol=1e-12)

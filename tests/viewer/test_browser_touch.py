"""A real mouse pushes the platform, cuts a cable and animates a mode in headless Chromium."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser, Page
from viser._messages import ViewerCameraMessage

import sagline as sl
from sagline.viewer.camera import Camera, fitted
from sagline.viewer.features.cut import CutFeature
from sagline.viewer.features.modes import ModesFeature
from sagline.viewer.features.push import PushFeature
from sagline.viewer.page import Page as ViewerPage
from tests.chromium import NEEDED, launched
from tests.tiers import extended
from tests.viewer.test_browser import FLAGS, OVERFLOWING, SCENE, await_that, box, opened

pytestmark = [extended, NEEDED]
UNCOVERED = """([x, y]) => {
    document.querySelectorAll("[role=alert].mantine-Notification-root button").forEach((each) => each.click())
    return document.elementFromPoint(x, y) instanceof HTMLCanvasElement
}"""
SIZES = ((390, 640), (1000, 640), (1440, 900))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def eye_of(viewer: ViewerPage) -> Camera | None:
    return next((Camera.of(client.camera) for client in viewer.server.get_clients().values()), None)


def on_page(page: Page, viewer: ViewerPage, points: np.ndarray) -> np.ndarray:
    """Positions of points (..., 3) on the page [px], shape (..., 2)."""
    scene, eye = box(page, SCENE), eye_of(viewer)
    assert eye is not None
    share = eye.project(points)[0] / eye.pixels
    return np.asarray([scene["x"], scene["y"]] + share * [scene["width"], scene["height"]])


def settle(page: Page, viewer: ViewerPage, told: list[ViewerCameraMessage]) -> None:
    """Wait until the page reports its camera at the final place, in a scene of the final size."""

    def stands() -> bool:
        if not told:
            return False
        last, scene, framing = told[-1], box(page, SCENE), viewer.framing
        if (last.image_width, last.image_height) != (int(scene["width"]), int(scene["height"])):
            return False
        wanted = fitted(framing._low, framing._high, last.image_width / last.image_height, last.fov)[0]
        return bool(np.linalg.norm(wanted - last.position) < framing._near)

    await_that(page, stands)


def uncovered(page: Page, x: float, y: float) -> None:
    """Close the notices of the browser's client, and wait until nothing is before a place of the scene."""
    await_that(page, lambda: bool(page.evaluate(UNCOVERED, [x, y])))


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("cogiro", SIZES[1]),
        *(
            pytest.param(name, size, marks=pytest.mark.soak)
            for name in ("falcon-7", "cogiro", "fast")
            for size in SIZES
            if (name, size) != ("cogiro", SIZES[1])
        ),
    ],
)
def test_a_mouse_pushes_cuts_and_shakes(browser: Browser, name: str, size: tuple[int, int]) -> None:
    told: list[ViewerCameraMessage] = []
    with opened(browser, sl.load_robot(name), width=size[0], height=size[1], cameras=told) as (page, viewer):
        settle(page, viewer, told)
        start = viewer.scene.dragged_pose()
        eye = eye_of(viewer)
        assert eye is not None
        # pull, at the middle of the platform, where its gizmo has its handles
        middle = start.transform(viewer.feature(PushFeature).body.vertices).mean(axis=0)
        x, y = on_page(page, viewer, middle)
        uncovered(page, x, y)
        page.mouse.move(x, y)
        page.keyboard.down("Control")
        page.mouse.down()
        page.mouse.move(x + 15, y - 10, steps=3)
        await_that(page, lambda: viewer.feature(PushFeature).response is not None)
        page.mouse.move(x + 30, y - 20, steps=3)
        away = 0.9 * np.hypot(30.0, 20.0)
        await_that(page, lambda: pulled(page, viewer) > away)
        page.mouse.up()
        page.keyboard.up("Control")
        await_that(page, lambda: viewer.feature(PushFeature).response is None)
        np.testing.assert_array_equal(viewer.scene.dragged_pose().position, start.position)  # the gizmo did not move
        now = eye_of(viewer)
        assert now is not None
        np.testing.assert_allclose(
            now.place, eye.place, rtol=1e-12
        )  # the camera did not move, except for rounding by pages
        assert page.evaluate(OVERFLOWING) == []
        # cut, by a click on the cable that is farthest from the others
        assert viewer.view is not None
        places = on_page(page, viewer, viewer.view.snapshot.courses(1.0))
        inside = box(page, SCENE)
        x, y = free_place(places, inside["x"], inside["x"] + inside["width"], inside["y"] + inside["height"])
        uncovered(page, x, y)
        page.mouse.click(x, y)
        await_that(page, lambda: viewer.feature(CutFeature)._is_marked)
        page.get_by_role("button", name="Cut cable").click()
        await_that(page, lambda: viewer.player.played is not None and viewer.player.time > 0.5)
        page.get_by_role("heading", name="Simulated").wait_for()
        page.get_by_role("button", name="Undo cut").click()
        await_that(page, lambda: viewer.player.played is None)
        # shake
        page.locator("button.shake").first.click()
        await_that(page, lambda: viewer.feature(ModesFeature).moving)
        swing = viewer.feature(ModesFeature).swing
        assert swing is not None
        assert swing.mode.name == "massless 1"
        page.locator("button.shake").first.click()
        await_that(page, lambda: not viewer.feature(ModesFeature).moving)


def pulled(page: Page, viewer: ViewerPage) -> float:
    """Length of the arrow of the push on the page [px]."""
    found = viewer.feature(PushFeature).response
    if found is None:
        return 0.0
    grabbed = found.state.pose.transform(found.push.at)
    ends = np.stack((grabbed, grabbed + found.push.force / viewer.feature(PushFeature)._stiffness))
    return float(np.linalg.norm(np.diff(on_page(page, viewer, ends), axis=0)))


def free_place(places: np.ndarray, left: float, right: float, low: float) -> tuple[float, float]:
    """A place of a cable (m, P, 2) far from the others, well within the picture."""
    best, found = -1.0, (0.0, 0.0)
    for cable in range(len(places)):
        others = np.delete(places, cable, axis=0).reshape(-1, 2)
        for x, y in places[cable, 6:30]:
            if left + 25 < x < right - 25 and 25 < y < low - 25:
                away = float(np.linalg.norm(others - [x, y], axis=1).min())
                if away > best:
                    best, found = away, (float(x), float(y))
    assert best > 3.0
    return found

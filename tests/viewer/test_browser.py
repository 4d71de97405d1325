"""The page in headless Chromium: it loads, a slider changes it, a run plays, and the console does not complain."""

import os
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath

import numpy as np
import pytest
import trimesh
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, Error, Page, sync_playwright

import sagline as sl
from sagline.viewer.run import Run
from sagline.viewer.server import started, stop
from sagline.viewer.viewer import Viewer

CHROMIUM = shutil.which("chromium")
FLAGS = (
    "--headless --no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
)
PATIENCE = 60.0  # s: the picture is computed without a graphics card

pytestmark = pytest.mark.skipif(CHROMIUM is None and not os.environ.get("CI"), reason="Chromium is not installed")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    assert CHROMIUM is not None, "install Debian's chromium: apt-get install chromium"
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS.split())
        yield chromium
        chromium.close()


@contextmanager
def opened(browser: Browser, robot: sl.Robot, run: Run | None = None) -> Iterator[tuple[Page, Viewer]]:
    """A page on a viewer; whatever the console complains of fails the test."""
    server = started(port=0)
    viewer = Viewer(server, robot, run)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    complaints: list[str] = []

    def hear(message: ConsoleMessage) -> None:
        if message.type == "error":
            complaints.append(message.text)

    def fail(error: Error) -> None:
        complaints.append(str(error))

    page = browser.new_page(viewport={"width": 1000, "height": 640})
    page.set_default_timeout(1e3 * PATIENCE)
    page.on("console", hear)
    page.on("pageerror", fail)
    try:
        page.goto(f"http://127.0.0.1:{server.get_port()}")
        page.get_by_text("Feasible", exact=True).wait_for()
        yield page, viewer
    finally:
        page.close()
        viewer.stop()
        thread.join(timeout=30.0)
        stop(server)
    assert complaints == []


def await_that(page: Page, done: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end, "waited in vain"
        page.wait_for_timeout(50)


def type_in(page: Page, label: str, value: str) -> None:
    """Set a slider by the number beside it."""
    field = page.locator(f"//label[contains(., '{label}')]/following::input[contains(@class, 'NumberInput')]").first
    field.fill(value)
    field.press("Enter")


def test_a_slider_changes_cables_and_numbers(browser: Browser) -> None:
    with opened(browser, sl.load_robot("cogiro")) as (page, viewer):
        assert page.get_by_text("Natural frequencies").is_visible()
        type_in(page, "Cable density", "10")
        await_that(page, lambda: viewer.view is not None and viewer.view.settings.density == 10.0)
        page.get_by_text("650 g/m").wait_for()


def test_a_run_plays_in_the_page(browser: Browser) -> None:
    robot = sl.load_robot("article-suspended")
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2))
    run = Run.of(sl.inverse(robot, sl.quintic_path(ends, durations=[2.0], rate=50), model=sl.Empirical()))
    with opened(browser, robot, run) as (page, viewer):
        page.get_by_role("button", name="Play").click()
        await_that(page, lambda: viewer.view is not None and viewer.view.snapshot.pose.position[0] == 2.0)
        page.get_by_text("2.000, 1.000, 1.500 m").wait_for()
        page.get_by_role("button", name="Play").wait_for()


def test_scene_and_picture_can_be_taken_away(browser: Browser, tmp_path: FilePath) -> None:
    with opened(browser, sl.load_robot("cogiro")) as (page, _):
        page.get_by_text("Take away").click()
        with page.expect_download() as download:
            page.get_by_role("button", name="Scene (GLB)").click()
        download.value.save_as(tmp_path / "scene.glb")
        scene = trimesh.load(tmp_path / "scene.glb")
        assert isinstance(scene, trimesh.Scene)
        assert len(scene.geometry) == 11
        with page.expect_download() as download:
            page.get_by_role("button", name="Picture (PNG)").click()
        download.value.save_as(tmp_path / "picture.png")
        with Image.open(tmp_path / "picture.png") as picture:
            assert np.asarray(picture.convert("L")).std() > 2.0  # not blank

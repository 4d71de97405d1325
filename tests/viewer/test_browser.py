"""The page in headless Chromium: it loads, a slider changes it, a run plays, and the console has no errors."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path as FilePath
from typing import Literal

import numpy as np
import pytest
import trimesh
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, Error, FloatRect, Page
from viser._messages import ViewerCameraMessage

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.features.modes import ModesFeature
from sagline.viewer.page import Page as ViewerPage
from sagline.viewer.playback import PlayedPlan
from sagline.viewer.robot_scene import PLATFORM
from sagline.viewer.server import start_server, stop_server
from tests.calibration.made_up import made_up
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended

FLAGS = (
    "--disable-quic --disable-component-update --disable-sync --use-gl=angle --use-angle=swiftshader "
    "--enable-unsafe-swiftshader --disable-gpu-rasterization"
)
CONTRAST = FilePath(__file__).with_name("contrast.js").read_text()
SCENE = "canvas[data-engine]"
BACKGROUND = "getComputedStyle(document.querySelector('div:has(> div > [data-dock-root])')).backgroundColor"
OVERFLOWING = """() => [...document.querySelectorAll(".sagline, .sagline td, .mantine-NumberInput-input")]
    .filter((each) => each.scrollWidth > each.clientWidth + 1).map((each) => each.outerHTML.slice(0, 200))"""
# what is drawn for no screen, as a picture of surroundings is for its light to be taken from
OFF_SCREEN = """(() => {
    window.offScreen = 0
    const drawn = WebGL2RenderingContext.prototype.drawArrays
    WebGL2RenderingContext.prototype.drawArrays = function (...what) {
        window.offScreen += this.getParameter(this.FRAMEBUFFER_BINDING) !== null
        return drawn.apply(this, what)
    }
})()"""
# ten pictures a second will do: without a graphics card each is work for all cores
FEWER_PICTURES = """(() => {
    window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 100)
    window.cancelAnimationFrame = clearTimeout
})()"""

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


@contextmanager
def opened(
    browser: Browser,
    robot: sl.Robot,
    run: PlayedPlan | None = None,
    *,
    width: int = 1000,
    height: int = 640,
    theme: Literal["light", "dark"] = "light",
    complains: bool = False,
    found: sl.Calibration | None = None,
    cameras: list[ViewerCameraMessage] | None = None,
) -> Iterator[tuple[Page, ViewerPage]]:
    """A page on a viewer; errors of the console fail the test, unless they are expected.

    Messages on its camera are kept on request.
    """
    server = start_server(port=0, title=robot.name)
    if cameras is not None:
        server._websock_server.register_handler(ViewerCameraMessage, lambda _, message: cameras.append(message))
    viewer = ViewerPage(server, FEATURES, robot, run, found=found)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    complaints: list[str] = []

    def hear(message: ConsoleMessage) -> None:
        if message.type == "error":
            complaints.append(message.text)

    def fail(error: Error) -> None:
        complaints.append(str(error))

    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
    page.set_default_timeout(1e3 * PATIENCE)
    page.add_init_script(FEWER_PICTURES)
    page.add_init_script(OFF_SCREEN)
    page.on("console", hear)
    page.on("pageerror", fail)
    try:
        page.goto(server.url)
        page.get_by_text("Feasible", exact=True).wait_for()
        yield page, viewer
    finally:
        page.close()
        viewer.stop()
        thread.join(timeout=PATIENCE)
        stop_server(server)
    assert complains or complaints == []


def await_that(page: Page, done: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end, "waited in vain"
        page.wait_for_timeout(50)


def box(page: Page, selector: str) -> FloatRect:
    """Position of an element on the page."""
    found = page.locator(selector).bounding_box()
    assert found is not None
    return found


def test_a_factor_changes_the_page_and_keys_undo_it(browser: Browser) -> None:
    with opened(browser, sl.load_robot("cogiro")) as (page, viewer):
        assert page.get_by_text("Natural frequencies").is_visible()
        field = page.get_by_role("spinbutton", name="Cable density")
        slider = page.get_by_role("slider", name="Cable density")

        def shows(density: float, place: float) -> bool:
            shown = viewer.view is not None and viewer.view.settings.density == density
            return shown and float(field.input_value()) == density and float(slider.input_value()) == place

        await_that(page, lambda: shows(1.0, 0.5))
        field.fill("25")
        page.evaluate("window.sagline.set('Cable stiffness ×', 2)")  # another value does not replace the typed text
        assert field.input_value() == "25"
        field.press("Enter")
        await_that(page, lambda: shows(10.0, 1.0))
        page.get_by_text("650 g/m").wait_for()
        slider.press("Home")
        await_that(page, lambda: shows(0.1, 0.0))
        slider.press("Control+z")
        await_that(page, lambda: shows(10.0, 1.0) or shows(1.0, 0.5))  # quick changes are one step
        slider.press("Control+Shift+z")
        await_that(page, lambda: shows(0.1, 0.0))
        page.get_by_role("button", name="Reset all").click()
        await_that(page, lambda: shows(1.0, 0.5))


def test_the_platform_is_lit_without_a_picture_of_surroundings(browser: Browser) -> None:
    """A picture of surroundings takes five seconds without a graphics card; without light the platform is black."""
    with opened(browser, sl.load_robot("falcon-7"), width=1300) as (page, _):
        found: list[np.ndarray] = []

        def lit() -> bool:
            with Image.open(BytesIO(page.locator(SCENE).screenshot())) as picture:
                colors = np.asarray(picture.convert("RGB"), dtype=np.float64).reshape(-1, 3)
            blue = colors[(colors[:, 2] > colors[:, 0] + 90.0) & (colors[:, 1] > colors[:, 0] + 40.0)]
            found[:] = [blue]
            return len(blue) > 200

        await_that(page, lit)  # the lighter sides and the darker ones
        assert np.linalg.norm(np.median(found[0], axis=0) - PLATFORM) < 60.0
        page.wait_for_timeout(1000)
        assert page.evaluate("window.offScreen") == 0


def test_a_run_plays_in_the_page(browser: Browser) -> None:
    robot = sl.load_robot("article-suspended")
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2))
    run = PlayedPlan(sl.inverse(robot, sl.quintic_path(ends, durations=[2.0], rate=50), model=sl.Empirical()))
    with opened(browser, robot, run) as (page, viewer):
        page.get_by_role("button", name="Play").click()
        await_that(page, lambda: viewer.view is not None and viewer.view.snapshot.pose.position[0] == 2.0)
        page.get_by_text("2.000, 1.000, 1.500 m").wait_for()
        page.get_by_role("button", name="Play").wait_for()


def test_the_scene_can_be_exported(browser: Browser, tmp_path: FilePath) -> None:
    with opened(browser, sl.load_robot("cogiro")) as (page, _):
        page.get_by_text("Export").click()
        with page.expect_download() as download:
            page.get_by_role("button", name="Scene (GLB)").click()
        download.value.save_as(tmp_path / "scene.glb")
        scene = trimesh.load(tmp_path / "scene.glb")
        assert isinstance(scene, trimesh.Scene)
        assert len(scene.geometry) == 11


def least_contrast(page: Page) -> float:
    """The least contrast of a text on the page with what is behind it; fails with the texts below 4.5 : 1."""
    page.wait_for_timeout(200)
    # what fades in and out has done so, however busy the machine; what turns for ever does not fade
    page.wait_for_function(
        "document.getAnimations().every("
        "(each) => each.playState !== 'running' || each.effect.getTiming().iterations === Infinity)"
    )
    texts = page.evaluate(CONTRAST)
    assert len(texts) > 40
    pale = {(text["words"], round(text["ratio"], 2)) for text in texts if not text["ratio"] >= 4.5}
    assert pale == set()
    return float(min(text["ratio"] for text in texts))


@pytest.mark.parametrize(
    ("theme", "width"),
    [
        ("dark", 390),
        ("light", 1000),
        pytest.param("light", 390, marks=pytest.mark.soak),
        pytest.param("dark", 1000, marks=pytest.mark.soak),
    ],
)
def test_all_text_is_readable(browser: Browser, theme: Literal["light", "dark"], width: int) -> None:
    robot = sl.load_robot("article-mixed")
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2))
    run = PlayedPlan(sl.inverse(robot, sl.quintic_path(ends, durations=[2.0], rate=50), model=sl.Empirical()))
    with opened(browser, robot, run, width=width, theme=theme, complains=True) as (page, viewer):
        assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == theme
        least_contrast(page)
        page.get_by_label("Follow the run").uncheck()
        page.get_by_text("Export").click()
        page.get_by_label("Cable model").first.click()
        page.get_by_text("parabolic").wait_for()
        least_contrast(page)
        page.keyboard.press("Escape")
        viewer.scene.gizmo.position = np.array([7.4, 5.4, 1.5])
        viewer.refresh()
        page.get_by_text("Not feasible", exact=True).wait_for()
        least_contrast(page)
        viewer.scene.gizmo.position = np.array([np.nan, 0.0, 0.0])
        viewer.refresh()
        page.get_by_text("Not possible", exact=True).first.wait_for()  # the modes say so too
        least_contrast(page)
        page.locator(".tabler-icon-adjustments").first.click()
        page.get_by_text("Reset View").wait_for()
        least_contrast(page)
        page.locator(".tabler-icon-arrow-back").first.click()
        stop_server(viewer.server)
        page.get_by_text("Disconnected. Is sagline view still running?").wait_for()
        least_contrast(page)


def test_the_theme_follows_the_system_while_the_page_is_open(browser: Browser) -> None:
    with opened(browser, sl.load_robot("cogiro")) as (page, _):
        assert page.title() == "cogiro – sagline"
        light = page.evaluate(BACKGROUND)
        page.emulate_media(color_scheme="dark")
        await_that(page, lambda: page.evaluate(BACKGROUND) != light)
        least_contrast(page)
        page.emulate_media(color_scheme="light")
        await_that(page, lambda: page.evaluate(BACKGROUND) == light)


@pytest.mark.parametrize("width", [390, pytest.param(699, marks=pytest.mark.soak), 768])
def test_on_small_screens_the_panels_are_a_sheet_below_the_robot(browser: Browser, width: int) -> None:
    with opened(browser, sl.load_robot("falcon-7"), width=width) as (page, _):
        below = '[style*="position: fixed"][style*="width: 20em"]'
        await_that(page, lambda: abs(box(page, SCENE)["height"] - box(page, below)["y"]) < 1.0)  # it has made room
        sheet, scene = box(page, below), box(page, SCENE)
        assert sheet["x"] == 0.0
        assert sheet["width"] == width == scene["width"]
        assert sheet["y"] + sheet["height"] == pytest.approx(640.0, abs=1.0)
        assert scene["height"] > 250.0
        verdict = page.get_by_text("Feasible", exact=True).bounding_box()
        assert verdict is not None
        assert verdict["y"] < 640.0


@pytest.mark.parametrize(
    "name",
    [
        each if each in ("fast", "ipanema-2-pulleys") else pytest.param(each, marks=pytest.mark.soak)
        for each in sl.robot_names()
    ],
)
def test_nothing_overflows_its_panel(browser: Browser, name: str) -> None:
    with opened(browser, sl.load_robot(name)) as (page, _):
        page.get_by_text("Natural frequencies").wait_for()
        assert page.evaluate(OVERFLOWING) == []


def test_a_clicked_frequency_is_animated(browser: Browser) -> None:
    with opened(browser, sl.load_robot("article-suspended")) as (page, viewer):
        page.get_by_role("tab", name="Modes").click()
        page.locator("tr[data-send='mode'][data-value='2']").click()
        await_that(page, lambda: viewer.feature(ModesFeature).moving)
        page.get_by_text("Hz, with cable mass").wait_for()
        swing = viewer.feature(ModesFeature).swing
        assert swing is not None
        found = sl.vibration(swing.state, up_to=20.0)
        page.get_by_text(f"{found.frequency[1]:.3f} Hz, with cable mass", exact=True).wait_for()
        page.get_by_text(f"drawn {swing.factor:.2g} times as large as a vibration of 1 J").wait_for()
        before = page.locator("canvas[data-engine]").screenshot()
        await_that(page, lambda: page.locator("canvas[data-engine]").screenshot() != before)  # without anybody's doing
        await_that(page, lambda: page.locator("tr.chosen").count() == 1)
        mark = page.locator("svg.response g[data-send='mode'][data-value='1'] rect")
        mark.click()
        await_that(
            page,
            lambda: (now := viewer.feature(ModesFeature).swing) is not None and now.mode.name == "1",
        )
        page.locator("tr[data-send='mode'][data-value='massless 1']").hover()
        page.mouse.down()
        page.evaluate("(() => { const list = document.querySelector('.modes'); list.innerHTML += ''; })()")
        page.mouse.up()  # of newly written parts
        page.get_by_text(f"{found.massless_frequency[0]:.3f} Hz, massless").wait_for()
        assert page.evaluate(OVERFLOWING) == []
        page.locator("tr[data-send='mode'][data-value='massless 1']").click()  # once more: at rest
        await_that(page, lambda: not viewer.feature(ModesFeature).moving)


def test_the_modes_are_readable_in_both_themes_on_a_small_screen(browser: Browser) -> None:
    with opened(browser, sl.load_robot("cogiro")) as (page, _):
        page.get_by_role("tab", name="Modes").click()
        page.locator("tr[data-send='mode'][data-value='1']").click()
        page.get_by_text("Hz, with cable mass").wait_for()
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []
        light = page.evaluate(BACKGROUND)
        page.emulate_media(color_scheme="dark")
        await_that(page, lambda: page.evaluate(BACKGROUND) != light)
        page.set_viewport_size({"width": 390, "height": 640})
        page.get_by_role("tab", name="Modes").click()  # in the sheet below
        page.get_by_text("Hz, with cable mass").wait_for()
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []


def test_a_cable_is_cut_and_the_break_is_played(browser: Browser) -> None:
    with opened(browser, sl.load_robot("article-suspended")) as (page, viewer):
        page.get_by_text("Cut a cable").click()
        page.get_by_role("button", name="Cut", exact=True).click()
        page.get_by_role("heading", name="Simulated").wait_for()
        page.get_by_text("break of cable 0 at 0.000 s").wait_for()
        assert viewer.player.played is not None
        await_that(page, lambda: viewer.player.time == viewer.player.played.duration)  # type: ignore[union-attr]
        page.get_by_role("button", name="Play").wait_for()
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []


@pytest.mark.soak
@pytest.mark.parametrize(("theme", "width"), [("dark", 390), ("light", 1000), ("light", 390), ("dark", 1000)])
def test_a_calibration_is_readable_and_its_rows_can_be_clicked(
    browser: Browser, theme: Literal["light", "dark"], width: int
) -> None:
    found = made_up(count=20)
    with opened(browser, found.robot, width=width, theme=theme, found=found) as (page, viewer):
        page.get_by_role("tab", name="Calibration").click()
        page.locator("button[data-send='row'][data-value='17']").click()
        page.get_by_text("Row 17", exact=True).wait_for()
        await_that(
            page,
            lambda: (
                viewer.view is not None and np.allclose(viewer.view.snapshot.pose.position, found.poses.position[17])
            ),
        )
        least_contrast(page)
        assert page.evaluate(OVERFLOWING) == []

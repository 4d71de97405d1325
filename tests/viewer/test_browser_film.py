"""Films and pictures for paper, made by headless Chromium and read again."""

import base64
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

import sagline as sl
from sagline.viewer.features import export
from sagline.viewer.page import home_pose
from sagline.viewer.playback import PlayedPlan
from sagline.viewer.shapes import size_of
from sagline.viewer.tension_scale import TensionScale
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended
from tests.viewer.test_browser import FLAGS, await_that, opened

KEEP_NOTES = """() => {
    window.notes = new Set()
    new MutationObserver(() => {
        const said = document.querySelector("#sagline-film [role=status]")
        if (said) window.notes.add(said.textContent)
    }).observe(document.body, { subtree: true, childList: true, characterData: true })
}"""
PLAY = """async (url) => {
    const video = Object.assign(document.createElement("video"), { muted: true, src: url })
    document.body.append(video)
    await new Promise((loaded, failed) => { video.onloadeddata = loaded; video.onerror = () => failed(video.error) })
    const seek = async (time) => {
        const seen = new Promise((done) => video.requestVideoFrameCallback(done))
        video.currentTime = time
        await seen
    }
    const size = { width: video.videoWidth, height: video.videoHeight }
    const canvas = Object.assign(document.createElement("canvas"), size)
    const pictures = []
    const length = video.duration
    for (const time of [0.2 * length, 0.97 * length]) {
        await seek(time)
        canvas.getContext("2d").drawImage(video, 0, 0)
        pictures.push(canvas.toDataURL("image/png"))
    }
    return { length, pictures }
}"""

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def a_run(name: str) -> PlayedPlan:
    """A run from left to right through the middle of a robot's room."""
    robot = sl.load_robot(name)
    aside = 0.06 * size_of(robot) * np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    return PlayedPlan(sl.inverse(robot, sl.Pose(home_pose(robot).position + aside, np.stack([np.eye(3)] * 3))))


def played(page: Page, file: FilePath) -> tuple[float, list[Any]]:
    """Length [s] of a film, and its first and last picture (h, w, 3)."""
    kind = {".mp4": "video/mp4", ".webm": "video/webm"}[file.suffix]
    found = page.evaluate(PLAY, f"data:{kind};base64,{base64.b64encode(file.read_bytes()).decode()}")
    pictures = [Image.open(BytesIO(base64.b64decode(url.split(",")[1]))) for url in found["pictures"]]
    return found["length"], [np.asarray(picture.convert("RGB"), dtype=float) for picture in pictures]


def bar(picture: Any, scale: TensionScale, tolerance: float) -> tuple[int, int]:
    """Columns at which the bar of the legend begins and ends; its colors are those of the scale."""
    strip = picture[int(0.85 * len(picture)) :]
    bright = strip.max(axis=2) - strip.min(axis=2) > 60.0
    row = int(np.median(np.flatnonzero(bright.sum(axis=1) > 0.1 * bright.shape[1])))
    columns = np.flatnonzero(bright[row])
    left, right = int(columns[0]), int(columns[-1]) + 1
    assert len(columns) == right - left
    shares = np.linspace(0.05, 0.95, 10)
    wanted = scale.colors(scale.low * (scale.high / scale.low) ** shares).astype(float)
    seen = strip[row, np.rint(left + shares * (right - left)).astype(int)]
    assert np.abs(seen - wanted).max() < tolerance
    return left, right


def platform_column(picture: Any) -> float:
    """Mean column of the platform, the only dark object with little color in which red exceeds blue."""
    scene = picture[:970]
    dull = (scene.max(axis=2) < 170.0) & (scene.max(axis=2) - scene.min(axis=2) < 60.0)
    return float(np.argwhere(dull & (scene[..., 0] - scene[..., 2] > 15.0))[:, 1].mean())


ROBOTS = ("falcon-7", "cogiro", "fast")
MATRIX = [
    ("article-suspended", 1000),
    *(pytest.param(name, width, marks=pytest.mark.soak) for name in ROBOTS for width in (390, 1000, 1440)),
]


@pytest.mark.parametrize(("name", "width"), MATRIX)
def test_a_film_shows_the_run_with_clock_and_legend(
    browser: Browser, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch, name: str, width: int
) -> None:
    run = a_run(name)
    with opened(browser, run.robot, run, width=width) as (page, viewer):
        page.get_by_text("Export").click()
        page.evaluate(KEEP_NOTES)
        film_button = page.get_by_role("button", name="Film of the run")
        film_button.click()
        page.get_by_role("button", name="Cancel").click()
        page.locator("#sagline-film").wait_for(state="detached")
        (client,) = viewer.server.get_clients().values()
        await_that(page, lambda: not client.scene._handle_from_node_name)
        monkeypatch.setattr(export, "RATE", 0.5)  # two pictures, which end before a test could cancel them
        with page.expect_download(timeout=1e3 * PATIENCE) as download:
            film_button.click()
        assert download.value.suggested_filename == f"{name}-run.mp4"
        download.value.save_as(tmp_path / "film.mp4")
        page.locator("#sagline-film").wait_for(state="detached")
        assert any(note.startswith("Recording") for note in page.evaluate("[...window.notes]"))
        assert viewer.player.following
        assert not client.scene._handle_from_node_name
        length, (first, last) = played(page, tmp_path / "film.mp4")
    assert length == pytest.approx(4.0, abs=1e-3)  # two pictures, each for two seconds, however long they took
    assert first.shape == last.shape == (1080, 1920, 3)
    left, right = bar(last, TensionScale.of(run.robot), 24.0)
    assert 0 < left < right < 1920
    strip = np.abs(last[976:] - first[976:]).max(axis=2) > 64.0
    assert strip[:, right + 20 :].any()  # the clock
    assert not strip[:, : right + 20].any()
    assert platform_column(last) - platform_column(first) > 10.0  # it goes to the right


def test_a_picture_after_a_canceled_film_does_not_end_the_connection(browser: Browser) -> None:
    robot = sl.load_robot("article-suspended")
    with opened(browser, robot) as (page, viewer):
        (client,) = viewer.server.get_clients().values()
        picture = client.get_render(1080, 1920, transport_format="png")  # no film keeps it: 100 kB as a message
        assert picture.shape[:2] == (1, 1)
        assert list(viewer.server.get_clients().values()) == [client]
        assert page.locator("#sagline-film").count() == 0


@pytest.mark.soak
def test_a_browser_without_an_encoder_records_the_film_in_real_time(
    browser: Browser, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "RATE", 0.5)
    run = a_run("article-suspended")
    with opened(browser, run.robot, run) as (page, _):
        page.evaluate("delete window.VideoEncoder")  # as over plain HTTP
        page.get_by_text("Export").click()
        with page.expect_download(timeout=1e3 * PATIENCE) as download:
            page.get_by_role("button", name="Film of the run").click()
        file = tmp_path / download.value.suggested_filename
        download.value.save_as(file)
        length, (first, last) = played(page, file)
    assert length > 2.0  # the last picture is shown for a moment only
    assert first.shape == last.shape == (1080, 1920, 3)
    assert np.abs(last[976:, 1500:] - first[976:, 1500:]).max() > 64.0  # the clock


def test_a_picture_has_the_size_of_paper_without_gizmo_and_names(browser: Browser, tmp_path: FilePath) -> None:
    robot = sl.load_robot("article-suspended")
    with opened(browser, robot, width=1200) as (page, _):
        page.get_by_text("Export").click()
        screen = np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB"), dtype=float)
        with page.expect_download(timeout=1e3 * PATIENCE) as download:
            page.get_by_role("button", name="Picture (PNG)").click()
        download.value.save_as(tmp_path / "picture.png")
    assert download.value.suggested_filename == "article-suspended.png"
    with Image.open(tmp_path / "picture.png") as image:
        assert image.size[0] == 2100  # 3.5 in
        assert image.info["dpi"] == pytest.approx((600.0, 600.0), abs=0.01)
        picture = np.asarray(image.convert("RGB"), dtype=float)
    left, right = bar(picture, TensionScale.of(robot), 3.0)
    assert 0.3 * 2100 < left < right < 2100
    scene = picture[: int(0.75 * len(picture))]
    purple = (scene[..., 0] > scene[..., 1] + 60.0) & (scene[..., 2] > scene[..., 1] + 60.0)
    assert purple.mean() > 1e-3  # cables
    assert not of_gizmo(scene).any()
    assert of_gizmo(screen).any()


def of_gizmo(picture: Any) -> Any:
    """Position of the green of the gizmo axis in a picture, which no other part has."""
    red, green, blue = np.moveaxis(picture, 2, 0)
    return (green > 150.0) & (green > red + 60.0) & (green > blue + 40.0)

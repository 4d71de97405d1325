"""Pictures of docs/images: `python -m tools.pages.images [NAME ...]` draws them, the pages in Chromium.

Each file contains a description of what it shows: the texts of the page in their order, or the plotted numbers. A test
compares the description with the present page. The names end with `-dark` for the dark theme.
"""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image, PngImagePlugin

import sagline as sl
from tools.pages.scene import draw_robot, drawn_cables

if TYPE_CHECKING:
    from playwright.sync_api import Browser
    from playwright.sync_api import Page as Tab

    from sagline.viewer.page import Page
    from sagline.viewer.server import PageServer

ROOT: Final = Path(__file__).parents[2]
FOLDER: Final = ROOT / "docs" / "images"
KEY: Final = "shows"  # name of the description in a PNG file
FLAGS: Final = (
    *("--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--use-gl=angle"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-rasterization"),
)
PATIENCE: Final = 240e3  # longest wait for a page [ms]
WIDE, PHONE = (1200, 760), (390, 720)  # sizes of the viewer [px]
SHARED: Final = 560, 700  # size of the shared page [px]; the panel is below the robot
STAGE: Final = 300  # height of the robot in the film [px]
FILM, RATE, QUALITY = 10.0, 10, 55  # duration of the film [s], pictures per second, quality of WebP
TEXTS: Final = re.compile(r'"([A-Z][a-z][^"\n]*)"')  # texts in the scripts of the viewer
SILENT: Final = ("script", "style", "noscript")
CURSOR: Final = """() => {
    const dot = document.body.appendChild(document.createElement("div"))
    dot.style = "position:fixed;width:14px;height:14px;border-radius:50%;background:#e8942ecc;border:2px solid #fff;"
        + "pointer-events:none;z-index:9;transform:translate(-50%,-50%)"
    addEventListener("pointermove", ({ clientX, clientY }) => {
        dot.style.left = clientX + "px"
        dot.style.top = clientY + "px"
    }, true)
}"""
NEXT: Final = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
# stations of the dragged platform in the film [m]; between them it moves smoothly, and it stops at each
STATIONS: Final = ((0, 0, 3), (-4, -1, 1.6), (-4, -1, 5.7), (3.5, 1.5, 4.2), (3.5, 1.5, 1.0), (0, 0, 3))


class _Texts(HTMLParser):
    """Texts and labels of an HTML page, in their order."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in SILENT:
            self._open.append(tag)
        elif not self._open:
            self.found += [value for name, value in attrs if name in ("aria-label", "type") and value]

    def handle_endtag(self, tag: str) -> None:
        if tag in self._open:
            self._open.remove(tag)

    def handle_data(self, data: str) -> None:
        if data.strip() and not self._open:
            self.found.append(" ".join(data.split()))


def shared_robot() -> dict[str, Any]:
    """Description of the shared page of a robot."""
    texts = _Texts()
    texts.feed(shared_html())
    return {"stations": STATIONS, "texts": texts.found}


def shared_html() -> str:
    """Shared page of the robot of the film."""
    from sagline.share.page import robot_page

    return robot_page(sl.load_robot("article-mixed"))


def viewer_of_pose(server: PageServer) -> Page:
    """Viewer of a robot whose lower cables sag visibly."""
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page

    return Page(server, FEATURES, sl.load_robot("article-mixed"), pose=sl.Pose((1.2, 1.0, 2.5)))


def viewer_of_run(server: PageServer) -> Page:
    """Viewer of the article's run, planned with the article's model."""
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page
    from sagline.viewer.playback import PlayedPlan

    plan = sl.inverse(sl.load_robot("article-suspended"), sl.article_path(), sl.Empirical())
    return Page(server, FEATURES, plan.state.one_robot, PlayedPlan(plan))


def viewer_of_calibration(server: PageServer) -> Page:
    """Viewer of the calibration of an example."""
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page

    examples = ROOT / "examples"
    found = sl.calibrate(sl.load_robot(examples / "winches_robot.yaml"), sl.load_log(examples / "winches.csv"))
    return Page(server, FEATURES, found.robot, found=found)


def viewer_texts(make: Callable[[PageServer], Page]) -> dict[str, Any]:
    """Description of a viewer: the controls and titles in their order, and the texts of the scripts of its page."""
    from sagline.viewer.server import start_server, stop_server

    server = start_server(port=0)
    try:
        make(server)
        gui: Any = server.gui  # viser has no public list of its controls
        controls, places = gui._gui_input_handle_from_uuid.values(), gui._container_handle_from_uuid.values()
        parts = sorted((*controls, *(each for each in places if hasattr(each, "order"))), key=lambda each: each.order)
        tabs = [each._label for each in places if hasattr(each, "_label")]
        labels = [(type(each).__name__, each.label) for each in parts]
    finally:
        stop_server(server)
    scripts = sorted(files("sagline.viewer").joinpath("browser").iterdir(), key=lambda file: file.name)
    texts = {
        file.name: TEXTS.findall(file.read_text(encoding="utf-8")) for file in scripts if file.name.endswith(".js")
    }
    return {"controls": labels, "tabs": tabs, "texts": texts}


def position_errors() -> tuple[sl.Confirmation, sl.Confirmation]:
    """Confirmed runs of `sagline run`, planned with the article's model."""
    method = sl.MinimumNorm("horizontal")
    first, second = (
        sl.confirm(sl.inverse(sl.load_robot(robot), sl.article_path(), sl.Empirical(), method, stability=False))
        for robot in ("article-suspended", "article-mixed")
    )
    return first, second


def plotted_errors() -> dict[str, Any]:
    """Description of the figure of the position errors: values at some times [mm]."""
    return {
        proof.plan.state.one_robot.name: (1e3 * proof.position_error[::500]).round(2).tolist()
        for proof in position_errors()
    }


def draw_errors() -> dict[str, bytes]:
    """The figure of the position errors."""
    file = ROOT / "build" / "position-error.png"
    sl.plot.save(sl.plot.errors(*position_errors()), file)
    return {file.name: file.read_bytes()}


@contextmanager
def chromium() -> Iterator[Browser]:
    """Debian's Chromium without a screen."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=list(FLAGS), timeout=PATIENCE
        )
        yield browser
        browser.close()


def tab_of(browser: Browser, size: tuple[int, int], theme: str) -> Tab:
    """An empty page of a size in a theme."""
    scheme: Any = theme
    tab = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
    tab.set_default_timeout(PATIENCE)
    return tab


def take_viewer(
    title: str, make: Callable[[PageServer], Page], act: Callable[[Tab], None], *shots: tuple[str, str, tuple[int, int]]
) -> dict[str, bytes]:
    """Pictures of a viewer with a title after some actions on its page; for each the file, the theme and the size."""
    from sagline.viewer.server import start_server, stop_server

    taken = {}
    with chromium() as browser:
        for name, theme, size in shots:
            server = start_server(port=0, title=title)
            page = make(server)
            thread = threading.Thread(target=page.serve)
            thread.start()
            tab = tab_of(browser, size, theme)
            try:
                tab.goto(server.url)
                tab.get_by_text("Feasible", exact=True).first.wait_for(state="attached")
                tab.get_by_role("button", name="Close this note").click()  # viser warns of a slow computer
                tab.wait_for_timeout(4000)
                act(tab)
                tab.wait_for_timeout(3000)
                taken[name] = with_table(tab.screenshot())
            finally:
                tab.close()
                page.stop()
                thread.join()
                stop_server(server)
    return taken


def with_table(png: bytes) -> bytes:
    """A PNG picture with a table of colors, a quarter of the size."""
    buffer = io.BytesIO()
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def play(tab: Tab) -> None:
    """Move the clock of a run, and show the values at another time where the page is wide."""
    slider = tab.locator("#sagline-timeline [role=slider]").bounding_box()
    assert slider is not None
    high = slider["y"] + 0.4 * slider["height"]  # between the curves, which are emphasized under the pointer
    tab.mouse.click(slider["x"] + 0.62 * slider["width"], high)
    if slider["width"] > PHONE[0]:
        tab.mouse.move(slider["x"] + 0.36 * slider["width"], high)
    else:
        tab.mouse.move(5, 5)


def show_calibration(tab: Tab) -> None:
    """Show the tab of the calibration with a row of the log."""
    tab.get_by_role("tab", name="Calibration").click()


def film_shared() -> dict[str, bytes]:
    """Films of a platform that is dragged on a shared page, in both themes."""
    file = ROOT / "build" / "film.html"
    file.parent.mkdir(exist_ok=True)
    file.write_text(shared_html(), encoding="utf-8")
    with chromium() as browser:
        return {
            f"drag{suffix}.webp": film(browser, file, theme) for theme, suffix in (("light", ""), ("dark", "-dark"))
        }


def film(browser: Browser, file: Path, theme: str) -> bytes:
    """Film of a shared page in a theme."""
    tab = tab_of(browser, SHARED, theme)
    tab.goto(file.as_uri())
    style = f".controls, .hint, .home {{ display: none !important }} main {{ grid-template-rows: {STAGE}px auto }}"
    tab.add_style_tag(content=style + " .stage { height: " + f"{STAGE}px" + " }")
    tab.evaluate(CURSOR)
    tab.get_by_text("Feasible", exact=True).first.wait_for()
    tab.evaluate("document.querySelector('[data-part=home]').click()")  # the whole robot, in the new height
    tab.mouse.move(SHARED[0] / 2, STAGE - 20)
    tab.mouse.wheel(0, 110)  # and the numbers of the upper anchors
    tab.wait_for_timeout(1500)
    bottom = tab.locator("[data-part=ticks]").bounding_box()
    assert bottom is not None
    clip: Any = {"x": 0, "y": 0, "width": SHARED[0], "height": round(bottom["y"] + bottom["height"] + 4)}
    pictures = []
    for k, place in enumerate(places()):
        tab.mouse.move(*tab.evaluate("async (place) => { const it = await share.ready; " + SEEN + " }", place))
        if k == 0:
            tab.mouse.down()
        tab.evaluate(NEXT)
        pictures.append(Image.open(io.BytesIO(tab.screenshot(clip=clip))).convert("RGB"))
    tab.close()
    buffer = io.BytesIO()
    pictures[0].save(
        buffer, "WEBP", save_all=True, append_images=pictures[1:], duration=round(1e3 / RATE), loop=0,
        quality=QUALITY, method=6, minimize_size=True,
    )  # fmt: skip
    return buffer.getvalue()


# center of the platform at a place, on the page [px]
SEEN: Final = """
    const { x, y } = it.view.seen(place), { width, height } = document.querySelector("canvas").getBoundingClientRect();
    return [x * width, y * height];
"""


def places() -> Iterator[list[float]]:
    """Places of the platform in the film, one per picture [m]."""
    per = round(FILM * RATE / (len(STATIONS) - 1))
    for a, b in pairwise(np.array(STATIONS, dtype=np.float64)):
        for share in np.linspace(0.0, 1.0, per, endpoint=False):
            yield (a + (b - a) * share**2 * (3.0 - 2.0 * share)).tolist()


GROUPS: Final[dict[str, tuple[list[str], Callable[[], dict[str, Any]], Callable[[], dict[str, bytes]]]]] = {
    # name -> files, their description, their drawing
    "drag": (["drag.webp", "drag-dark.webp"], shared_robot, film_shared),
    "mujoco": (["mujoco.png"], drawn_cables, draw_robot),
    "position-error": (["position-error.png"], plotted_errors, draw_errors),
    "viewer": (
        ["viewer.png"],
        lambda: viewer_texts(viewer_of_pose),
        lambda: take_viewer("article-mixed", viewer_of_pose, lambda _: None, ("viewer.png", "light", WIDE)),
    ),
    "viewer-run": (
        ["viewer-run.png", "viewer-run-dark.png", "viewer-run-phone.png", "viewer-run-phone-dark.png"],
        lambda: viewer_texts(viewer_of_run),
        lambda: take_viewer(
            "article-suspended",
            viewer_of_run,
            play,
            ("viewer-run.png", "light", WIDE),
            ("viewer-run-dark.png", "dark", WIDE),
            ("viewer-run-phone.png", "light", PHONE),
            ("viewer-run-phone-dark.png", "dark", PHONE),
        ),
    ),
    "viewer-calibration": (
        ["viewer-calibration.png"],
        lambda: viewer_texts(viewer_of_calibration),
        lambda: take_viewer(
            "hall-winches", viewer_of_calibration, show_calibration, ("viewer-calibration.png", "light", WIDE)
        ),
    ),
}  # fmt: skip


def described(content: bytes, description: dict[str, Any]) -> bytes:
    """A picture with its description; the pixels do not change."""
    if content[:4] == b"RIFF":
        return _with_chunk(content, json.dumps(description).encode())
    text, buffer = PngImagePlugin.PngInfo(), io.BytesIO()
    text.add_text(KEY, json.dumps(description), zip=True)
    Image.open(io.BytesIO(content)).save(buffer, "PNG", pnginfo=text, optimize=True)
    return buffer.getvalue()


def _with_chunk(webp: bytes, data: bytes) -> bytes:
    """A WebP film with data in a chunk of metadata (XMP), which the flags of its header announce."""
    assert webp[12:16] == b"VP8X"
    flags = bytes([webp[20] | 0b100])
    chunk = b"XMP " + len(data).to_bytes(4, "little") + data + b"\0" * (len(data) % 2)
    body = webp[8:20] + flags + webp[21:] + chunk
    return b"RIFF" + len(body).to_bytes(4, "little") + body


def description_of(file: Path) -> Any:
    """The description in a file of a picture."""
    with Image.open(file) as picture:
        text = picture.info.get("xmp") if file.suffix == ".webp" else picture.info.get(KEY)
    return json.loads(text) if text else None


def main(names: list[str]) -> None:
    """Draw the named groups of pictures, or all."""
    os.environ.setdefault("MUJOCO_GL", "egl")  # the renderer of MuJoCo needs no window
    for name in names or GROUPS:
        _, describe, draw = GROUPS[name]
        description = describe()
        for file, content in draw().items():
            (FOLDER / file).write_bytes(described(content, description))
            print(f"{FOLDER / file}: {(FOLDER / file).stat().st_size / 1e3:.0f} kB", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

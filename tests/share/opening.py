"""Pages in headless Chromium, opened from the disk, without errors and external requests."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from playwright.sync_api import Browser, Page

from tests.chromium import PATIENCE

FLAGS = (
    "--disable-component-update --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--disable-gpu-rasterization"
)


@contextmanager
def opened(
    browser: Browser,
    file: Path,
    *,
    width: int = 1000,
    height: int = 640,
    theme: Literal["light", "dark"] = "light",
    touch: bool = False,
) -> Iterator[Page]:
    """A page after its start."""
    complaints: list[str] = []
    asked: list[str] = []
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=theme, has_touch=touch, offline=True
    )
    page = context.new_page()
    page.set_default_timeout(1e3 * PATIENCE)
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(file.as_uri())
    asking(page, "null")
    yield page
    context.close()
    assert complaints == []
    assert asked == [file.as_uri()]


def asking(page: Page, what: str, *given: Any) -> Any:
    """Answer of a page after its start; `it` is the value with which `share.ready` resolves."""
    return page.evaluate(f"async (given) => {{ const it = await share.ready; return {what}; }}", *given)

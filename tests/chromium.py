"""Debian's Chromium without a screen, for tests that look at pages."""

import os
import shutil
from collections.abc import Iterator
from typing import Final

import pytest
from playwright.sync_api import Browser, sync_playwright

CHROMIUM: Final = shutil.which("chromium")
NEEDED: Final = pytest.mark.skipif(CHROMIUM is None and not os.environ.get("CI"), reason="Chromium is not installed")
QUIET: Final = "--headless --no-sandbox --no-first-run --disable-background-networking"  # asks nobody for anything


def launched(flags: str) -> Iterator[Browser]:
    """A browser for as long as a fixture lasts.

    Args:
        flags: Of the command line, beside those of `QUIET`.
    """
    assert CHROMIUM is not None, "install Debian's chromium: apt-get install chromium"
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=[*QUIET.split(), *flags.split()])
        yield chromium
        chromium.close()

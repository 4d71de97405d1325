"""Debian's Chromium without a screen, for tests of pages."""

import os
import shutil
from collections.abc import Iterator
from typing import Final

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

CHROMIUM: Final = shutil.which("chromium")
NEEDED: Final = pytest.mark.skipif(CHROMIUM is None and not os.environ.get("CI"), reason="Chromium is not installed")
PATIENCE: Final = 240.0  # s: a wide limit, because pictures are computed without a graphics card
QUIET: Final = "--headless --no-sandbox --no-first-run --disable-background-networking"  # no requests to other hosts

expect.set_options(timeout=1e3 * PATIENCE)


def launched(flags: str) -> Iterator[Browser]:
    """A browser for the duration of a fixture.

    Args:
        flags: Flags of the command line in addition to `QUIET`.
    """
    assert CHROMIUM is not None, "install Debian's chromium: apt-get install chromium"
    with sync_playwright() as playwright:
        words = [*QUIET.split(), *flags.split()]
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=words, timeout=1e3 * PATIENCE)
        yield chromium
        chromium.close()

"""Background work gives priority to drawing."""

import os
import sys
from collections.abc import Callable
from queue import Queue

import pytest

from sagline.viewer.feature import NICENESS, BackgroundTask
from tests.viewer.client import PATIENCE


def test_background_work_gives_priority_to_drawing() -> None:
    before, soon, found = os.nice(0), Queue[Callable[[], None]](), list[int]()
    BackgroundTask(soon.put).start(lambda: os.nice(0), found.append, pytest.fail)
    soon.get(timeout=PATIENCE)()
    assert found == [min(before + NICENESS, 19) if sys.platform == "linux" else before]
    assert os.nice(0) == before

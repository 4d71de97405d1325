"""Code of sagline that runs in the serving thread for one message of a drag, and the readings after it."""

import sys
from collections.abc import Iterator
from functools import partial
from types import CodeType, FrameType
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.feature import Feature, View
from sagline.viewer.features import FEATURES
from sagline.viewer.page import SOON, Page
from sagline.viewer.robot_scene import RobotScene
from tests.viewer.client import Client, await_that
from tests.viewer.shown import Shown, shown

ROBOT = sl.load_robot("cogiro")
MESSAGES = 40
WARM_UP = 10  # first messages, which create nodes and import modules
DRAWN = 29, 145  # files and functions of a message that only moves the drawing; the goal is 30 and 150
COMPLETE = 60, 320  # of a message with readings and features, with room for further features


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT))


def place(k: int) -> list[float]:
    return [0.3 * np.sin(0.1 * k), 0.3 * np.cos(0.13 * k), 2.0 + 0.1 * np.sin(0.07 * k)]


def drag(page: Shown, client: Client, messages: range) -> None:
    """Drag the platform, one message after another is drawn."""
    for k in messages:
        before = page.viewer.updates
        client.drag(place(k))
        await_that(partial(lambda seen: page.viewer.updates > seen, before))


class Follower(Feature):
    """A feature that draws at the position of the platform, and depends only on this position."""

    live = True

    def __init__(self, _: Page) -> None:
        self.heights: list[float] = []

    def depends(self, view: View) -> tuple[float, ...]:
        return tuple(view.snapshot.pose.position.tolist())

    def follow(self, view: View) -> None:
        self.heights.append(float(view.snapshot.pose.position[2]))


def test_a_live_feature_with_a_key_of_its_own_follows_each_message(monkeypatch: pytest.MonkeyPatch) -> None:
    served = shown(lambda server: Page(server, (Follower,), ROBOT))
    page = next(served)
    with Client(page.url) as client:
        client.grab()
        drag(page, client, range(2))
        monkeypatch.setattr("sagline.viewer.page.SOON", 1e3)  # other features and readings do not follow
        drag(page, client, range(2, WARM_UP))
    assert page.viewer.feature(Follower).heights[-4:] == [place(k)[2] for k in range(WARM_UP - 4, WARM_UP)]
    next(served, None)  # stops the page


@pytest.mark.parametrize(("wait", "most"), [(1e3, DRAWN), (0.0, COMPLETE)])
def test_a_message_of_a_drag_runs_little_code(
    page: Shown, monkeypatch: pytest.MonkeyPatch, wait: float, most: tuple[int, int]
) -> None:
    """Readings follow never, or after each message. Comprehensions count as parts of their functions."""
    messages: list[set[CodeType]] = [set()]

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or "sagline" not in code.co_filename or code.co_name.startswith("<"):
            return
        if code is RobotScene.show.__code__:  # once a message
            messages.append(set())
        messages[-1].add(code)

    with Client(page.url) as client:
        client.grab()
        drag(page, client, range(WARM_UP))
        monkeypatch.setattr("sagline.viewer.page.SOON", wait)
        page.viewer.later(lambda: sys.setprofile(note))
        drag(page, client, range(WARM_UP, MESSAGES))
        page.viewer.later(lambda: sys.setprofile(None))
        await_that(lambda: not page.viewer._tasks)
    assert max(len({code.co_filename for code in codes}) for codes in messages[2:-1]) <= most[0]
    assert max(map(len, messages[2:-1])) <= most[1]


def test_readings_and_features_follow_the_last_message(page: Shown) -> None:
    with Client(page.url) as client:
        client.grab()
        list(client.heard(2.0 * SOON))
        for k in range(MESSAGES):
            client.drag(place(k))
        x, y, z = place(MESSAGES - 1)
        await_that(lambda: f"{x:.3f}, {y:.3f}, {z:.3f} m" in page.text)
        await_that(lambda: page.told("spoken")["place"] == f"x {x:.2f}, y {y:.2f}, z {z:.2f} m")
        await_that(lambda: page.position.tolist() == [x, y, z])

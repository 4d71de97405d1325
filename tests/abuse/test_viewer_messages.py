"""Invalid messages of a page to the viewer: it keeps running and serves the next client."""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import viser

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page
from sagline.viewer.playback import PlayedPlan
from sagline.viewer.server import start_server, stop_server
from tests.tiers import extended
from tests.viewer.client import PATIENCE, Client

pytestmark = extended

ROBOT = sl.load_robot("article-suspended")
BATCH = 20  # number of invalid messages between two valid ones
AGAIN = 5.0  # s after which the client repeats its request
ODD: tuple[Any, ...] = (
    None, True, "", "nonsense", "50", "1e308", float("nan"), float("inf"), -1.0, 0.0, 1e308, -1e-320, 2**62, [], [1, 2],
    [[1.0]], {}, {"value": 1.0}, b"\x00\xff", "x" * 10_000, [float("nan")] * 3, [0.0] * 4, ["a", "b", "c"], [None] * 3,
    [1e308] * 3, [1e-320] * 4, [1.0, 0.0, 0.0, 0.0], "MinimumNorm", "straight", "Closest (depends on history)",
)  # fmt: skip


def message(generator: np.random.Generator, uuids: list[str]) -> dict[str, Any]:
    """A message of a kind that clients send, with invalid values."""

    def odd() -> Any:
        return ODD[generator.integers(len(ODD))]

    kind = generator.integers(5)
    if kind == 0:
        return {
            "type": "TransformControlsUpdateMessage",
            "name": "/platform",
            "owner": "",
            "position": odd(),
            "wxyz": odd(),
        }
    if kind == 1:
        place = generator.uniform(-8.0, 8.0, 3).tolist()
        return {
            "type": "TransformControlsUpdateMessage",
            "name": "/platform",
            "owner": "",
            "position": place,
            "wxyz": odd(),
        }
    if kind == 2:
        lens = {name: odd() for name in ("fov", "near", "far", "image_height", "image_width")}
        eye = {name: odd() for name in ("wxyz", "position", "look_at", "up_direction")}
        return {"type": "ViewerCameraMessage", **eye, **lens}
    uuid = uuids[generator.integers(len(uuids))]
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": odd()}}


def press(count: int, seed: int) -> None:
    """Send a number of invalid messages, and check between them that the next client is served."""
    generator = np.random.default_rng(seed)
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [1.0, 0.0, 1.5]]), np.stack([np.eye(3)] * 2))
    run = PlayedPlan(sl.inverse(ROBOT, sl.quintic_path(ends, durations=[1.0], rate=20)))
    server = start_server(port=0)
    viewer = Page(server, FEATURES, ROBOT, run)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    try:
        while viewer.view is None:
            assert thread.is_alive()
            time.sleep(0.01)
        handles = server.gui._gui_input_handle_from_uuid.items()
        usual = {uuid: each.value for uuid, each in handles if not isinstance(each, viser.GuiButtonHandle)}
        for _ in range(0, count, BATCH):
            for _ in range(BATCH):
                with Client(server.url) as bad:  # the server ends some connections
                    bad.say(**message(generator, list(usual)))
            time.sleep(0.2)  # the valid message is processed
            assert thread.is_alive()
            place = generator.uniform([-2.0, -2.0, 1.0], [2.0, 2.0, 2.5])
            with Client(server.url) as good:
                expected = sl.inverse(ROBOT, sl.Pose(place, np.eye(3)), tension=sl.MinimumNorm()).chord_tension
                end = time.monotonic() + PATIENCE
                while not shows(viewer, place, expected):  # a busy machine may process earlier messages later
                    assert time.monotonic() < end, "not served"
                    for uuid, value in usual.items():
                        good.set(uuid, value)
                    good.grab()
                    good.drag(place)
                    await_that(lambda place=place, expected=expected: shows(viewer, place, expected))  # type: ignore[misc]
    finally:
        viewer.stop()
        thread.join(timeout=PATIENCE)
        stop_server(server)


def shows(viewer: Page, place: np.ndarray, tension: np.ndarray) -> bool:
    if viewer.view is None or not np.array_equal(viewer.view.snapshot.pose.position, place):
        return False
    return np.allclose(viewer.view.snapshot.tension, tension, rtol=1e-9)


def await_that(done: Callable[[], bool]) -> None:
    """Wait for the condition, at most for the time after which the request is repeated."""
    end = time.monotonic() + AGAIN
    while not done() and time.monotonic() < end:
        time.sleep(0.01)


def test_the_viewer_survives_invalid_messages(capfd: pytest.CaptureFixture[str]) -> None:
    press(200, seed=20)
    assert "Traceback" not in "".join(capfd.readouterr())


@pytest.mark.soak
def test_the_viewer_survives_thousands_of_invalid_messages(capfd: pytest.CaptureFixture[str]) -> None:
    press(4000, seed=21)
    assert "Traceback" not in "".join(capfd.readouterr())

"""Keys that move the platform, as a page sends them, and what is said of it."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.viewer.keys_show import MOST, TURN, nudged
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import taken_at
from sagline.viewer.spoken import place_of, spoken
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.view import View
from sagline.viewer.viewer import Viewer
from tests.viewer.client import Client, await_that
from tests.viewer.test_viewer import Shown, handle, shown

ROBOT = sl.load_robot("cogiro")


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Viewer(server, ROBOT))


def tell(page: Shown, topic: str, value: Any, count: int = 0) -> None:
    with Client(page.port) as client:
        text = json.dumps({"topic": topic, "value": value, "count": count})
        client.set(handle(page, "sagline")._impl.uuid, text)
        client.replayed()  # who has not heard all takes ten seconds to leave


def there(page: Shown, position: Any, quaternion: Any) -> bool:
    assert page.viewer.view is not None
    pose = page.viewer.view.snapshot.pose
    return np.allclose(pose.position, position, atol=1e-9) and np.allclose(pose.quaternion, quaternion, atol=1e-9)


def test_steps_go_along_and_turn_about_the_axes_and_home(page: Shown) -> None:
    home = page.viewer._home
    tell(page, "nudge", [1, -2, 0.5, 0, 0, 0])
    await_that(lambda: there(page, home.position + 0.1 * np.array([1.0, -2.0, 0.5]), home.quaternion))
    tell(page, "nudge", [0, 0, 0, 3, 0, 0], 1)
    turned = Rotation.from_euler("Z", 3.0, degrees=True)
    await_that(lambda: there(page, home.position + 0.1 * np.array([1.0, -2.0, 0.5]), turned.as_quat()))
    tell(page, "home", 0)
    await_that(lambda: there(page, home.position, home.quaternion))


NONSENSE: tuple[Any, ...] = (
    None,
    3,
    [],
    [1] * 5,
    [1] * 7,
    ["1"] * 6,
    [MOST * 2] + [0] * 5,
    [10**400] + [0] * 5,
    [[1]] * 6,
    {"x": 1},
    [None] * 6,
    "nudge",
)


def test_steps_that_are_none_and_ways_out_of_sight_move_nothing(page: Shown) -> None:
    tell(page, "home", 0)
    await_that(lambda: there(page, page.viewer._home.position, page.viewer._home.quaternion))
    for count, value in enumerate(NONSENSE):
        tell(page, "nudge", value, count)
    tell(page, "nudge", [1e400, 0, 0, 0, 0, 0])
    heard: list[Any] = []
    page.viewer._channel.on("done", lambda value, _: heard.append(value))
    tell(page, "done", 1)
    await_that(lambda: bool(heard))
    assert there(page, page.viewer._home.position, page.viewer._home.quaternion)
    with Client(page.port) as client:
        for count in range(30):
            text = json.dumps({"topic": "nudge", "value": [MOST, 0, 0, 0, 0, 0], "count": count})
            client.set(handle(page, "sagline")._impl.uuid, text)
        told = page.viewer._channel._told
        await_that(lambda: "nudge-told" in told and "out of sight" in str(told["nudge-told"].content))
    await_that(lambda: 50.0 < page.position[0] < 100.0)
    assert page.thread.is_alive()


def test_turns_are_about_the_axes_of_the_world() -> None:
    pose = sl.Pose.from_euler([1.0, 2.0, 3.0], 0.4, 0.0, 0.0)
    for axis in range(3):
        turn = TURN * np.eye(3)[axis]
        found = nudged(pose, np.zeros(3), turn)
        np.testing.assert_allclose(found.matrix, Rotation.from_rotvec(turn).as_matrix() @ pose.matrix, atol=1e-14)
    np.testing.assert_array_equal(nudged(pose, np.zeros(3), np.zeros(3)).quaternion, pose.quaternion)


def said(pose: sl.Pose) -> Any:
    set_to = Settings(ROBOT.mass)
    snapshot = taken_at(ROBOT, pose, set_to, None)
    return spoken(View(snapshot, set_to, TensionScale.of(ROBOT), False))


def test_the_verdict_is_a_sentence() -> None:
    pose = sl.Pose.from_euler([0.1, -0.0, 2.6], np.radians(10.0), 0.0, 0.0)
    tension = sl.inverse(ROBOT, pose, tension=sl.MinimumNorm()).chord_tension
    found = said(pose)
    assert found.text == f"Feasible, tensions {tension.min():.0f} to {tension.max():.0f} N"
    assert found.place == "x 0.10, y 0.00, z 2.60 m, turned 10, 0, 0 degrees about z, y, x"
    beyond = said(sl.Pose([7.4, 5.0, 2.6], np.eye(3)))
    assert beyond.head == "Not feasible"
    assert beyond.text.startswith("Not feasible, no force alone would do; at their limits: cables 0, ")
    assert place_of(sl.Pose([-0.001, 0.0, 1.0], np.eye(3))) == "x 0.00, y 0.00, z 1.00 m"

"""Keys that move the platform, as a page sends them, and the announcements."""

import json
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.viewer.feature import View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.keyboard import MOST, TURN, nudged, place_of, screen_reader_text
from sagline.viewer.page import Page, home_pose
from sagline.viewer.snapshot import Settings, snapshot_at
from sagline.viewer.tension_scale import TensionScale
from tests.tiers import extended
from tests.viewer.client import Client, await_that
from tests.viewer.shown import Shown, handle, shown

ROBOT = sl.load_robot("cogiro")


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT))


def tell(page: Shown, topic: str, value: Any, count: int = 0) -> None:
    with Client(page.url) as client:
        text = json.dumps({"topic": topic, "value": value, "count": count})
        client.set(handle(page, "sagline"), text)
        client.replayed()  # who has not heard all takes ten seconds to leave


def there(page: Shown, position: Any, quaternion: Any) -> bool:
    assert page.viewer.view is not None
    pose = page.viewer.view.snapshot.pose
    return np.allclose(pose.position, position, atol=1e-9) and np.allclose(pose.quaternion, quaternion, atol=1e-9)


def test_keys_translate_rotate_and_move_home(page: Shown) -> None:
    home = home_pose(ROBOT)
    place = home.position + 0.1 * np.array([1.0, -2.0, 0.5])
    tell(page, "nudge", [1, -2, 0.5, 0, 0, 0])
    await_that(lambda: not there(page, home.position, home.quaternion))
    assert there(page, place, home.quaternion)
    tell(page, "nudge", [0, 0, 0, 3, 0, 0], 1)
    await_that(lambda: not there(page, place, home.quaternion))
    assert there(page, place, Rotation.from_euler("Z", 3.0, degrees=True).as_quat())
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


@extended
def test_invalid_steps_and_distant_poses_are_ignored(page: Shown) -> None:
    home = home_pose(ROBOT)
    tell(page, "home", 0)
    await_that(lambda: there(page, home.position, home.quaternion))
    for count, value in enumerate(NONSENSE):
        tell(page, "nudge", value, count)
    tell(page, "nudge", [1e400, 0, 0, 0, 0, 0])
    tell(page, "nudge", [0, 0, 1, 0, 0, 0], 99)  # a step that is one
    await_that(lambda: not there(page, home.position, home.quaternion))
    assert there(page, home.position + np.array([0.0, 0.0, 0.1]), home.quaternion)
    with Client(page.url) as client:
        for count in range(30):
            text = json.dumps({"topic": "nudge", "value": [MOST, 0, 0, 0, 0, 0], "count": count})
            client.set(handle(page, "sagline"), text)
        await_that(lambda: "out of sight" in str(page.told("nudge-reply")))
    await_that(lambda: 50.0 < page.position[0] < 100.0)
    assert page.thread.is_alive()


def test_rotations_are_about_the_axes_of_the_world() -> None:
    pose = sl.Pose.from_euler([1.0, 2.0, 3.0], 0.4, 0.0, 0.0)
    for axis in range(3):
        turn = TURN * np.eye(3)[axis]
        found = nudged(pose, np.zeros(3), turn)
        np.testing.assert_allclose(found.matrix, Rotation.from_rotvec(turn).as_matrix() @ pose.matrix, atol=1e-14)
    np.testing.assert_array_equal(nudged(pose, np.zeros(3), np.zeros(3)).quaternion, pose.quaternion)


def said(pose: sl.Pose) -> Any:
    set_to = Settings(ROBOT.mass)
    snapshot = snapshot_at(ROBOT, pose, set_to, None)
    return screen_reader_text(View(snapshot, set_to, TensionScale.of(ROBOT), False))


def test_the_verdict_is_a_sentence() -> None:
    pose = sl.Pose.from_euler([0.1, -0.0, 2.6], np.radians(10.0), 0.0, 0.0)
    tension = sl.inverse(ROBOT, pose, tension=sl.MinimumNorm()).chord_tension
    found = said(pose)
    assert found["head"] == "Feasible"
    assert found["text"].startswith(found["head"])
    assert re.findall(r"[\d.]+|N$", found["text"]) == [f"{tension.min():.0f}", f"{tension.max():.0f}", "N"]
    place, _, turn = found["place"].partition(" m, ")
    assert place == "x 0.10, y 0.00, z 2.60"
    assert re.findall(r"\d+|\b[xyz]\b", turn) == ["10", "0", "0", "z", "y", "x"]
    beyond = said(sl.Pose([7.4, 5.0, 2.6], np.eye(3)))
    assert beyond["head"] == "Not feasible"
    assert beyond["text"].startswith(beyond["head"])
    assert "cables 0, " in beyond["text"]
    assert place_of(sl.Pose([-0.001, 0.0, 1.0], np.eye(3))) == "x 0.00, y 0.00, z 1.00 m"

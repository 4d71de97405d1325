"""A push with the mouse, sent by a client without a browser."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from viser import CameraHandle

import sagline as sl
from sagline.viewer import shapes
from sagline.viewer.camera import Camera
from sagline.viewer.features import FEATURES
from sagline.viewer.features.push import FAR, Push, PushFeature, PushResponse
from sagline.viewer.page import Page
from sagline.viewer.server import NAME
from tests.tiers import extended, wide
from tests.viewer.client import Client, await_that
from tests.viewer.shown import ROBOT, Shown, framed, handle, shown

POSE = sl.Pose([0.5, 0.5, 1.5], np.eye(3))
WIDE, HIGH, FOV = 800, 600, 1.0
BODY = shapes.Solid.platform(ROBOT)
STIFFNESS = np.sqrt(25.0 * 2000.0) / (FAR * shapes.size_of(ROBOT))  # N/m, of the limits of the tensions


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT, pose=POSE))


def look(client: Client, page: Shown) -> CameraHandle:
    """Stand ten meters before the platform, which is in the middle of the picture; the camera that does so."""
    seen = framed(client, page)
    turned = [float(np.sqrt(0.5)), -float(np.sqrt(0.5)), 0.0, 0.0]
    camera: dict[str, Any] = {"wxyz": turned, "position": [0.5, -9.5, 1.5], "look_at": [0.5, 0.5, 1.5]}
    lens = {"fov": FOV, "near": 0.1, "far": client.far, "image_height": HIGH, "image_width": WIDE}
    client.say(type="ViewerCameraMessage", up_direction=[0, 0, 1], **camera, **lens)

    def stands() -> bool:
        eye = Camera.of(seen)
        return eye is not None and eye.place[1] == -9.5

    await_that(stands)
    return seen


def push_of(page: Shown) -> PushResponse | None:
    """State of the push."""
    return page.viewer.feature(PushFeature).response


def tell(client: Client, page: Shown, topic: str, value: Any) -> None:
    client.set(handle(page, NAME), json.dumps({"topic": topic, "value": value}))


def pull(client: Client, page: Shown, phase: str, x: float, y: float, *, keep: bool = False) -> None:
    tell(client, page, "pull", {"phase": phase, "at": [x, y], "keep": keep})


def test_a_push_is_proportional_to_the_distance_and_ends(page: Shown) -> None:
    with Client(page.url) as client:
        look(client, page)
        pull(client, page, "start", 0.5, 0.5)
        pull(client, page, "move", 0.55, 0.42)
        await_that(lambda: push_of(page) is not None)
        found = push_of(page)
        assert found is not None
        grabbed = POSE.transform(found.push.at)
        assert grabbed[[0, 2]] == pytest.approx([0.5, 1.5], abs=1e-12)  # in the middle of the picture
        assert grabbed[1] == pytest.approx(0.5 + BODY.vertices[:, 1].min(), abs=1e-12)  # in front
        # 0.05 of the picture's width, and 0.08 of its height, that far away from the eye
        high = 2.0 * np.tan(0.5 * FOV) * (grabbed[1] + 9.5)
        wanted = STIFFNESS * np.array([0.05 * high * WIDE / HIGH, 0.0, 0.08 * high])
        np.testing.assert_allclose(found.push.force, wanted, atol=1e-9 * float(np.linalg.norm(wanted)))
        assert handle(page, "Force [N]").value == pytest.approx(np.linalg.norm(wanted), rel=1e-12)
        np.testing.assert_allclose(page.node("/push").points[0, 0], grabbed, atol=1e-5)
        np.testing.assert_allclose(page.node("/push").points[0, 1], grabbed + wanted / STIFFNESS, atol=1e-5)
        assert found.loaded is not None
        assert page.node("/pushed").visible
        np.testing.assert_allclose(page.node("/pushed").position, found.loaded.pose.position, atol=1e-6)
        assert page.node("/push_tip").text.startswith(f"{np.linalg.norm(wanted):.1f} N: moves")
        assert np.array_equal(page.position, POSE.position)  # the gizmo is not used
        pull(client, page, "end", 0.55, 0.42)
        await_that(lambda: push_of(page) is None)
        assert not page.node("/pushed").visible
        assert not page.node("/push").visible
        assert handle(page, "Force [N]").value == 0.0


@extended
def test_a_kept_push_is_released_by_the_button(page: Shown) -> None:
    show = page.viewer.feature(PushFeature)
    with Client(page.url) as client:
        look(client, page)
        pull(client, page, "start", 0.5, 0.5)
        pull(client, page, "end", 0.5, 0.4, keep=True)
        await_that(lambda: push_of(page) is not None and show.hold is None)
        client.drag([0.7, 0.5, 1.5])  # it stays where it acts, and is answered at the new place
        await_that(lambda: (now := push_of(page)) is not None and now.state.pose.position[0] == 0.7)
        client.set(handle(page, "Release"), True)
        await_that(lambda: push_of(page) is None)
        client.drag(POSE.position)
        await_that(lambda: np.array_equal(page.position, POSE.position))
        client.set(handle(page, "Keep after release"), True)
        pull(client, page, "start", 0.5, 0.5)
        pull(client, page, "end", 0.5, 0.4)
        await_that(lambda: push_of(page) is not None and show.hold is None)
        client.set(handle(page, "Keep after release"), False)
        pull(client, page, "start", 0.5, 0.5)
        pull(client, page, "cancel", 0.5, 0.4)
        await_that(lambda: push_of(page) is None)


def test_points_behind_the_camera_are_not_pushed(page: Shown) -> None:
    show = page.viewer.feature(PushFeature)
    part = POSE.transform(BODY.vertices[BODY.faces[0]].mean(axis=0))
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # looks along y
    for away, held in ((5.0, False), (-5.0, True)):
        eye = Camera(part + away * axes[:, 2], axes, np.array([0.4, 0.3]), np.array([WIDE, HIGH], dtype=np.float64))
        await_that(lambda: page.viewer.state is not None)
        show._grab(eye, np.array([0.5, 0.5]), -1)  # no client whose end would release it
        assert (show.hold is not None) == held
    show.hold = None


def pushes(push: Push, at: list[float], force: list[float]) -> bool:
    return np.array_equal(push.at, at) and np.allclose(push.force, force, rtol=0.0, atol=1e-12)


@extended
def test_a_force_can_be_typed(page: Shown) -> None:
    with Client(page.url) as client:
        look(client, page)
        client.set(handle(page, "Force [N]"), 25.0)
        client.set(handle(page, "Along x, y, z"), [0.0, 3.0, -4.0])
        client.set(handle(page, "At x, y, z [m]"), [0.0, 0.1, 0.2])
        place, force = [0.0, 0.1, 0.2], [0.0, 15.0, -20.0]
        await_that(lambda: (now := push_of(page)) is not None and pushes(now.push, place, force))
        found = push_of(page)
        assert found is not None
        told = page.text
        assert "25.0 N" in told
        again = PushResponse.of(found.state, found.push)
        np.testing.assert_array_equal(again.displacement, found.displacement)
        client.set(handle(page, "Along x, y, z"), [0.0, 0.0, 0.0])
        await_that(lambda: "Not possible" in page.text and push_of(page) is None)
        client.set(handle(page, "Along x, y, z"), [0.0, 0.0, -1.0])
        client.set(handle(page, "Force [N]"), 0.0)
        await_that(lambda: "Ctrl-drag" in page.text)


@extended
def test_a_closed_client_ends_its_push(page: Shown) -> None:
    with Client(page.url) as client:
        look(client, page)
        pull(client, page, "start", 0.5, 0.5)
        pull(client, page, "move", 0.6, 0.5)
        await_that(lambda: push_of(page) is not None)
    await_that(lambda: push_of(page) is None)


@pytest.mark.parametrize(
    "value",
    wide(
        [
            {"phase": "start", "at": [0.01, 0.01]},  # beside the platform
            None,
            7,
            "start",
            [],
            {"phase": "start"},
            {"phase": "start", "at": 3},
            {"phase": "start", "at": [0.5]},
            {"phase": "start", "at": ["a", "b"]},
            {"phase": "start", "at": [1e308, 10**400]},
            {"phase": "move", "at": [0.5, 0.5]},
            {"phase": ["end"], "at": [0.5, 0.5]},
        ]
    ),
)
def test_invalid_pushes_are_ignored(page: Shown, value: Any) -> None:
    show = page.viewer.feature(PushFeature)
    with Client(page.url) as client:
        look(client, page)
        before = page.viewer.updates
        tell(client, page, "pull", value)
        await_that(lambda: page.viewer.updates > before)
        assert show.hold is None
        assert push_of(page) is None

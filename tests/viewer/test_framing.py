"""Positions of the camera."""

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import shapes
from sagline.viewer.camera import BORDER, FIELD, Framing, fitted
from sagline.viewer.page import Page
from sagline.viewer.server import start_server, stop_server
from tests.tiers import extended, wide
from tests.viewer.client import Client, await_that
from tests.viewer.shown import ROBOT, Shown, put, shown
from tests.viewer.test_push_show import POSE, look


def seen(points: np.ndarray, camera: np.ndarray, target: np.ndarray, aspect: float, field: float) -> np.ndarray:
    """Positions of points in the picture, -1 to 1 inside it: perspective of OpenGL, column by column."""
    ahead = (target - camera) / np.linalg.norm(target - camera)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    view = (points - camera) @ np.stack((right, np.cross(right, ahead), ahead), axis=1)
    return np.asarray(view[:, :2] / view[:, 2:] / np.tan(0.5 * field) / [aspect, 1.0])


@pytest.mark.parametrize("aspect", [0.4, 0.7, 1.0, 1.6, 3.0])
@pytest.mark.parametrize("name", wide(sl.robot_names(), 4))
def test_every_robot_fills_the_picture(name: str, aspect: float) -> None:
    low, high = shapes.bounds(sl.load_robot(name))
    camera, target = fitted(low, high, aspect)
    middle = 0.5 * (low + high)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    places = seen(middle + BORDER * (corners - middle), camera, target, aspect, FIELD)
    assert np.abs(places).max() <= 1.0 + 1e-6
    assert np.abs(places).max() > 0.9
    assert places.max(axis=0) == pytest.approx(-places.min(axis=0), abs=1e-6)  # in the middle


def at(camera: Any, position: Any) -> bool:
    return bool(np.allclose(camera.position, position, rtol=1e-6))


@extended
def test_the_robot_stays_in_the_picture_until_the_camera_is_moved() -> None:
    low, high = np.array([-5.0, -4.0, 0.0]), np.array([5.0, 4.0, 6.0])
    server = start_server(port=0)
    try:
        Framing(server, low, high)
        with Client(server.url) as client:
            await_that(lambda: len(server.get_clients()) == 1)
            camera = next(iter(server.get_clients().values())).camera
            wide = fitted(low, high, 800 / 600, 1.0)
            await_that(lambda: at(camera, wide[0]))

            def look(position: Any, width: int) -> None:
                client.look(position=position, look_at=wide[1], width=width)
                await_that(lambda: camera.image_width == width)

            narrow = fitted(low, high, 300 / 600, 1.0)[0]
            look(wide[0], 300)
            await_that(lambda: at(camera, narrow))
            own = narrow + np.array([0.0, 3.0, 1.0])
            look(own, 300)
            look(own, 800)
            time.sleep(0.2)
            assert at(camera, own)
            look([np.nan] * 3, 400)  # invalid data have no effect
            look(narrow, 401)
            await_that(lambda: at(camera, fitted(low, high, 401 / 600, 1.0)[0]))
    finally:
        stop_server(server)


def test_a_camera_set_by_a_link_is_kept() -> None:
    low, high = np.zeros(3), np.ones(3)
    server = start_server(port=0)
    try:
        framing = Framing(server, low, high)
        with Client(server.url) as client:
            camera = put(client, server, framing)
            number, own = camera.client.client_id, np.array(camera.position)
            framing.look(number, np.array([3.0, 4.0, 5.0, 0.5, 0.5, 0.5]))
            assert at(camera, [3.0, 4.0, 5.0])
            client.look(own, [0.5, 0.5, 0.5], width=300)  # sent before it has heard of that
            await_that(lambda: camera.image_width == 300)
            framing._follow(camera)  # as a thread of viser does, now or soon
            framing.look(number, np.array([6.0, 4.0, 5.0, 0.5, 0.5, 0.5]))  # the last word
            aimed: list[Any] = []
            for message in client.heard():
                if message["type"] == "SetCameraPositionMessage":
                    aimed.append(message["position"])
                    if np.allclose(aimed[-1], [6.0, 4.0, 5.0]):
                        break
            fit = fitted(low, high, 300 / 600, 1.0)[0]
            assert not any(np.allclose(place, fit) for place in aimed)
    finally:
        stop_server(server)


@extended
def test_an_automatic_camera_motion_is_not_a_manual_one() -> None:
    server = start_server(port=0)
    try:
        framing = Framing(server, np.zeros(3), np.ones(3))
        with Client(server.url) as client, ThreadPoolExecutor(1) as other:
            camera = put(client, server, framing)
            number = camera.client.client_id
            client.look([9.0, 8.0, 7.0], [0.5, 0.5, 0.5], width=300)
            await_that(lambda: framing.moved(number) is not None)
            with framing._lock:  # as while the box is fitted
                asked = other.submit(framing.moved, number)
                time.sleep(0.2)
                camera.position = np.array([3.0, 4.0, 5.0])
                framing._places[number].append(np.array([3.0, 4.0, 5.0]))
            assert asked.result() is None
    finally:
        stop_server(server)


@pytest.fixture
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, (), ROBOT, pose=POSE))


def test_a_camera_follows_a_jump_of_the_platform_and_no_drag(page: Shown) -> None:
    with Client(page.url) as client:
        camera = look(client, page)
        for x, expected in ((1.0, 0.5), (9.0, 8.5), (0.5, 0.0)):  # near, out of sight, and back
            page.viewer.later(lambda x=x: page.viewer.go(sl.Pose([x, 0.5, 1.5], np.eye(3))))  # type: ignore[misc]
            await_that(lambda x=x: page.position[0] == x)  # type: ignore[misc]
            assert camera.position[0] == expected
        assert np.array(camera.position) - camera.look_at == pytest.approx([0.0, -10.0, 0.0])
        client.drag([9.0, 0.5, 1.5])
        await_that(lambda: page.position[0] == 9.0)
        assert camera.position[0] == 0.0

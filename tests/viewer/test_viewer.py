"""The viewer with clients that drag, change controls, close and send invalid messages."""

from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from html import unescape
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page
from sagline.viewer.robot_scene import RobotScene
from sagline.viewer.server import start_server, stop_server
from sagline.viewer.snapshot import Snapshot, method_name
from tests.effort import best_rate
from tests.refusal import refused
from tests.tiers import extended, wide
from tests.viewer.client import PATIENCE, Client, await_that, clients
from tests.viewer.shown import PATH, ROBOT, Shown, a_run, handle, shown, tell, updates_a_second


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT))


@pytest.fixture
def film() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT, a_run()))


def test_the_viewer_listens_on_the_loopback_address_only(page: Shown) -> None:
    assert page.server.get_host() == "127.0.0.1"
    assert page.server.request_share_url() is None


def test_a_port_in_use_is_reported(page: Shown) -> None:
    port = page.server.get_port()
    with refused(f"port {port}", "in use on 127.0.0.1", kind=sl.InvalidValueError):
        start_server(port=port)
    with refused("203.0.113.7:0", kind=sl.InvalidValueError):
        start_server(host="203.0.113.7", port=0)
    with refused("port", "70000", "0 to 65535", kind=sl.InvalidValueError):
        start_server(port=70000)


def test_the_gizmo_moves_to_a_set_pose() -> None:
    server = start_server(port=0)
    try:
        pose = sl.Pose.from_euler([1.0, 0.5, 2.0], 0.3, -0.2, 0.1)
        stage = RobotScene(server.scene, ROBOT, pose)
        x, y, z, w = pose.quaternion
        assert stage.gizmo.wxyz == pytest.approx([w, x, y, z], abs=1e-15)
        np.testing.assert_allclose(stage.dragged_pose().matrix, pose.matrix, atol=1e-14)
        np.testing.assert_array_equal(stage.dragged_pose().position, pose.position)
    finally:
        stop_server(server)


def test_all_parts_follow_a_drag(page: Shown) -> None:
    with Client(page.url) as client:
        client.grab()
        half = np.radians(4.0) / 2.0
        client.drag([1.0, 0.5, 2.0], [np.cos(half), 0.0, 0.0, np.sin(half)])
        await_that(lambda: np.array_equal(page.position, [1.0, 0.5, 2.0]))
        plan = sl.inverse(ROBOT, sl.Pose.from_euler([1.0, 0.5, 2.0], 2.0 * half, 0.0, 0.0), tension=sl.MinimumNorm())
        view = page.viewer.view
        assert view is not None
        assert isinstance(view.snapshot, Snapshot)
        assert view.snapshot.tension == pytest.approx(plan.chord_tension, rel=1e-12)
        texts = (str(m["updates"]["content"]) for m in client.heard(PATIENCE) if "content" in m.get("updates", {}))
        assert any("1.000, 0.500, 2.000 m" in text for text in texts)


@extended
def test_thirty_updates_a_second_reach_a_client(page: Shown) -> None:
    with Client(page.url) as client:

        def move(angle: float) -> None:
            client.drag([np.cos(angle), np.sin(angle), 2.0])

        assert best_rate(lambda: updates_a_second(page, client, move), 30.0) >= 30.0


def test_an_infeasible_pose_colors_the_platform_red(page: Shown) -> None:
    with Client(page.url) as client:
        client.drag([7.2, 3.0, 1.5])
        await_that(lambda: page.viewer.view is not None and not page.viewer.view.snapshot.feasible)
        updates = (m["updates"] for m in client.heard(PATIENCE) if "updates" in m)
        assert any("Not feasible" in str(update.get("content", "")) for update in updates)
        client.drag([0.0, 0.0, 2.0])
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.feasible)


def test_a_slider_changes_the_robot(page: Shown) -> None:
    with Client(page.url) as client:
        mass = handle(page, "Platform + load [kg]")
        client.set(mass, 100.0)
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.robot.mass == 100.0)
        model = handle(page, "Cable model")
        client.set(model, "empirical (the article's)")
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.rest is not None)
        client.set(model, "catenary (exact)")
        client.set(mass, 50.0)
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.robot.mass == 50.0)


@extended
def test_tensions_of_a_pose_do_not_depend_on_the_path(page: Shown) -> None:
    generator = np.random.default_rng(20)
    method = handle(page, "Tensions")
    forget = handle(page, "Reset history")

    def tensions_at(client: Client, position: Any) -> np.ndarray:
        client.drag(position)
        await_that(lambda: np.array_equal(page.position, position))
        assert page.viewer.view is not None
        return page.viewer.view.snapshot.tension

    with Client(page.url) as client:
        places = generator.uniform([-4.0, -3.0, 1.0], [4.0, 3.0, 3.5], (8, 3))
        there = [tensions_at(client, place) for place in places]
        back = [tensions_at(client, place) for place in places[::-1]][::-1]
        assert np.array_equal(there, back)
        assert not forget.visible
        client.set(method, method_name(sl.Closest()))
        await_that(lambda: bool(forget.visible))
        tensions_at(client, places[1])
        near = tensions_at(client, places[0])
        assert np.abs(near - there[0]).max() > 1.0  # N: the way there is seen
        assert method_name(sl.Closest()) in page.text
        client.set(forget, True)
        await_that(lambda: page.viewer.view is not None and np.allclose(page.viewer.view.snapshot.tension, there[0]))
        client.set(method, "MinimumNorm")
        await_that(lambda: not forget.visible)


@extended
def test_a_client_lost_during_a_drag_has_no_effect(page: Shown) -> None:
    client = Client(page.url)
    client.grab()
    client.drag([0.3, 0.0, 2.0])
    client.break_off()
    with Client(page.url) as other:
        other.drag([0.6, 0.0, 2.0])
        await_that(lambda: page.position[0] == 0.6)


@extended
def test_ten_clients_see_the_drag_of_one(page: Shown) -> None:
    with clients(page.url, 10) as some:
        for client in some:
            client.replayed()
        some[3].drag([0.9, 0.1, 2.0])
        for client in some:
            drawn = (m for m in client.heard() if m.get("name") == "/cables")
            assert any("points" in m.get("updates", {}) for m in drawn)


@pytest.mark.parametrize(
    "nonsense",
    wide([b"\xff\xfe\x00", b"", "text", b"\x81\xa4type\xa4None", b"\x80"]),
)
def test_a_malformed_message_affects_only_its_sender(page: Shown, nonsense: bytes | str) -> None:
    with Client(page.url) as good:
        bad = Client(page.url)
        bad.send(nonsense)
        good.drag([0.2, 0.7, 2.0])
        await_that(lambda: page.position[1] == 0.7)
        good.drag([0.0, 0.0, 2.0])
        await_that(lambda: page.position[1] == 0.0)
        bad.break_off()


def heard_or_cut_off(page: Shown, client: int, heard: list[int]) -> bool:
    return client in heard or client not in page.server.get_clients()


@extended
def test_an_invalid_pose_is_refused_and_discarded(page: Shown) -> None:
    asked: list[int] = []
    page.viewer.channel.on("asked", lambda _, number: asked.append(number))
    for position, wxyz in (
        ([np.nan, 0.0, 2.0], [1, 0, 0, 0]),
        ([1e9, 0.0, 2.0], [1, 0, 0, 0]),
        ([0.0, 0.0, 2.0], [0, 0, 0, 0]),
        ([0.0, 0.0], [1, 0, 0, 0]),
        ([0.0, 0.0, 2.0], [1, 0]),
    ):
        client = Client(page.url)
        mine = client.met(page.server).client_id
        client.drag(position, wxyz)
        with suppress(ConnectionClosed):  # this may have cut it off
            tell(page, client, "asked", 1)  # heard after that, unless it has
        await_that(partial(heard_or_cut_off, page, mine, asked))
        client.break_off()
        assert page.thread.is_alive()
    with Client(page.url) as client:
        client.drag([0.0, 0.4, 2.0])
        await_that(lambda: page.position[1] == 0.4)


def test_values_beyond_a_slider_are_refused_once() -> None:
    server = start_server(port=0)
    try:
        viewer = Page(server, FEATURES, ROBOT)
        factors = {"Cable density ×": np.nan, "Cable stiffness ×": 0.0, "Sag drawn ×": -1.0, "Error drawn ×": np.inf}
        for label, value in factors.items():
            handle(server, label).value = value
            with refused(label):
                viewer.panel.settings()
            handle(server, label).value = 1.0
        viewer.panel._mass.value = 1e9  # after the settings were read
        viewer.panel.show_what_if("")
        assert not viewer.panel._forgetting.visible
    finally:
        stop_server(server)


@extended
def test_a_run_plays_pauses_and_ends_with_a_drag(film: Shown) -> None:
    with Client(film.url) as client:
        assert np.array_equal(film.position, PATH.pose.position[0])
        tell(film, client, "play", True)
        await_that(lambda: film.position[0] > 0.5)
        seen = film.position  # it continues
        index = int(np.argmin(np.abs(PATH.pose.position[:, 0] - seen[0])))
        assert np.array_equal(seen, PATH.pose.position[index])
        await_that(lambda: not film.told("clock")["playing"] and film.position[0] == 2.0)
        tell(film, client, "scrub", 1.0)
        await_that(lambda: np.array_equal(film.position, PATH.pose.position[50]))
        client.grab()
        client.drag([0.0, 0.8, 2.0])
        await_that(lambda: film.position[1] == 0.8)
        await_that(lambda: film.told("clock")["following"] is False)
        tell(film, client, "play", True)
        await_that(lambda: film.told("clock")["following"] and film.position[2] == 1.5)
        tell(film, client, "play", False)
        await_that(lambda: not film.told("clock")["playing"])


@extended
def test_a_run_is_named_once_and_cannot_be_changed(film: Shown) -> None:
    model, mass = handle(film, "Cable model"), handle(film, "Platform + load [kg]")
    with Client(film.url) as client:
        tell(film, client, "follow", True)
        await_that(lambda: "empirical (the article's)" in unescape(film.text))
        await_that(lambda: not model.visible)
        assert not mass.visible
        client.grab()
        client.drag([0.1, 0.8, 2.0])
        await_that(lambda: film.position[1] == 0.8 and bool(model.visible) and bool(mass.visible))
        await_that(lambda: f"</b> {model.value}" in unescape(film.text))

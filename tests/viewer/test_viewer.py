"""The viewer with clients that drag, set, leave and talk nonsense."""

import json
import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from html import unescape
from pkgutil import resolve_name
from typing import Any, NamedTuple

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

import sagline as sl
from sagline.viewer.reading import Reading
from sagline.viewer.run import Run
from sagline.viewer.server import Server, started, stop
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import Stage
from sagline.viewer.viewer import Viewer
from tests.effort import best_rate
from tests.viewer.client import PATIENCE, Client, await_that, clients

ROBOT = sl.load_robot("article-suspended")
PATH = sl.quintic_path(
    sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2)), durations=[2.0], rate=50
)


class Shown(NamedTuple):
    server: Server
    viewer: Viewer
    thread: threading.Thread

    @property
    def port(self) -> int:
        return int(self.server.get_port())

    @property
    def position(self) -> np.ndarray:
        assert self.viewer.view is not None
        return self.viewer.view.snapshot.pose.position


def shown(made: Callable[[Server], Viewer]) -> Iterator[Shown]:
    """A page of a viewer made for a server, while it is served."""
    server = started(port=0)
    viewer = made(server)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    await_that(lambda: viewer.view is not None)
    try:
        yield Shown(server, viewer, thread)
    finally:
        viewer.stop()
        thread.join(timeout=PATIENCE)
        stop(server)
    assert not thread.is_alive()


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Viewer(server, ROBOT))


@pytest.fixture(scope="module")
def film() -> Iterator[Shown]:
    run = Run.of(sl.inverse(ROBOT, PATH, model=sl.Empirical()))
    yield from shown(lambda server: Viewer(server, ROBOT, run))


def handle(page: Shown, label: str) -> Any:
    found = [each for each in page.server.gui._gui_input_handle_from_uuid.values() if each.label == label]
    assert len(found) == 1
    return found[0]


def tell(page: Shown, client: Client, topic: str, value: Any) -> None:
    """What a page says through browser/channel.js."""
    text = json.dumps({"topic": topic, "value": value, "count": time.monotonic()})
    client.set(handle(page, "sagline")._impl.uuid, text)


def test_it_listens_on_the_loopback_address_alone(page: Shown) -> None:
    sockets = page.server._websock_server
    assert sockets._host == "127.0.0.1"
    assert page.server.request_share_url() is None


def test_a_port_that_is_taken_is_told(page: Shown) -> None:
    with pytest.raises(sl.InvalidValueError, match="--port"):
        started(port=page.port)
    with pytest.raises(sl.InvalidValueError, match="--host"):
        started(host="203.0.113.7", port=0)
    with pytest.raises(sl.InvalidValueError, match="65535"):
        started(port=70000)


def test_the_gizmo_goes_where_it_is_put() -> None:
    server = started(port=0)
    try:
        pose = sl.Pose.from_euler([1.0, 0.5, 2.0], 0.3, -0.2, 0.1)
        stage = Stage(server.scene, ROBOT, pose)
        x, y, z, w = pose.quaternion
        assert stage.gizmo.wxyz == pytest.approx([w, x, y, z], abs=1e-15)
        np.testing.assert_allclose(stage.dragged_pose().matrix, pose.matrix, atol=1e-14)
        np.testing.assert_array_equal(stage.dragged_pose().position, pose.position)
    finally:
        stop(server)


def test_everything_follows_a_drag(page: Shown) -> None:
    with Client(page.port) as client:
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


def updates_a_second(
    page: Shown,
    client: Client,
    move: Callable[[float], None],
    node: str = "/cables",
    part: str = "points",
    along: str = "",
) -> float:
    """How often a page is drawn anew, and a part of a node of it arrives, while a client moves by an angle [rad].

    Never, if no node follows whose name begins with `along`.
    """
    list(client.heard(0.5))
    before, start = page.viewer.updates, time.monotonic()
    while (after := time.monotonic() - start) < 2.0:
        move(3.0 * after)
        time.sleep(0.01)
    heard = [m for m in client.heard(0.5) if {part, "points", "vertices"} & m.get("updates", {}).keys()]
    if not any(m["name"].startswith(along) for m in heard):
        return 0.0
    seen = sum(m["name"] == node and part in m["updates"] for m in heard)
    return float(min(page.viewer.updates - before, seen)) / 2.0


def asked_beside(plain: float) -> float:
    """How often a page is to be drawn that has more to do: 30 of the 60 that there can be, or half of what is here."""
    return min(30.0, 0.5 * plain)


def test_thirty_updates_a_second_reach_a_client(page: Shown) -> None:
    with Client(page.port) as client:

        def move(angle: float) -> None:
            client.drag([np.cos(angle), np.sin(angle), 2.0])

        assert best_rate(lambda: updates_a_second(page, client, move), 30.0) >= 30.0


def test_infeasible_pose_turns_the_platform_red_and_back(page: Shown) -> None:
    with Client(page.port) as client:
        client.drag([7.2, 3.0, 1.5])
        await_that(lambda: page.viewer.view is not None and not page.viewer.view.snapshot.feasible)
        updates = (m["updates"] for m in client.heard(PATIENCE) if "updates" in m)
        assert any("Not feasible" in str(update.get("content", "")) for update in updates)
        client.drag([0.0, 0.0, 2.0])
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.feasible)


def test_a_slider_changes_the_robot(page: Shown) -> None:
    with Client(page.port) as client:
        mass = handle(page, "Platform + load [kg]")
        client.set(mass._impl.uuid, 100.0)
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.robot.mass == 100.0)
        model = handle(page, "Cable model")
        client.set(model._impl.uuid, "empirical (the article's)")
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.rest is not None)
        client.set(model._impl.uuid, "catenary (exact)")
        client.set(mass._impl.uuid, 50.0)
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.robot.mass == 50.0)


def test_the_same_pose_shows_the_same_tensions_whatever_the_way_there(page: Shown) -> None:
    generator = np.random.default_rng(20)
    method = handle(page, "Tensions")
    forget = handle(page, "Forget the way here")

    def tensions_at(client: Client, position: Any) -> np.ndarray:
        client.drag(position)
        await_that(lambda: np.array_equal(page.position, position))
        assert page.viewer.view is not None
        return page.viewer.view.snapshot.tension

    with Client(page.port) as client:
        places = generator.uniform([-4.0, -3.0, 1.0], [4.0, 3.0, 3.5], (8, 3))
        there = [tensions_at(client, place) for place in places]
        back = [tensions_at(client, place) for place in places[::-1]][::-1]
        assert np.array_equal(there, back)
        assert not forget.visible
        client.set(method._impl.uuid, "Closest (remembers the way)")
        await_that(lambda: bool(forget.visible))
        tensions_at(client, places[1])
        near = tensions_at(client, places[0])
        assert np.abs(near - there[0]).max() > 1.0  # N: the way there is seen
        texts = page.viewer._panel._numbers.content
        assert "Closest (remembers the way)" in texts
        client.set(forget._impl.uuid, True)
        await_that(lambda: page.viewer.view is not None and np.allclose(page.viewer.view.snapshot.tension, there[0]))
        client.set(method._impl.uuid, "MinimumNorm")
        await_that(lambda: not forget.visible)


def test_a_client_that_vanishes_mid_drag_is_not_missed(page: Shown) -> None:
    client = Client(page.port)
    client.grab()
    client.drag([0.3, 0.0, 2.0])
    client.break_off()
    with Client(page.port) as other:
        other.drag([0.6, 0.0, 2.0])
        await_that(lambda: page.position[0] == 0.6)


def test_ten_clients_at_once_all_see_the_drag_of_one(page: Shown) -> None:
    with clients(page.port, 10) as some:
        for client in some:
            client.replayed()
        some[3].drag([0.9, 0.1, 2.0])
        for client in some:
            drawn = (m for m in client.heard() if m.get("name") == "/cables")
            assert any("points" in m.get("updates", {}) for m in drawn)


@pytest.mark.parametrize(
    "nonsense",
    [b"", b"\xff\xfe\x00", "text", b"\x81\xa4type\xa4None", b"\x80"],
)
def test_a_malformed_message_harms_its_sender_only(page: Shown, nonsense: bytes | str) -> None:
    with Client(page.port) as good:
        bad = Client(page.port)
        bad.send(nonsense)
        good.drag([0.2, 0.7, 2.0])
        await_that(lambda: page.position[1] == 0.7)
        good.drag([0.0, 0.0, 2.0])
        await_that(lambda: page.position[1] == 0.0)
        bad.break_off()


def heard_or_cut_off(page: Shown, client: int, heard: list[int]) -> bool:
    return client in heard or client not in page.server.get_clients()


def test_a_pose_that_is_none_is_refused_and_forgotten(page: Shown) -> None:
    asked: list[int] = []
    page.viewer._channel.on("asked", lambda _, number: asked.append(number))
    for position, wxyz in (
        ([np.nan, 0.0, 2.0], [1, 0, 0, 0]),
        ([1e9, 0.0, 2.0], [1, 0, 0, 0]),
        ([0.0, 0.0, 2.0], [0, 0, 0, 0]),
        ([0.0, 0.0], [1, 0, 0, 0]),
        ([0.0, 0.0, 2.0], [1, 0]),
    ):
        client = Client(page.port)
        mine = client.met(page.server).client_id
        client.drag(position, wxyz)
        with suppress(ConnectionClosed):  # this may have cut it off
            tell(page, client, "asked", 1)  # heard after that, unless it has
        await_that(partial(heard_or_cut_off, page, mine, asked))
        client.break_off()
        assert page.thread.is_alive()
    with Client(page.port) as client:
        client.drag([0.0, 0.4, 2.0])
        await_that(lambda: page.position[1] == 0.4)


def test_what_a_slider_does_not_reach_is_refused_once_and_not_asked_again() -> None:
    server = started(port=0)
    try:
        viewer = Viewer(server, ROBOT)
        viewer._panel._mass.value = 1e9  # after the settings were read
        viewer._panel.show_what_if("")
        assert not viewer._panel._forgetting.visible
    finally:
        stop(server)


def test_a_run_plays_pauses_and_is_left_by_a_drag(film: Shown) -> None:
    player = film.viewer._player
    with Client(film.port) as client:
        assert np.array_equal(film.position, PATH.pose.position[0])
        tell(film, client, "play", True)
        await_that(lambda: film.position[0] > 0.5)
        seen = film.position  # it goes on
        index = int(np.argmin(np.abs(PATH.pose.position[:, 0] - seen[0])))
        assert np.array_equal(seen, PATH.pose.position[index])
        await_that(lambda: not player.clock.playing and film.position[0] == 2.0)
        tell(film, client, "scrub", 1.0)
        await_that(lambda: np.array_equal(film.position, PATH.pose.position[50]))
        client.grab()
        client.drag([0.0, 0.8, 2.0])
        await_that(lambda: film.position[1] == 0.8)
        assert player.following is False
        tell(film, client, "play", True)
        await_that(lambda: player.following and film.position[2] == 1.5)
        tell(film, client, "play", False)
        await_that(lambda: not player.clock.playing)


def test_a_run_is_named_once_and_cannot_be_changed(film: Shown) -> None:
    model, mass = handle(film, "Cable model"), handle(film, "Platform + load [kg]")
    with Client(film.port) as client:
        tell(film, client, "follow", True)
        await_that(lambda: "empirical (the article's)" in unescape(film.viewer._panel._numbers.content))
        await_that(lambda: not model.visible)
        assert not mass.visible
        client.grab()
        client.drag([0.1, 0.8, 2.0])
        await_that(lambda: film.position[1] == 0.8 and bool(model.visible) and bool(mass.visible))
        await_that(lambda: f"</b> {model.value}" in unescape(film.viewer._panel._numbers.content))


def test_cables_verdict_and_table_come_before_what_is_not_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(kernel: Callable[..., Any]) -> Callable[..., Any]:
        def refuse(*arguments: Any) -> Any:
            if threading.current_thread() is thread:
                raise AssertionError("asked before it is ready")
            return kernel(*arguments)  # of a page that another test has left open

        return refuse

    ready: set[Reading] = set()
    kernels = (
        "sagline.tension.margin.margins_of_poses",
        "sagline.statics.slopes.describe_states",
        "sagline.kinematics.polygon.polygon_of_pose",
        "sagline.kinematics.forward_rows.forward_poses",
    )
    server = started(port=0)
    viewer = Viewer(server, ROBOT, ready=ready.__contains__)
    thread = threading.Thread(target=viewer.serve)

    def texts() -> str:
        panel = viewer._panel
        return panel._verdict.content + panel._numbers.content + panel._polygon.content

    try:
        with monkeypatch.context() as patched:
            for kernel in kernels:
                patched.setattr(kernel, refusing(resolve_name(kernel)))
            thread.start()
            assert viewer.shown.wait(PATIENCE)
            assert "Feasible" in texts()
            assert texts().count("ompiling …") == 3
            cells = re.findall(r"<td.*?>(?:<span.*?</span> )?([\d.]+)</td>", viewer._panel._numbers.content)
            assert len(cells) == 6 * ROBOT.cable_count
            handle(Shown(server, viewer, thread), "Cable model").value = "empirical (the article's)"
            updates = viewer.updates
            viewer.refresh()
            await_that(lambda: viewer.updates > updates)
            assert viewer.view is not None
            assert viewer.view.snapshot.rest is None
        for reading, text in (
            (Reading.MARGIN, "in any direction"),
            (Reading.FREQUENCIES, " Hz</span></div>"),
            (Reading.POLYGON, "<polygon"),
            (Reading.REST, "Really rests"),
        ):
            assert text not in texts()
            ready.add(reading)
            viewer.refresh()
            await_that(lambda text=text: text in texts())  # type: ignore[misc]
        assert "ompiling" not in texts()
    finally:
        viewer.stop()
        if thread.ident is not None:
            thread.join(timeout=PATIENCE)
        stop(server)

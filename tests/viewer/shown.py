"""A viewer that serves its page without a browser: texts of the page, scene, and update rate."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import viser

import sagline as sl
from sagline.viewer.camera import Framing
from sagline.viewer.page import Page
from sagline.viewer.playback import PlayedPlan
from sagline.viewer.server import NAME, PageServer, start_server, stop_server
from tests.viewer.client import PATIENCE, Client, await_that

ROBOT = sl.load_robot("article-suspended")
PATH = sl.quintic_path(
    sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2)), durations=[2.0], rate=50
)


def a_run() -> PlayedPlan:
    """A run of 2 s along `PATH`, whose approximate model makes the platform rest beside it."""
    return PlayedPlan(sl.inverse(ROBOT, PATH, model=sl.Empirical()))


def with_mass(robot: sl.Robot, mass: float) -> sl.Robot:
    """A robot with another mass [kg], spread as its own is."""
    return robot.replace(mass=mass, inertia=robot.inertia * (mass / robot.mass))


class Shown(NamedTuple):
    """A page that is served.

    Attributes:
        server: Its server.
        viewer: Its viewer.
        thread: The thread that serves.
        pieces: Its pieces of HTML, in the order in which they were added.
    """

    server: PageServer
    viewer: Page
    thread: threading.Thread
    pieces: list[viser.GuiHtmlHandle]

    @property
    def url(self) -> str:
        """Address of the page, with its token."""
        return self.server.url

    @property
    def position(self) -> np.ndarray:
        """Position of the shown platform [m]."""
        assert self.viewer.view is not None
        return self.viewer.view.snapshot.pose.position

    @property
    def text(self) -> str:
        """All visible HTML of the panels."""
        return "\n".join(piece.content for piece in self.pieces if piece.visible)

    def told(self, topic: str) -> Any:
        """Last message to browser/channel.js of all pages on a topic; None if there is none."""
        start = f"{NAME}:{topic}:"
        found = [piece.content for piece in self.pieces if piece.content.startswith(start)]
        return json.loads(found[-1][len(start) :]) if found else None

    def node(self, name: str) -> Any:
        """The node of the scene with a name; None if there is none."""
        return self.server.scene.get_handle_by_name(name)


def pieces_of(server: PageServer) -> list[viser.GuiHtmlHandle]:
    """The pieces of HTML that will be added to all pages of a server, as they come."""
    gui: Any = server.gui
    add, pieces = gui.add_html, list[viser.GuiHtmlHandle]()

    def add_and_note(*arguments: Any, **named: Any) -> viser.GuiHtmlHandle:
        pieces.append(add(*arguments, **named))
        return pieces[-1]

    gui.add_html = add_and_note
    return pieces


def shown(made: Callable[[PageServer], Page]) -> Iterator[Shown]:
    """A page of a viewer made for a server, while it is served."""
    server = start_server(port=0)
    pieces = pieces_of(server)
    viewer = made(server)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    await_that(lambda: viewer.view is not None)
    try:
        yield Shown(server, viewer, thread, pieces)
    finally:
        viewer.stop()
        thread.join(timeout=PATIENCE)
        stop_server(server)
    assert not thread.is_alive()


def controls(server: PageServer) -> list[Any]:
    """All controls of all pages of a server."""
    return list(server.gui._gui_input_handle_from_uuid.values())


def handle(page: Shown | PageServer, label: str) -> Any:
    """The control with a label."""
    server = page.server if isinstance(page, Shown) else page
    found = [each for each in controls(server) if each.label == label]
    assert len(found) == 1
    return found[0]


def put(client: Client, server: PageServer, framing: Framing) -> viser.CameraHandle:
    """The camera of a client, once it has been put to where it sees all."""
    met = client.met(server)
    await_that(lambda: bool(framing._places.get(met.client_id)))
    with framing._lock:  # until it has done so
        return met.camera


def framed(client: Client, page: Shown) -> viser.CameraHandle:
    """The camera of a client of a page, once it has been put to where it sees all."""
    return put(client, page.server, page.viewer.framing)


def tell(page: Shown | PageServer, client: Client, topic: str, value: Any) -> None:
    """Say what a page says through browser/channel.js."""
    text = json.dumps({"topic": topic, "value": value, "count": time.monotonic()})
    client.set(handle(page, NAME), text)


def updates_a_second(
    page: Shown,
    client: Client,
    move: Callable[[float], None],
    node: str = "/cables",
    part: str = "points",
    along: str = "",
) -> float:
    """Updates per second of a page, and of a part of a node, while a client moves by an angle [rad].

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
    """Required updates per second of a page with more work: 30 of at most 60, or half of the present rate."""
    return min(30.0, 0.5 * plain)

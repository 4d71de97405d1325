"""The region in the viewer: its time after a slider is moved, and the update rate of the page during this time.

The values are wall times, which depend on the load of the machine. A client receives the messages instead of a browser.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

import sagline as sl
from benchmarks.measure import Row, print_table
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page
from sagline.viewer.server import start_server, stop_server
from sagline.viewer.workspace import WorkspaceQuery, region_hull, region_in
from tests.viewer.client import Client, await_that

ROBOTS = ("cogiro", "falcon-7", "fast", "article-suspended", "ipanema-2-pulleys")
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
MOVES, DRAGGED = 7, 3.0  # number of moves of a slider, and duration of a drag [s]
QUIET = 0.02  # time without a message after which all messages have been received [s]


class Shown(NamedTuple):
    """A viewer with its region, and a client.

    Attributes:
        viewer: The viewer.
        client: The client.
        mass: The slider of the platform's mass.
    """

    viewer: Page
    client: Client
    mass: str


@contextmanager
def shown(robot: sl.Robot) -> Iterator[Shown]:
    """A viewer of a robot with its region."""
    server = start_server(port=0)
    viewer = Page(server, FEATURES, robot)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    fields = {each.label: each for each in server.gui._gui_input_handle_from_uuid.values()}
    with Client(server.url) as client:
        await_that(lambda: viewer.view is not None)
        client.set(_name(fields["Region"]), True)
        heard_until(client, "m³")
        yield Shown(viewer, client, _name(fields["Platform + load [kg]"]))
    viewer.stop()
    thread.join()
    stop_server(server)


def _name(field: Any) -> str:
    return str(field._impl.uuid)


def heard_until(client: Client, words: str) -> float:
    """Time of the last message of a region that is followed by a second without messages [s]."""
    start = time.monotonic()
    last = 0.0
    while not last or time.monotonic() - start - last < 1.0:
        for message in client.heard(QUIET):
            if words in str(message.get("updates", {}).get("content", "")):
                last = time.monotonic() - start
    return last


def regions() -> Iterator[Row]:
    """Time from the move of a slider to the full region at a client."""
    for name in ROBOTS:
        robot = sl.load_robot(name)
        cells = region_in(WorkspaceQuery(robot, LEVEL, sl.Catenary(), sl.WrenchBox()), rough=False).cells
        with shown(robot) as (_, client, mass):
            times = []
            for k in range(MOVES):
                client.set(mass, float(robot.mass * (1.1 + 0.05 * k)))
                times.append(heard_until(client, "m³"))
        size = " x ".join(map(str, cells))
        reach = "<= 0.5 s" if name == "cogiro" else "none"
        yield Row(f"region of {name} after a slider moves, {size} cells", reach, f"{min(times):.2f} s")


def work() -> Iterator[Row]:
    """Processor time of a region, including the coarse region before it."""
    robot = sl.load_robot("cogiro")
    asked = WorkspaceQuery(robot, LEVEL, sl.Catenary(), sl.WrenchBox())
    taken = []
    for _ in range(MOVES):
        start = time.thread_time()
        for rough in (True, False):
            region_hull(asked, rough, lambda *_: None)
        taken.append(time.thread_time() - start)
    yield Row("the same of cogiro, of a processor", "", f"{min(taken):.2f} s")


def drags() -> Iterator[Row]:
    """Update rate of the cables during a drag that changes the region."""
    robot = sl.load_robot("cogiro")
    with shown(robot) as (viewer, client, mass):
        assert viewer.view is not None
        home = viewer.view.snapshot.pose.position

        def slide(at: float) -> None:
            client.set(mass, float(robot.mass * (1.1 + 0.2 * np.sin(3.0 * at))))

        def turn(at: float) -> None:
            half = 0.05 * np.sin(3.0 * at)
            client.drag(home, [float(np.cos(half)), 0.0, 0.0, float(np.sin(half))])

        def move(at: float) -> None:
            client.drag(home + 0.3 * np.array([np.cos(3.0 * at), np.sin(3.0 * at), 0.0]))

        for words, drag in (("a slider is", slide), ("the platform is turned,", turn), ("the platform is", move)):
            list(client.heard(0.5))
            start = time.monotonic()
            while (after := time.monotonic() - start) < DRAGGED:
                drag(after)
                time.sleep(0.01)
            names = [str(m["name"]) for m in client.heard(0.5) if {"points", "vertices"} & set(m.get("updates", ()))]
            cables, hulls = names.count("/cables") / DRAGGED, names.count("/hull/0") / DRAGGED
            what = words if words.endswith(",") else f"{words} dragged,"
            yield Row(f"while {what} region on, cogiro", ">= 30 updates/s", f"{cables:.0f}/s, regions {hulls:.0f}/s")


PARTS = (regions, work, drags)

if __name__ == "__main__":
    print_table("The region in the viewer", PARTS)

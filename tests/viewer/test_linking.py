"""A link gives another page the same state; links of other robots and invalid links change nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.feature import View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.state import StateFeature, name_of, pose_part, short
from sagline.viewer.page import Page, Source
from sagline.viewer.playback import PlayedPlan
from tests.tiers import extended
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.shown import Shown, controls, framed, handle, shown, tell, with_mass

ROBOT = sl.load_robot("cogiro")


@contextmanager
def a_page(robot: sl.Robot = ROBOT, **given: Any) -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, robot, **given))


@pytest.fixture(scope="module")
def one() -> Iterator[Shown]:
    with a_page() as page:
        yield page


@pytest.fixture(scope="module")
def other() -> Iterator[Shown]:
    with a_page() as page:
        yield page


class Asking:
    """A client that asks, and is answered."""

    def __init__(self, page: Shown, client: Client) -> None:
        self.page, self.client, self.count = page, client, 0
        self.seen: list[dict[str, Any]] = []  # what came beside the answers

    def ask(self, topic: str, text: str) -> dict[str, Any]:
        self.count += 1
        name = f"{id(self)}-{self.count}"
        field = handle(self.page, "sagline")
        self.client.set(field, json.dumps({"topic": topic, "value": [name, text], "count": self.count}))
        return self.answered(topic, name)

    def answered(self, topic: str, name: str) -> dict[str, Any]:
        """Answer to a request."""
        start = f"sagline:{topic}-reply:"
        for message in self.client.heard(PATIENCE):
            self.seen.append(message)
            content = str((message.get("props") or message.get("updates") or {}).get("content", ""))
            if content.startswith(start) and json.loads(content[len(start) :])["to"] == name:
                return dict(json.loads(content[len(start) :]))
        raise AssertionError("no answer")

    def link(self) -> str:
        return str(self.ask("copy", "link")["text"])


@contextmanager
def asking(page: Shown) -> Iterator[Asking]:
    with Client(page.url) as client:
        yield Asking(page, client)


def view(page: Shown) -> View:
    assert page.viewer.view is not None
    return page.viewer.view


def same(one: Shown, other: Shown) -> bool:
    a, b = view(one), view(other)
    return bool(
        np.allclose(a.snapshot.pose.position, b.snapshot.pose.position, atol=1e-11)
        and np.allclose(a.snapshot.pose.matrix, b.snapshot.pose.matrix, atol=1e-11)
        and a.settings.changes == b.settings.changes
        and type(a.settings.model) is type(b.settings.model)
        and type(a.settings.tension) is type(b.settings.tension)
        and (a.settings.sag_scale, a.settings.error_scale, a.ghost)
        == (b.settings.sag_scale, b.settings.error_scale, b.ghost)
        and np.array_equal(np.zeros(6) if a.wrench is None else a.wrench, np.zeros(6) if b.wrench is None else b.wrench)
        and np.allclose(a.snapshot.tension, b.snapshot.tension, rtol=1e-8, equal_nan=True)
    )


def randomly_set(page: Shown, client: Client, random: np.random.Generator) -> None:
    """Change some controls of the page and move its platform."""
    labels = ["Platform + load [kg]", "Cable density ×", "Cable stiffness ×", "Sag drawn ×", "Error drawn ×"]
    for label in labels:
        slider = handle(page, label)
        if random.random() < 0.6:
            steps = int(random.integers(0, round((slider.max - slider.min) / slider.step)))
            client.set(slider, slider.min + steps * slider.step)
    for label in ("Cable model", "Tensions"):
        options = [each for each in handle(page, label).options if "depends on history" not in each]
        client.set(handle(page, label), options[int(random.integers(len(options)))])
    client.set(handle(page, "Straight cables beside"), bool(random.random() < 0.5))
    turn = random.uniform(-0.1, 0.1, 4)
    turn[0] = 1.0
    position = random.uniform([-3.0, -2.0, 1.0], [3.0, 2.0, 4.0])
    client.grab()
    client.drag(position, turn / np.linalg.norm(turn))
    await_that(lambda: np.array_equal(view(page).snapshot.pose.position, position))


@extended
@pytest.mark.parametrize("count", [4, pytest.param(150, marks=pytest.mark.soak)])
def test_another_page_has_the_same_state(one: Shown, other: Shown, count: int) -> None:
    random = np.random.default_rng(20261122)
    with asking(one) as here, asking(other) as there:
        for _ in range(count):
            randomly_set(one, here.client, random)
            randomly_set(other, there.client, random)
            link = here.link()
            assert len(link) < 700
            assert set(link) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789,.:+-=&%")
            assert "refused" not in there.ask("link", link)
            await_that(lambda: same(one, other))
            assert there.link() == link


def test_a_link_contains_all_controls(one: Shown, other: Shown) -> None:
    handles = [each for each in controls(one.server) if hasattr(each, "label")]
    wanted = {id(each) for each in handles if each.label != "sagline" and not each._impl.is_button}
    named = one.viewer.feature(StateFeature).controls._handles()
    assert {id(each) for each in named.values()} == wanted
    assert all(name.startswith(short(each.label)) for name, each in named.items())
    assert {"slice", "cable-model", "mode", "modes-up-to"} <= set(named)
    with asking(one) as here, asking(other) as there:
        for label, value in (("Modes up to [Hz]", 7.0), ("Force", "about z"), ("Mode", "massless 2")):
            here.client.set(handle(one, label), value)
        here.client.set(handle(one, "At x, y, z [m]"), [0.125, 0.0, -0.25])
        await_that(lambda: handle(one, "At x, y, z [m]").value == (0.125, 0.0, -0.25))
        link = here.link()
        assert "modes-up-to=7&force=about-z" in link
        there.ask("link", link)
        assert handle(other, "Mode").value == "massless 2"
        highest = handle(other, "Modes up to [Hz]")
        assert highest.value == 7.0
        assert handle(other, "At x, y, z [m]").value == (0.125, 0.0, -0.25)
        assert "2 numbers" not in there.ask("link", link.replace("0.125,0,-0.25", "0.125,0"))["refused"]
        here.client.set(handle(one, "Mode"), "")
        await_that(lambda: handle(one, "Mode").value == "")
        there.ask("link", here.link())  # default values are omitted, and set nevertheless
        assert handle(other, "Mode").value == ""


@extended
def test_a_link_contains_all_earlier_settings(one: Shown) -> None:
    mass = handle(one, "Platform + load [kg]")
    usual = mass.value
    with asking(one) as here:
        number = framed(here.client, one).client.client_id

        def set_and_ask() -> None:
            mass.value = 120.0
            one.viewer.channel._handlers["copy"](["both", "link"], number)

        one.viewer.later(set_and_ask)  # before what is set is shown
        assert "&platform-load=120" in here.answered("copy", "both")["text"]
        here.client.set(mass, usual)
        await_that(lambda: view(one).snapshot.robot.mass == usual)


@extended
def test_controls_with_equal_names_are_distinguished(one: Shown, other: Shown) -> None:
    values = {"Force": "about z", "Force ± [N]": 12.5, "Force [N]": 3.25}
    usual = {label: handle(one, label).value for label in values}
    with asking(one) as here, asking(other) as there:
        for label, value in values.items():
            here.client.set(handle(one, label), value)
        await_that(lambda: all(handle(one, label).value == value for label, value in values.items()))
        assert "refused" not in there.ask("link", here.link())
        assert {label: handle(other, label).value for label in values} == values
        for label, value in usual.items():
            here.client.set(handle(one, label), value)
        await_that(lambda: all(handle(one, label).value == value for label, value in usual.items()))
        assert "refused" not in there.ask("link", here.link())


def test_the_link_of_an_initial_page_contains_only_the_pose() -> None:
    with a_page() as page, asking(page) as here:
        assert here.link() == f"robot={name_of(ROBOT)}&pose=0,0,2.6"


@extended
def test_a_link_contains_the_camera_of_the_client(one: Shown, other: Shown) -> None:
    with asking(one) as here, asking(other) as there:
        framed(here.client, one)
        assert "camera" not in here.link()
        here.client.look([1.0, 2.0, 30.0], [0.5, 0.25, 0.0])
        await_that(lambda: "camera=1,2,30,0.5,0.25,0" in here.link())
        assert "refused" not in there.ask("link", here.link())
        wanted = {"SetCameraPositionMessage": (1.0, 2.0, 30.0), "SetCameraLookAtMessage": (0.5, 0.25, 0.0)}
        places: dict[str, Any] = {}
        for message in chain(there.seen, there.client.heard()):
            if message["type"] in wanted:
                places[message["type"]] = tuple(message.get("position") or message["look_at"])
            if all(places.get(kind) == pytest.approx(place) for kind, place in wanted.items()):
                return
        raise AssertionError(places)


@extended
def test_a_link_contains_payload_wrench_and_chosen_tensions() -> None:
    loaded = with_mass(ROBOT, ROBOT.mass + 20.0)
    wrench = np.array([10.0, -20.0, 5.0, 1.0, 2.0, -3.0])
    source = Source.of_robot("cogiro", loaded.mass)
    with a_page(loaded, wrench=wrench, source=source) as here, a_page() as there, asking(here) as asker:
        tension = view(here).snapshot.tension + 5.0
        asker.client.set(
            handle(here, "sagline"), json.dumps({"topic": "dot", "value": {"at": [30.0, 40.0]}, "count": 9})
        )
        await_that(lambda: type(view(here).settings.tension).__name__ == "ByHand")
        link = asker.link()
        assert "wrench=10,-20,5,1,2,-3" in link
        assert "platform-load=111.058" in link
        with asking(there) as other:
            assert "refused" not in other.ask("link", link)
            await_that(lambda: same(here, there))
        assert not np.allclose(tension, view(there).snapshot.tension)


@extended
def test_a_link_to_a_time_of_a_run() -> None:
    robot = sl.load_robot("article-suspended")
    ends = sl.Pose(np.array([[0.0, 0.0, 1.5], [2.0, 1.0, 1.5]]), np.stack([np.eye(3)] * 2))
    run = PlayedPlan(sl.inverse(robot, sl.quintic_path(ends, durations=[2.00000000000777], rate=20)))
    with a_page(robot, played=run) as here, a_page(robot, played=run) as there, a_page(robot) as alone:
        with asking(here) as asker:
            tell(here, asker.client, "scrub", 1.25)
            await_that(lambda: view(here).snapshot.pose.position[0] > 1.0)
            link = asker.link()
        assert "time=1.25" in link
        with asking(here) as asker:  # the end, whose time has more digits than one writes
            tell(here, asker.client, "scrub", run.duration)
            await_that(lambda: view(here).snapshot.pose.position[0] == 2.0)
            end = asker.link()
            assert "refused" not in asker.ask("link", end)
            assert here.told("clock")["time"] == run.duration
            tell(here, asker.client, "scrub", 1.25)
            await_that(lambda: view(here).snapshot.pose.position[0] < 2.0)
        with asking(there) as other:
            assert "refused" not in other.ask("link", link)
            await_that(lambda: same(here, there))
            assert view(there).played is not None
            assert "time" in other.ask("link", link.replace("time=1.25", "time=3"))["refused"]
        with asking(alone) as third:
            assert "sagline view" in third.ask("link", link)["refused"]


OWN = f"robot={name_of(ROBOT)}"
NONSENSE = (
    "", "x", "robot=cogiro", "pose=1,0,2", OWN, f"{OWN}&pose=1,0", f"{OWN}&pose=nan,0,1", f"{OWN}&pose=1e9,0,1",
    f"{OWN}&pose=0,0,2&time=1", f"{OWN}&pose=0,0,2&pose=0,0,1", f"{OWN}&pose=0,0,2&what=3", f"{OWN}&pose=0,0,2&hull=2",
    f"{OWN}&pose=0,0,2&cable-density=0", f"{OWN}&pose=0,0,2&cable-density=1e400", f"{OWN}&pose=0,0,2&cable-density=",
    f"{OWN}&pose=0,0,2&cable-model=none", f"{OWN}&pose=0,0,2&camera=1,2", f"{OWN}&pose=0,0,2&camera=1e9,0,0,0,0,0",
    f"{OWN}&pose=0,0,2&camera=1,2,3,1,2,3",
    f"{OWN}&pose=0,0,2&wrench=a", f"{OWN}&pose=0,0,2&by-hand=1,2", f"{OWN}&pose=0,0,2&by-hand=-1,1,1,1,1,1,1,1",
    f"{OWN}&pose=0,0,2&mode={'x' * 99}", f"{OWN}&pose=0,0,2&mode=%00", f"{OWN}&time=1", f"{OWN}&pose=%ff,0,1",
    "robot=falcon-7:00000000&pose=0,0,1", "robot=cogiro:00000000&pose=0,0,2", "a=b&" * 300, "x" * 9000,
    f"{OWN}&pose=0,0,2&sagline=x", "<script>alert(1)</script>", f"{OWN};pose=0,0,2", f"robot=&{OWN}&pose=0,0,2",
)  # fmt: skip


@extended
def test_invalid_links_are_refused_in_a_line(one: Shown) -> None:
    with asking(one) as here:
        here.ask("pose", "0.5,0.5,2")
        await_that(lambda: view(one).snapshot.pose.position[0] == 0.5)
        before = here.link()
        for text in NONSENSE:
            refused = here.ask("link", text)["refused"]
            assert len(refused) < 300, refused
            assert refused.isprintable()
        assert here.link() == before
        random = np.random.default_rng(7)
        for _ in range(60):
            broken = list(before)
            for _ in range(int(random.integers(1, 6))):
                broken[int(random.integers(len(broken)))] = chr(int(random.integers(32, 500)))
            here.ask("link", "".join(broken))
        assert one.thread.is_alive()


def test_a_link_has_the_angles_of_its_pose_about_z_y_x() -> None:
    pose = sl.Pose.from_euler([1.0, -2.5, 0.125], *np.radians([10.0, -20.0, 30.0]))
    values = [float(value) for value in pose_part(pose).split(",")]
    assert values == pytest.approx([1.0, -2.5, 0.125, 10.0, -20.0, 30.0], abs=1e-9)


def test_the_digest_of_a_robot_excludes_its_load() -> None:
    assert name_of(ROBOT) == name_of(with_mass(ROBOT, 12.0))
    assert name_of(ROBOT) != name_of(ROBOT.replace(tension_min=ROBOT.tension_min + 1.0))
    assert name_of(ROBOT) != name_of(ROBOT.replace(frame_anchors=ROBOT.frame_anchors + 1e-9))


@extended
def test_a_robot_from_a_run_is_the_same(tmp_path: Path) -> None:
    sl.inverse(ROBOT, sl.Pose([[0.0, 0.0, 2.0]], np.eye(3))).save(tmp_path / "run.nc")
    assert name_of(sl.load_plan(tmp_path / "run.nc").state.one_robot) == name_of(ROBOT)

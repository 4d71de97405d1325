"""The workspace in the page: nothing until it is asked for, then a slice, ways and a hull that follow."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import hull as hulls
from sagline.viewer.hull import Asked, Hull, hull_of
from sagline.viewer.margin_scale import MarginScale
from sagline.viewer.server import Server, started, stop
from sagline.viewer.space_show import SpaceShow, planes_of
from sagline.viewer.viewer import Reading, Viewer
from tests.effort import best_rate
from tests.kinematics.test_many_robots import planar
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.test_viewer import ROBOT, Shown, handle

POSE = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
LOADS = sl.WrenchBox(force=50.0)


def ball(asked: Asked, told: Callable[[int, int], None]) -> Hull:
    """A tetrahedron, at once; two of its corners are cable 1's."""
    told(1, 2)
    corners = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 2.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return Hull(corners, faces, np.array([0.0, 0.0, 150.0, 150.0]), np.array([0, 1, 1, -1]), f"{asked.robot.mass:g} kg")


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    server: Server = started(port=0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagline.viewer.viewer.hull_of", ball)
        viewer = Viewer(server, ROBOT, pose=POSE)
    thread = threading.Thread(target=viewer.serve)
    thread.start()
    await_that(lambda: viewer.view is not None)
    yield Shown(server, viewer, thread)
    viewer.stop()
    thread.join(timeout=PATIENCE)
    stop(server)
    assert not thread.is_alive()


def show_of(page: Shown) -> SpaceShow:
    return page.viewer._space


def choose(page: Shown, client: Client, **values: Any) -> None:
    """Set what has these names, and wait until it has been shown."""
    labels = {
        "hull": "Hull", "by": "Hull colored by", "slice": "Slice", "plane": "Plane", "ways": "Where can I go",
        "force": "Force ± [N]", "moment": "Moment ± [N m]",
    }  # fmt: skip
    for name, value in values.items():
        client.set(handle(page, labels[name])._impl.uuid, value)
        await_that(partial(lambda own, wanted: own.value == wanted, handle(page, labels[name]), value))
    for _ in range(2):  # the first may have begun before
        before = page.viewer.updates
        page.viewer.refresh()
        await_that(partial(lambda seen: page.viewer.updates > seen, before))


@pytest.fixture
def client(page: Shown) -> Iterator[Client]:
    with Client(page.port) as one:
        yield one
        choose(page, one, hull=False, slice=False, ways=False, force=0.0, moment=0.0, plane="level")
        one.drag(POSE.position)
        await_that(lambda: np.array_equal(page.position, POSE.position))
        list(one.heard(0.1))  # what is not read holds up its leaving


def test_nothing_is_computed_until_it_is_asked_for(page: Shown, client: Client) -> None:
    client.drag([0.5, 0.5, 2.0])
    await_that(lambda: page.position[0] == 0.5)
    assert show_of(page)._levels is None or show_of(page)._key is None
    assert not show_of(page).waiting
    assert show_of(page)._stage._slice == []
    assert "Nothing is computed" in show_of(page)._panel._where.content


def test_the_slice_follows_the_platform_and_ends_where_the_margin_does(page: Shown, client: Client) -> None:
    choose(page, client, slice=True, force=50.0)
    client.drag([0.0, 0.0, 3.0])
    await_that(lambda: page.position[2] == 3.0)
    _, boundary, lines = show_of(page)._stage._slice
    await_that(lambda: bool(np.all(boundary.points[..., 2] == 3.0)))
    poses = sl.Pose.from_euler(boundary.points.reshape(-1, 3).astype(float), 0.0, 0.0, 0.0)
    away = np.abs(sl.margin(ROBOT, poses, LOADS).value)
    assert np.median(away) < 2.0  # N, between points that are 0.3 m apart
    scale = show_of(page)._scale.step
    on_lines = sl.margin(ROBOT, sl.Pose.from_euler(lines.points[:, 0].astype(float), 0.0, 0.0, 0.0), LOADS).value
    assert np.median(np.abs(on_lines / scale - np.rint(on_lines / scale))) < 0.02
    choose(page, client, plane="upright, along x")
    assert np.all(show_of(page)._stage._slice[1].points[..., 1] == 0.0)
    assert "Margin [N]" in show_of(page)._panel._key.content


def test_a_slice_follows_a_drag_thirty_times_a_second(page: Shown, client: Client) -> None:
    choose(page, client, slice=True, ways=True, force=50.0)

    def rate() -> float:
        list(client.heard(0.5))
        start, before = time.monotonic(), page.viewer.updates
        while time.monotonic() - start < 2.0:
            angle = 3.0 * (time.monotonic() - start)
            client.drag([np.cos(angle), np.sin(angle), 2.0 + 0.5 * np.sin(angle)])
            time.sleep(0.01)
        seen = sum(m.get("name") == "/slice/picture" and "_data" in m.get("updates", {}) for m in client.heard(0.5))
        return float(min(page.viewer.updates - before, seen)) / 2.0

    assert best_rate(rate, 30.0) >= 30.0


def test_ways_end_where_the_robot_can_no_more(page: Shown, client: Client) -> None:
    choose(page, client, ways=True, force=50.0)
    arrows = show_of(page)._stage._arrows
    assert arrows is not None
    ends = arrows.points[:, 1].astype(float)
    low = ends[:, 2] > 0.05  # not that which ends on the floor
    inward = 1e-3 * (POSE.position - ends) / np.linalg.norm(POSE.position - ends, axis=1, keepdims=True)
    for shift, feasible in ((inward, True), (-inward, False)):
        poses = sl.Pose.from_euler((ends + shift)[low], 0.0, 0.0, 0.0)
        assert np.all((sl.margin(ROBOT, poses, LOADS).value >= 0.0) == feasible)
    assert "<b>Margin</b>" in show_of(page)._panel._where.content


def test_the_hull_comes_when_it_is_asked_for_and_is_colored_as_told(page: Shown, client: Client) -> None:
    show = show_of(page)
    choose(page, client, hull=True)
    await_that(lambda: "50 kg" in show._panel._told.content)  # said once the hull is drawn
    assert len(show._stage._meshes) == 2
    assert [name.text for name in show._stage._hull_names] == ["cable 0", "cable 1"]
    choose(page, client, by="margin")
    await_that(lambda: len(show._stage._hull_names) == 0 and len(show._stage._meshes) == 2)
    choose(page, client, slice=True)
    assert {mesh.side for mesh in show._stage._meshes} == {"back"}
    drawn = show._drawn
    client.drag([2.0, 0.5, 2.0])
    await_that(lambda: page.position[0] == 2.0)
    assert show._drawn == drawn  # where the platform is changes nothing
    half = 0.05
    client.drag([2.0, 0.5, 2.0], [np.cos(half), 0.0, 0.0, np.sin(half)])
    await_that(lambda: show._drawn not in (drawn, None))  # how it is turned does
    choose(page, client, hull=False, by="limiting cable")
    assert show._stage._meshes == []


def test_a_hull_that_takes_long_shows_how_far_it_is(
    page: Shown, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    going, seen = threading.Event(), show_of(page)

    def slow(asked: Asked, told: Callable[[int, int], None]) -> Hull:
        told(1, 4)
        assert going.wait(PATIENCE)
        return ball(asked, told)

    monkeypatch.setattr(seen, "_make", slow)
    monkeypatch.setattr("sagline.viewer.aside.PATIENCE", 0.1)
    choose(page, client, hull=True, force=7.0)
    await_that(lambda: "25 %" in seen._panel._told.content)
    choose(page, client, force=8.0)  # another is wanted meanwhile
    going.set()
    await_that(lambda: seen._hull is not None and seen._hull[0] == seen._key)
    await_that(lambda: len(seen._stage._meshes) == 2)


@pytest.mark.parametrize("load", [-1.0, float("nan"), 1e300])
def test_loads_that_are_none_are_refused_in_words(page: Shown, client: Client, load: float) -> None:
    client.set(handle(page, "Force ± [N]")._impl.uuid, load)
    client.set(handle(page, "Slice")._impl.uuid, True)
    await_that(lambda: "Type a load" in show_of(page)._panel._told.content)
    assert show_of(page)._stage._slice == []
    choose(page, client, force=10.0)
    await_that(lambda: show_of(page)._stage._slice != [])
    assert "Type a load" not in show_of(page)._panel._told.content


def test_a_hull_is_that_of_the_workspace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hulls, "CELLS", 8)
    shares: list[float] = []
    turned = sl.Pose.from_euler(np.zeros(3), 0.1, 0.0, 0.0)
    asked = Asked(ROBOT, turned.quaternion, sl.Catenary(), LOADS)
    found = hull_of(asked, lambda done, total: shares.append(done / total))
    space = sl.workspace(ROBOT, wrenches=LOADS, orientations=sl.Orientations(turned.matrix), cells=8, refine=False)
    np.testing.assert_array_equal(found.vertices, space.surface.vertices)
    assert f"{space.volume:.0f}" in found.told
    assert "±50\xa0N" in found.told
    assert shares
    patches = found.patches(None)
    assert sum(len(patch.faces) for patch in patches) == len(space.surface.faces)
    assert {patch.name for patch in patches} <= {"", *(f"cable {k}" for k in range(8))}
    on_margin = found.patches(MarginScale(10.0))
    assert sum(len(patch.faces) for patch in on_margin) == len(space.surface.faces)


def test_a_hull_that_is_empty_says_what_is_nearest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hulls, "CELLS", 6)
    found = hull_of(Asked(ROBOT, POSE.quaternion, sl.Catenary(), sl.WrenchBox(1e5)), lambda *_: None)
    assert found.patches(None) == []
    assert "empty" in found.told


def test_a_planar_robot_is_sliced_in_its_plane() -> None:
    assert planes_of(ROBOT) == (2, 1, 0)
    assert planes_of(planar((0.0, 1.0, 0.0))) == (1,)


def test_what_is_still_compiled_is_said() -> None:
    server = started(port=0)
    try:
        viewer = Viewer(server, ROBOT, ready=lambda reading: reading is not Reading.WORKSPACE)
        viewer._update()
        viewer._space._panel._slice.value = True
        viewer._update()
        assert "Compiling" in viewer._space._panel._told.content
        assert viewer._space._levels is None
    finally:
        stop(server)

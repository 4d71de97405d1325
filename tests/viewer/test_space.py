"""The workspace in the page: nothing until it is asked for, then a slice, ways and a hull that follow."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.errors import SaglineError
from sagline.viewer.cable_colors import cable_color
from sagline.viewer.hull import Asked, Hull
from sagline.viewer.reading import Reading
from sagline.viewer.server import Server, started, stop
from sagline.viewer.space_show import SpaceShow, planes_of
from sagline.viewer.viewer import Viewer
from tests.effort import best_rate
from tests.kinematics.test_many_robots import planar
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.test_viewer import ROBOT, Shown, asked_beside, handle, shown, updates_a_second

POSE = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
LOADS = sl.WrenchBox(force=50.0)


def ball(asked: Asked, rough: bool, told: Callable[[int, int], None]) -> Hull:
    """A tetrahedron, at once; two of its corners are cable 1's."""
    told(1, 2)
    corners = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 2.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    margin, cable = np.array([0.0, 0.0, 150.0, 150.0]), np.array([0, 1, 1, -1])
    words = f"{asked.robot.mass:g} kg{', roughly' * rough}"
    return Hull.of(corners, faces, margin, cable, np.zeros(4, dtype=bool), words)


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    def made(server: Server) -> Viewer:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("sagline.viewer.viewer.hull_of", ball)
            return Viewer(server, ROBOT, pose=POSE)

    yield from shown(made)


def show_of(page: Shown) -> SpaceShow:
    return page.viewer._space


def choose(page: Shown, client: Client, **values: Any) -> None:
    """Set what has these names, and wait until it has been shown."""
    labels = {
        "hull": "Region", "by": "Region colored by", "slice": "Slice", "plane": "Plane", "ways": "Where can I go",
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
    def move(angle: float) -> None:
        client.drag([np.cos(angle), np.sin(angle), 2.0 + 0.5 * np.sin(angle)])

    choose(page, client, slice=False, ways=False, hull=False)
    asked = asked_beside(updates_a_second(page, client, move))
    choose(page, client, slice=True, ways=True, force=50.0)
    assert best_rate(lambda: updates_a_second(page, client, move, "/slice/picture", "_data"), asked) >= asked


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
    await_that(lambda: "50 kg<" in show._panel._told.content)  # said once the hull in full is drawn
    drawn_hull = show._stage._hull
    assert len(drawn_hull.meshes) == 2
    assert [mesh.color for mesh in drawn_hull.meshes] == [cable_color(0), cable_color(1)]
    choose(page, client, by="margin")
    await_that(lambda: drawn_hull.meshes[0].color == tuple(show._scale.colors(np.array(0.0)).tolist()))
    choose(page, client, slice=True)
    assert {mesh.side for mesh in drawn_hull.meshes} == {"back"}
    drawn = show._drawn
    client.drag([2.0, 0.5, 2.0])
    await_that(lambda: page.position[0] == 2.0)
    assert show._drawn == drawn  # where the platform is changes nothing
    half = 0.05
    client.drag([2.0, 0.5, 2.0], [np.cos(half), 0.0, 0.0, np.sin(half)])
    await_that(lambda: show._drawn not in (drawn, None))  # how it is turned does
    choose(page, client, hull=False, by="limiting cable")
    assert drawn_hull.meshes == []


def test_a_hull_follows_a_slider_and_the_one_before_stays_until_it_is_there(
    page: Shown, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    show, going, ended = show_of(page), threading.Event(), list[str]()

    def slow(asked: Asked, rough: bool, told: Callable[[int, int], None]) -> Hull:
        if asked.robot.mass == 60.0 and not rough:
            assert going.wait(PATIENCE)
            try:
                told(1, 2)
            except SaglineError:
                ended.append("given up")
                raise
        return ball(asked, rough, told)

    monkeypatch.setattr(show, "_make", slow)
    mass = handle(page, "Platform + load [kg]")._impl.uuid
    choose(page, client, hull=True)
    await_that(lambda: "50 kg<" in show._panel._told.content)
    client.set(mass, 60.0)
    await_that(lambda: "60 kg, roughly" in show._panel._told.content)  # nothing was asked for again
    assert len(show._stage._hull.meshes) == 2
    client.set(mass, 70.0)
    await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.robot.mass == 70.0)
    assert "60 kg, roughly" in show._panel._told.content
    going.set()
    await_that(lambda: "70 kg<" in show._panel._told.content)
    assert ended == ["given up"]  # what nobody waits for any more is not worked out
    client.set(mass, 50.0)
    await_that(lambda: "50 kg<" in show._panel._told.content)


def test_a_wall_lights_up_near_the_platform_and_says_what_is_left(page: Shown, client: Client) -> None:
    show = show_of(page)
    choose(page, client, hull=True, force=50.0)
    await_that(lambda: show._made is not None and not show._made.rough and show._made.key == show._key)
    for place in ([1.0, 0.5, 2.0], [0.3, 0.3, 1.4]):  # the ball's tetrahedron ends at z = 1
        client.drag(place)
        await_that(partial(lambda where: np.array_equal(page.position, where), place))
        found = sl.margin(ROBOT, sl.Pose(place, np.eye(3)), LOADS)
        text = f"{found.value:.1f} N left, cable {found.limiting_cable}"
        await_that(partial(lambda said: show._stage._left.text == said, text))
        assert text in show._panel._left.content
    assert {mesh.color for mesh in show._stage._wall.meshes} <= {cable_color(0), cable_color(1)}
    assert len(show._stage._wall.meshes) > 0
    client.drag([-4.0, -3.0, 3.0])
    await_that(lambda: show._stage._wall.meshes == [])
    choose(page, client, hull=False)
    assert not show._stage._left.visible


def test_thirty_updates_a_second_while_a_slider_is_dragged_that_a_region_follows() -> None:
    robot = sl.load_robot("cogiro")
    with contextmanager(shown)(lambda server: Viewer(server, robot)) as page:
        show, mass = show_of(page), handle(page, "Platform + load [kg]")._impl.uuid

        with Client(page.port) as client:

            def move(angle: float) -> None:
                client.set(mass, float(robot.mass * (1.1 + 0.2 * np.sin(angle))))

            rate = partial(updates_a_second, page, client, move)
            asked = asked_beside(rate())
            client.set(handle(page, "Region")._impl.uuid, True)
            await_that(lambda: show._made is not None)
            assert best_rate(partial(rate, along="/hull/"), asked) >= asked  # it is to follow while the slider moves


def test_a_hull_that_takes_long_shows_how_far_it_is(
    page: Shown, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    going, seen = threading.Event(), show_of(page)

    def slow(asked: Asked, rough: bool, told: Callable[[int, int], None]) -> Hull:
        told(1, 4)
        assert going.wait(PATIENCE)
        return ball(asked, rough, told)

    monkeypatch.setattr(seen, "_make", slow)
    monkeypatch.setattr("sagline.viewer.aside.PATIENCE", 0.1)
    choose(page, client, hull=True, force=7.0)
    await_that(lambda: "25 %" in seen._panel._told.content)
    choose(page, client, force=8.0)  # another is wanted meanwhile
    going.set()
    await_that(lambda: seen._made is not None and seen._made.key == seen._key and not seen._made.rough)
    await_that(lambda: len(seen._stage._hull.meshes) == 2)


@pytest.mark.parametrize("load", [-1.0, float("nan"), 1e300])
def test_loads_that_are_none_are_refused_in_words(page: Shown, client: Client, load: float) -> None:
    client.set(handle(page, "Force ± [N]")._impl.uuid, load)
    client.set(handle(page, "Slice")._impl.uuid, True)
    await_that(lambda: "Type a load" in show_of(page)._panel._told.content)
    assert show_of(page)._stage._slice == []
    choose(page, client, force=10.0)
    await_that(lambda: show_of(page)._stage._slice != [])
    assert "Type a load" not in show_of(page)._panel._told.content


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

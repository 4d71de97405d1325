"""The workspace in the page: no computation before a request, then slice, travel and hull follow the page."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import SaglineError
from sagline.viewer.features import FEATURES
from sagline.viewer.features.region import RegionFeature, planes_of
from sagline.viewer.page import Page
from sagline.viewer.tension_scale import cable_color
from sagline.viewer.workspace import Hull, WorkspaceQuery, region_hull
from tests.effort import best_rate
from tests.kinematics.test_many_robots import planar
from tests.tiers import extended
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.shown import ROBOT, Shown, asked_beside, handle, shown, updates_a_second

POSE = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
LOADS = sl.WrenchBox(force=50.0)


def ball(asked: WorkspaceQuery, rough: bool, told: Callable[[int, int], None]) -> Hull:
    """A tetrahedron, at once; two of its corners are cable 1's."""
    told(1, 2)
    corners = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 2.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    margin, cable = np.array([0.0, 0.0, 150.0, 150.0]), np.array([0, 1, 1, -1])
    words = f"{asked.robot.mass:g} kg{', roughly' * rough}"
    return Hull.of(corners, faces, margin, cable, np.zeros(4, dtype=bool), words)


class Maker:
    """Source of the hull."""

    hull = staticmethod(ball)


MAKER = Maker()


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagline.viewer.workspace.region_hull", lambda *arguments: MAKER.hull(*arguments))
        yield from shown(lambda server: Page(server, FEATURES, ROBOT, pose=POSE))


def show_of(page: Shown) -> RegionFeature:
    return page.viewer.feature(RegionFeature)


def meshes(page: Shown, name: str) -> list[Any]:
    """The meshes of one color each that a hull or a wall is drawn of."""
    found = (page.node(f"/{name}/{k}") for k in range(20))
    return [mesh for mesh in found if mesh is not None]


def choose(page: Shown, client: Client, **values: Any) -> None:
    """Set what has these names, and wait until it has been shown."""
    labels = {
        "hull": "Region", "by": "Region colored by", "slice": "Slice", "plane": "Plane", "ways": "Where can I go",
        "force": "Force ± [N]", "moment": "Moment ± [N m]",
    }  # fmt: skip
    for name, value in values.items():
        client.set(handle(page, labels[name]), value)
        await_that(partial(lambda own, wanted: own.value == wanted, handle(page, labels[name]), value))
    for _ in range(2):  # the first may have begun before
        before = page.viewer.updates
        page.viewer.refresh()
        await_that(partial(lambda seen: page.viewer.updates > seen, before))


@pytest.fixture
def client(page: Shown) -> Iterator[Client]:
    with Client(page.url) as one:
        yield one
        choose(page, one, hull=False, slice=False, ways=False, force=0.0, moment=0.0, plane="level")
        one.drag(POSE.position)
        await_that(lambda: np.array_equal(page.position, POSE.position))
        list(one.heard(0.1))  # what is not read holds up its leaving


@extended
def test_no_computation_before_a_request(page: Shown, client: Client) -> None:
    client.drag([0.5, 0.5, 2.0])
    await_that(lambda: page.position[0] == 0.5)
    assert not show_of(page).waiting
    assert all(page.node(name) is None for name in ("/slice/picture", "/hull/0", "/travel"))
    assert "Choose one" in page.text


def test_the_slice_follows_the_platform_and_ends_at_zero_margin(page: Shown, client: Client) -> None:
    choose(page, client, slice=True, force=50.0)
    client.drag([0.0, 0.0, 3.0])
    await_that(lambda: page.position[2] == 3.0)
    boundary, lines = page.node("/slice/boundary"), page.node("/slice/lines")
    await_that(lambda: bool(np.all(boundary.points[..., 2] == 3.0)))
    poses = sl.Pose.from_euler(boundary.points.reshape(-1, 3).astype(float), 0.0, 0.0, 0.0)
    away = np.abs(sl.margin(ROBOT, poses, LOADS).value)
    assert np.median(away) < 2.0  # N, between points that are 0.3 m apart
    scale = show_of(page)._scale.step
    on_lines = sl.margin(ROBOT, sl.Pose.from_euler(lines.points[:, 0].astype(float), 0.0, 0.0, 0.0), LOADS).value
    assert np.median(np.abs(on_lines / scale - np.rint(on_lines / scale))) < 0.02
    choose(page, client, plane="upright, along x")
    assert np.all(page.node("/slice/boundary").points[..., 1] == 0.0)
    assert "Margin [N]" in page.text


@extended
def test_a_slice_follows_a_drag_thirty_times_a_second(page: Shown, client: Client) -> None:
    def move(angle: float) -> None:
        client.drag([np.cos(angle), np.sin(angle), 2.0 + 0.5 * np.sin(angle)])

    choose(page, client, slice=False, ways=False, hull=False)
    asked = asked_beside(updates_a_second(page, client, move))
    choose(page, client, slice=True, ways=True, force=50.0)
    assert best_rate(lambda: updates_a_second(page, client, move, "/slice/picture", "_data"), asked) >= asked


@extended
def test_travel_ends_at_infeasible_poses(page: Shown, client: Client) -> None:
    choose(page, client, ways=True, force=50.0)
    arrows = page.node("/travel")
    assert arrows is not None
    ends = arrows.points[:, 1].astype(float)
    low = ends[:, 2] > 0.05  # not that which ends on the floor
    inward = 1e-3 * (POSE.position - ends) / np.linalg.norm(POSE.position - ends, axis=1, keepdims=True)
    for shift, feasible in ((inward, True), (-inward, False)):
        poses = sl.Pose.from_euler((ends + shift)[low], 0.0, 0.0, 0.0)
        assert np.all((sl.margin(ROBOT, poses, LOADS).value >= 0.0) == feasible)
    assert "<b>Margin</b>" in page.text


@extended
def test_the_hull_is_shown_on_request_with_the_colors_of_the_legend(page: Shown, client: Client) -> None:
    show = show_of(page)
    choose(page, client, hull=True)
    await_that(lambda: "50 kg<" in page.text)  # said once the hull in full is drawn
    assert [mesh.color for mesh in meshes(page, "hull")] == [cable_color(0), cable_color(1)]
    choose(page, client, by="margin")
    await_that(lambda: page.node("/hull/0").color == tuple(show._scale.colors(np.array(0.0)).tolist()))
    choose(page, client, slice=True)
    assert {mesh.side for mesh in meshes(page, "hull")} == {"back"}
    drawn = show._hull_key
    client.drag([2.0, 0.5, 2.0])
    await_that(lambda: page.position[0] == 2.0)
    assert show._hull_key == drawn  # where the platform is changes nothing
    half = 0.05
    client.drag([2.0, 0.5, 2.0], [np.cos(half), 0.0, 0.0, np.sin(half)])
    await_that(lambda: show._hull_key not in (drawn, None))  # how it is turned does
    choose(page, client, hull=False, by="limiting cable")
    assert meshes(page, "hull") == []


@extended
def test_a_hull_follows_a_slider_and_the_previous_one_stays_until_then(
    page: Shown, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    going, ended = threading.Event(), list[str]()

    def slow(asked: WorkspaceQuery, rough: bool, told: Callable[[int, int], None]) -> Hull:
        if asked.robot.mass == 60.0 and not rough:
            assert going.wait(PATIENCE)
            try:
                told(1, 2)
            except SaglineError:
                ended.append("given up")
                raise
        return ball(asked, rough, told)

    monkeypatch.setattr(MAKER, "hull", slow)
    mass = handle(page, "Platform + load [kg]")
    choose(page, client, hull=True)
    await_that(lambda: "50 kg<" in page.text)
    client.set(mass, 60.0)
    await_that(lambda: "60 kg, roughly" in page.text)  # nothing was asked for again
    assert len(meshes(page, "hull")) == 2
    client.set(mass, 70.0)
    await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.robot.mass == 70.0)
    assert "60 kg, roughly" in page.text
    going.set()
    await_that(lambda: "70 kg<" in page.text)
    assert ended == ["given up"]  # results that are no longer needed are not computed
    client.set(mass, 50.0)
    await_that(lambda: "50 kg<" in page.text)


@extended
def test_the_near_side_is_highlighted_with_its_margin(page: Shown, client: Client) -> None:
    choose(page, client, force=50.0, hull=True)
    await_that(lambda: "50 kg<" in page.text)  # the hull in full is drawn
    for place in ([1.0, 0.5, 2.0], [0.3, 0.3, 1.4]):  # the ball's tetrahedron ends at z = 1
        client.drag(place)
        await_that(partial(lambda where: np.array_equal(page.position, where), place))
        found = sl.margin(ROBOT, sl.Pose(place, np.eye(3)), LOADS)
        text = f"{found.value:.1f} N left, cable {found.limiting_cable}"
        await_that(partial(lambda said: page.node("/platform/left").text == said, text))
        assert text in page.text
    assert meshes(page, "wall") != []
    assert {mesh.color for mesh in meshes(page, "wall")} <= {cable_color(0), cable_color(1)}
    client.drag([-4.0, -3.0, 3.0])
    await_that(lambda: meshes(page, "wall") == [])
    choose(page, client, hull=False)
    assert not page.node("/platform/left").visible


@extended
def test_thirty_updates_a_second_while_a_region_follows_a_slider(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(MAKER, "hull", region_hull)
    robot = sl.load_robot("cogiro")
    with contextmanager(shown)(lambda server: Page(server, FEATURES, robot)) as page:
        mass = handle(page, "Platform + load [kg]")

        with Client(page.url) as client:

            def move(angle: float) -> None:
                client.set(mass, float(robot.mass * (1.1 + 0.2 * np.sin(angle))))

            rate = partial(updates_a_second, page, client, move)
            asked = asked_beside(rate())
            client.set(handle(page, "Region"), True)
            await_that(lambda: meshes(page, "hull") != [])
            assert best_rate(partial(rate, along="/hull/"), asked) >= asked  # it is to follow while the slider moves


@extended
def test_a_slow_hull_shows_its_progress(page: Shown, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    going = threading.Event()

    def slow(asked: WorkspaceQuery, rough: bool, told: Callable[[int, int], None]) -> Hull:
        told(1, 4)
        assert going.wait(PATIENCE)
        return ball(asked, rough, told)

    monkeypatch.setattr(MAKER, "hull", slow)
    monkeypatch.setattr("sagline.viewer.feature.PATIENCE", 0.1)
    choose(page, client, hull=True, force=7.0)
    await_that(lambda: "25 %" in page.text)
    choose(page, client, force=8.0)  # another is wanted meanwhile
    going.set()
    await_that(lambda: "50 kg<" in page.text)
    assert len(meshes(page, "hull")) == 2


@extended
@pytest.mark.parametrize("load", [-1.0, float("nan"), 1e300])
def test_invalid_loads_are_refused(page: Shown, client: Client, load: float) -> None:
    client.set(handle(page, "Force ± [N]"), load)
    client.set(handle(page, "Slice"), True)
    await_that(lambda: "Type a load" in page.text)
    assert page.node("/slice/picture") is None
    choose(page, client, force=10.0)
    await_that(lambda: page.node("/slice/picture") is not None)
    assert "Type a load" not in page.text


def test_a_planar_robot_is_sliced_in_its_plane() -> None:
    assert planes_of(ROBOT) == (2, 1, 0)
    assert planes_of(planar((0.0, 1.0, 0.0))) == (1,)

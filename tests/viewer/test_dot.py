"""The dot in the polygon of feasible tensions: its range, its tensions, and valid messages of a page."""

import json
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from html import unescape
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.features.state import code_of
from sagline.viewer.features.tensions import DotField, grouped, polygon_figure
from sagline.viewer.page import Page, Source, home_pose
from sagline.viewer.snapshot import BY_HAND, METHODS, ByHand, MethodMarks, Settings, Snapshot, snapshot_at
from tests.effort import best_rate
from tests.tiers import extended, wide
from tests.viewer.client import Client, await_that
from tests.viewer.platform_forces import unbalanced
from tests.viewer.shown import Shown, handle, shown, updates_a_second

HEAVY = sl.load_robot("cogiro").replace(
    cables=sl.Cable(linear_density=0.65, axial_stiffness=700e3), name="heavy cables", tension_max=900.0
)


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, HEAVY))


def say(page: Shown, client: Client, value: Any, topic: str = "dot") -> None:
    client.set(handle(page, "sagline"), json.dumps({"topic": topic, "value": value, "count": time.time()}))


def seen(page: Shown) -> Snapshot:
    view = page.viewer.view
    assert view is not None
    assert isinstance(view.snapshot, Snapshot)
    return view.snapshot


def moved(page: Shown, client: Client, value: Any) -> Snapshot:
    """Update of the page after a motion of the dot."""
    before = shown_way(page)
    say(page, client, value)
    await_that(lambda: shown_way(page) is not before and isinstance(shown_way(page), ByHand))
    return seen(page)


def shown_way(page: Shown) -> sl.TensionMethod:
    view = page.viewer.view
    assert view is not None
    return view.settings.tension


def nearest_by_program(polygon: sl.TensionPolygon, low: Any, high: Any, at: np.ndarray) -> np.ndarray:
    """The nearest feasible coordinates, by a general solver from limits alone."""
    size = float(np.abs(polygon.vertices).max())  # in whose shares the solver works
    limits = [
        {"type": "ineq", "fun": lambda x: (polygon.origin - low) / size + x @ polygon.basis},
        {"type": "ineq", "fun": lambda x: (high - polygon.origin) / size - x @ polygon.basis},
    ]
    found = minimize(
        lambda x: ((x - at / size) ** 2).sum(), np.zeros(at.size), jac=lambda x: 2.0 * (x - at / size),
        constraints=limits, method="SLSQP", options={"ftol": 1e-16, "maxiter": 400},
    )  # fmt: skip
    return size * np.asarray(found.x)


@pytest.mark.parametrize("name", ["cogiro", "falcon-7", "ipanema-1"])
def test_the_dot_stays_at_the_nearest_feasible_point(name: str) -> None:
    robot, generator = sl.load_robot(name), np.random.default_rng(3)
    field = DotField.of(snapshot_at(robot, home_pose(robot), Settings(mass=robot.mass), None))
    assert field is not None
    polygon = field.polygon
    for _ in range(10):
        at = generator.uniform(-3.0, 3.0, field.redundant) * (field.high - field.low) + field.middle
        expected = nearest_by_program(polygon, robot.tension_min, robot.tension_max, at)
        size = float(np.max(field.high - field.low))
        assert field.nearest(at) == pytest.approx(expected, abs=1e-5 * size)
        inside = polygon.origin + field.nearest(at) @ polygon.basis
        assert np.all(inside >= robot.tension_min - 1e-9 * robot.tension_max)
        assert np.all(inside <= robot.tension_max * (1.0 + 1e-9))


def test_an_unbounded_polygon_is_drawn_up_to_the_known_points() -> None:
    robot = sl.load_robot("ipanema-1").replace(tension_max=np.inf)
    snapshot = snapshot_at(robot, home_pose(robot), Settings(mass=robot.mass), None)
    field = DotField.of(snapshot)
    assert field is not None
    assert None in field.sides
    assert np.ptp(field.corners, axis=0).max() < 5e3  # not the 1e5 N that represent infinity
    for corner, side, after in zip(field.corners, field.sides, np.roll(field.corners, -1, axis=0), strict=True):
        tension = field.polygon.origin + 0.5 * (corner + after) @ field.polygon.basis
        at_limit = np.isclose(tension, robot.tension_min, atol=1e-6)
        assert at_limit.any() == (side is not None)
        if side is not None:
            assert at_limit[side.cable]
    one = sl.load_robot("falcon-7").replace(tension_max=np.inf)
    line = DotField.of(snapshot_at(one, home_pose(one), Settings(mass=one.mass), None))
    assert line is not None
    assert np.isfinite(line.corners).all()


@extended
def test_chosen_tensions_are_feasible_with_heavy_cables(page: Shown) -> None:
    generator = np.random.default_rng(4)
    with Client(page.url) as client:
        field = DotField.of(seen(page))
        assert field is not None
        pulls = []
        for _ in range(12):
            at = generator.uniform(field.low, field.high) * 1.3
            snapshot = moved(page, client, {"at": at.tolist()})
            plan = snapshot.plan
            assert plan is not None
            assert plan.feasible
            assert isinstance(plan.tension, ByHand)
            scale = float(snapshot.tension.max())
            assert float(plan.wrench_residual.max()) < 1e-8 * scale  # N
            force, moment = unbalanced(plan.state)
            assert force < 1e-7 * scale
            assert moment < 1e-7 * scale
            assert np.all(snapshot.tension >= HEAVY.tension_min - 1e-9 * scale)
            assert np.all(snapshot.tension <= HEAVY.tension_max + 1e-9 * scale)
            drawn = DotField.of(snapshot)
            assert drawn is not None
            assert drawn.polygon.coordinates(snapshot.tension) == pytest.approx(drawn.nearest(at), abs=1e-2 * scale)
            pulls.append(plan.state.pull)
        assert np.ptp(pulls, axis=0).max() > 0.05  # the weight of the cables does count
        assert BY_HAND in snapshot.origin


def test_copied_code_gives_the_chosen_tensions(page: Shown) -> None:
    with Client(page.url) as client:
        snapshot = moved(page, client, {"at": [120.0, -60.0]})
        view = page.viewer.view
        assert view is not None
        made: dict[str, Any] = {}
        lines = code_of(view, HEAVY, Source("given"))
        exec(lines, {"given": HEAVY}, made)
        np.testing.assert_array_equal(made["tension"], snapshot.tension)


def test_steps_add_up_and_stop_at_the_limits() -> None:
    with contextmanager(shown)(lambda server: Page(server, FEATURES, HEAVY)) as page, Client(page.url) as client:
        field = DotField.of(seen(page))  # as large as the first at a pose are the steps there
        assert field is not None
        start = moved(page, client, {"at": [0.0, 0.0]})
        for _ in range(5):
            snapshot = moved(page, client, {"by": [0.01, 0.0]})
        size = float(np.max(field.high - field.low))
        assert field.polygon.basis @ (snapshot.tension - start.tension) == pytest.approx([0.05 * size, 0.0], abs=1e-6)
        for _ in range(3):
            snapshot = moved(page, client, {"by": [1.0, 0.0]})
        at_limit = np.minimum(snapshot.tension - HEAVY.tension_min, HEAVY.tension_max - snapshot.tension).min()
        assert at_limit == pytest.approx(0.0, abs=1e-6)
        back = moved(page, client, {"by": [-0.02, 0.0]})
        assert np.linalg.norm(back.tension - snapshot.tension) > 0.015 * size  # it does not stick to the side


def test_one_redundant_cable_has_one_coordinate() -> None:
    robot = sl.load_robot("falcon-7")
    with contextmanager(shown)(lambda server: Page(server, FEATURES, robot)) as page, Client(page.url) as client:
        field = DotField.of(seen(page))
        assert field is not None
        size = float(np.max(field.high - field.low))
        start = moved(page, client, {"at": [float(field.polygon.vertices.mean())]})
        snapshot = moved(page, client, {"by": [0.01, 0.0]})
        assert field.polygon.basis @ (snapshot.tension - start.tension) == pytest.approx([0.01 * size], rel=1e-6)


def test_a_drag_keeps_the_nearest_tensions_to_the_chosen_ones(page: Shown) -> None:
    with Client(page.url) as client:
        chosen = moved(page, client, {"at": [150.0, 80.0]}).tension
        client.grab()
        for place in ([0.4, 0.3, 2.4], [2.5, 1.0, 1.5]):
            client.drag(place)
            await_that(lambda place=place: np.array_equal(page.position, place))  # type: ignore[misc]
            snapshot = seen(page)
            assert snapshot.plan is not None
            assert snapshot.plan.feasible
            field = DotField.of(snapshot)
            assert field is not None
            wanted = field.polygon.basis @ chosen
            expected = nearest_by_program(field.polygon, HEAVY.tension_min, HEAVY.tension_max, wanted)
            assert field.polygon.coordinates(snapshot.tension) == pytest.approx(expected, abs=0.05)
        client.drag(home_pose(HEAVY).position)
        await_that(lambda: np.allclose(seen(page).tension, chosen, rtol=0.0, atol=1e-6))  # and back again


def test_a_mark_chooses_its_method_and_the_list_shows_it(page: Shown) -> None:
    with Client(page.url) as client:
        moved(page, client, {"at": [10.0, 10.0]})
        method = handle(page, "Tensions")
        assert method.value == BY_HAND
        for name in ("Centroid", "AnalyticCenter", "LowestSum"):
            say(page, client, name, "sharing")
            await_that(lambda name=name: shown_way(page) is METHODS[name])  # type: ignore[misc]
            snapshot = seen(page)
            assert method.value == name
            plan = sl.inverse(HEAVY, snapshot.pose, tension=METHODS[name])
            assert snapshot.tension == pytest.approx(plan.chord_tension, rel=1e-9)
        client.set(method, BY_HAND)  # the list leads back to them
        await_that(lambda: isinstance(shown_way(page), ByHand))
        client.set(method, "MinimumNorm")
        await_that(lambda: isinstance(shown_way(page), sl.MinimumNorm))


@pytest.mark.parametrize(
    "value",
    wide([{"at": [1e300, 0.0]}, None, 3, "x", [], {}, {"at": None}, {"at": [1.0]}, {"at": ["a", "b"]},
     {"by": [True, 1]}, {"at": [[1.0], 2.0]}, {"by": [float("nan"), 0.0]}, {"at": {"0": 1.0}}]),
)  # fmt: skip
def test_invalid_places_are_ignored(page: Shown, value: Any) -> None:
    with Client(page.url) as client:
        before = moved(page, client, {"at": [5.0, 5.0]}).tension
        say(page, client, value)
        say(page, client, value, "sharing")
        say(page, client, "NoSuchWay", "sharing")
        after = moved(page, client, {"by": [0.0, 0.0]}).tension
        np.testing.assert_allclose(after, before, rtol=1e-12)
    assert page.thread.is_alive()


def test_marks_are_at_the_results_of_their_methods() -> None:
    robot = sl.load_robot("article-suspended")
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    snapshot = snapshot_at(robot, pose, Settings(mass=50.0), None)
    field, found = DotField.of(snapshot), MethodMarks()
    assert field is not None
    assert snapshot.plan is not None
    marks = found.at(snapshot.plan)
    assert [mark.name for mark in marks] == list(METHODS)
    assert found.at(snapshot.plan) is marks
    html = polygon_figure(snapshot, marks, field)
    places = grouped(marks, field)
    assert sorted(mark.name for _, group in places for mark in group) == sorted(
        mark.name for mark in marks if not mark.missing
    )
    for (x, y), group in places:
        plan = sl.inverse(robot, pose, tension=METHODS[group[0].name])
        where = field.polygon.basis @ (plan.chord_tension - field.polygon.origin)
        assert [x, y] == pytest.approx(field.place(where), abs=1e-6)
        assert f'data-value="{group[0].name}"' in unescape(html)


def changed(name: str) -> sl.Robot:
    """A preset, another object each time; "guides" has some behind its anchors."""
    if name != "guides":
        return sl.load_robot(name).replace(notes="")
    robot = sl.load_robot("cogiro")
    guide = np.broadcast_to([[0.1, 0.0, -0.6]], (8, 1, 3)) + robot.frame_anchors[:, None]
    return robot.replace(winches=sl.Winch(guides=guide))


@pytest.mark.parametrize("name", wide(["cogiro", "guides", "ipanema-2-pulleys", "article-suspended"], 2))
def test_marks_of_a_moved_robot_agree_with_a_new_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the second pose on solvers answer, which know no guides; another robot has none at first."""
    robot, moved, calls, here = changed(name), MethodMarks(), list[sl.Pose](), threading.get_ident()

    def counted(*arguments: Any, **settings: Any) -> sl.Plan:
        if threading.get_ident() == here:  # not the thread of a page that is served
            calls.append(arguments[1])
        return sl.inverse(*arguments, **settings)

    monkeypatch.setattr("sagline.viewer.snapshot.inverse", counted)
    home, load = home_pose(robot), np.array([30.0, -20.0, -50.0, 4.0, 2.0, -1.0])
    for k, away in enumerate(([0.0, 0.0, 0.0], [0.4, 0.1, 0.2], [-0.5, 0.3, -0.1], [2.4, 1.3, 0.6])):
        pose = sl.Pose.from_euler(home.position + away, 0.02 * k, -0.03, 0.05)
        plan = sl.inverse(robot, pose, wrench=load)
        calls.clear()
        marks = moved.at(plan)
        assert len(calls) == (0 if k and name != "guides" else len(METHODS))
        for mark, expected in zip(marks, MethodMarks().at(plan), strict=True):
            assert (mark.name, mark.letter, mark.missing) == (expected.name, expected.letter, expected.missing)
            np.testing.assert_array_equal(mark.tension, expected.tension)
    other = sl.inverse(changed(name), home)
    calls.clear()
    moved.at(other)
    assert len(calls) == len(METHODS)


def test_methods_without_a_result_are_listed() -> None:
    robot = sl.load_robot("article-suspended")
    pose = sl.Pose([5.0, 3.0, 2.2], np.eye(3))
    snapshot = snapshot_at(robot, pose, Settings(mass=50.0), None)
    assert snapshot.plan is not None
    assert not sl.inverse(robot, pose, tension=sl.ClosedForm()).feasible
    marks = MethodMarks().at(snapshot.plan)
    missing = {mark.name: mark.missing for mark in marks if mark.missing}
    assert "ClosedForm" in missing
    html = polygon_figure(snapshot, marks, DotField.of(snapshot))
    assert re.search(r"ClosedForm: none", html)


def test_the_polygon_does_not_move_with_the_dot() -> None:
    settings = Settings(mass=HEAVY.mass)
    first = DotField.of(snapshot_at(HEAVY, home_pose(HEAVY), settings, None))
    assert isinstance(first, DotField)
    hand = ByHand(target=first.tension(first.corners[0]))
    second = DotField.of(snapshot_at(HEAVY, home_pose(HEAVY), Settings(mass=HEAVY.mass, tension=hand), None), first)
    assert second is not None
    assert second.scale == first.scale
    np.testing.assert_array_equal(second.middle, first.middle)
    assert not np.array_equal(second.corners, first.corners)  # other pulls: another polygon


@extended
def test_thirty_tensions_a_second_follow_the_dot(page: Shown) -> None:
    with Client(page.url) as client:

        def move(angle: float) -> None:
            say(page, client, {"at": [100.0 * np.cos(angle), 100.0 * np.sin(angle)]})

        assert best_rate(lambda: updates_a_second(page, client, move), 30.0) >= 30.0

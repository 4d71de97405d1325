"""Missing forces at infeasible poses compared with linear programs, and the nearest pose compared with many trials."""

import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from html import unescape

import numpy as np
import pytest
from scipy.optimize import linprog

import sagline as sl
from sagline.core.arrays import locked
from sagline.viewer.features import FEATURES
from sagline.viewer.features.missing import NearestFeasible, explanation, missing_label, nearest_feasible
from sagline.viewer.page import Page, home_pose
from sagline.viewer.readout import chosen_by
from sagline.viewer.server import PageServer
from sagline.viewer.snapshot import MissingWrench, Settings, Snapshot, snapshot_at
from sagline.viewer.tension_scale import ForceUnit
from tests.effort import best_rate
from tests.tiers import extended, wide
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.planar import PLANAR
from tests.viewer.platform_forces import unbalanced
from tests.viewer.shown import Shown, shown, updates_a_second
from tests.viewer.test_dot import say

OUTSIDE = {  # poses that no force within the limits holds, but with another force
    "cogiro": [[6.3, 2.1, 5.4], [0.0, 0.0, 6.5], [9.5, 0.0, 2.0]],
    "falcon-7": [[0.6, 0.28, 1.25], [0.0, 0.9, 0.6]],
    "ipanema-2-pulleys": [[4.5, 0.0, 2.0]],
}
FIRST = [(name, places[0]) for name, places in OUTSIDE.items()]  # one of each robot
CASES = FIRST + [(name, place) for name, places in OUTSIDE.items() for place in places[1:]]


def at(robot: sl.Robot, pose: sl.Pose) -> Snapshot:
    return snapshot_at(robot, pose, Settings(mass=robot.mass), None)


def directions(count: int) -> np.ndarray:
    """Evenly over all (Fibonacci's lattice), shape (count, 3)."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    return np.column_stack((np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z))


def least_force(state: sl.Equilibrium, given: np.ndarray, count: int = 1500) -> tuple[float, bool]:
    """A lower bound of the least force that would do with the cables' pulls as they are, by HiGHS; and if one would."""
    robot = state.one_robot
    matrix, m = sl.structure_matrix(robot, state.pose), robot.cable_count
    supplied = -given
    supplied[2] += robot.mass * robot.gravity
    arm = state.pose.rotation.apply(robot.platform_anchors - robot.center_of_mass)
    down = np.column_stack((np.zeros((m, 2)), -state.pull))
    supplied -= np.concatenate((down.sum(axis=0), np.cross(arm, down).sum(axis=0)))
    assert matrix.shape[0] == 6
    equal = np.hstack((matrix, np.vstack((np.eye(3), np.zeros((3, 3)))), np.zeros((6, 1))))
    reach = np.hstack((np.zeros((count, m)), directions(count), -np.ones((count, 1))))
    limits = [*zip(robot.tension_min, robot.tension_max, strict=True), *[(None, None)] * 3, (0.0, None)]
    cost = np.zeros(m + 4)
    cost[-1] = 1.0
    found = linprog(cost, A_ub=reach, b_ub=np.zeros(count), A_eq=equal, b_eq=supplied, bounds=limits, method="highs")
    return float(found.fun) if found.success else np.inf, bool(found.success)


@pytest.mark.parametrize(("name", "place"), wide(CASES, len(FIRST)))
def test_the_missing_force_agrees_with_a_linear_program(name: str, place: list[float]) -> None:
    robot = sl.load_robot(name)
    snapshot = at(robot, sl.Pose(place, np.eye(3)))
    missing = MissingWrench.of(snapshot)
    assert missing is not None
    assert snapshot.plan is not None
    size = float(np.linalg.norm(missing.force))
    assert size == pytest.approx(float(snapshot.plan.shortfall), rel=1e-6)
    bound, found = least_force(missing.state, np.zeros(6))
    assert found
    assert bound <= size * (1.0 + 1e-6)
    assert size <= bound / np.cos(0.06) * 1.001  # directions are that near to each other
    force, moment = unbalanced(missing.state)  # with it the platform is at rest
    assert force < 1e-6 * missing.state.chord_tension.max()
    assert moment < 1e-6 * missing.state.chord_tension.max()
    np.testing.assert_allclose(missing.state.wrench, missing.wrench)
    assert f"{ForceUnit.of(robot).written(size)} missing" == missing_label(missing, ForceUnit.of(robot))


@pytest.mark.parametrize(("name", "place"), wide(CASES, len(FIRST)))
def test_blocking_cables_are_at_limits_that_would_help(name: str, place: list[float]) -> None:
    robot = sl.load_robot(name)
    snapshot = at(robot, sl.Pose(place, np.eye(3)))
    missing = MissingWrench.of(snapshot)
    assert missing is not None
    assert missing.limits
    before = float(np.linalg.norm(missing.force))
    for cable, lower in missing.limits.items():
        limit = (robot.tension_min if lower else robot.tension_max)[cable]
        assert missing.state.chord_tension[cable] == pytest.approx(limit, rel=2e-3)
        low, high = robot.tension_min.copy(), robot.tension_max.copy()
        if lower:
            low[cable] *= 0.9
        else:
            high[cable] *= 1.1
        wider = MissingWrench.of(at(robot.replace(tension_min=low, tension_max=high), snapshot.pose))
        assert wider is not None
        assert np.linalg.norm(wider.force) < before


def test_a_moment_is_shown_if_no_force_is_sufficient() -> None:
    robot = sl.load_robot("ipanema-1")
    pose = sl.Pose.from_euler(home_pose(robot).position, 0.0, np.radians(80.0), np.radians(40.0))
    snapshot = at(robot, pose)
    assert snapshot.plan is not None
    assert np.isinf(snapshot.plan.shortfall)
    missing = MissingWrench.of(snapshot)
    assert missing is not None
    assert not least_force(missing.state, np.zeros(6), 50)[1]
    assert least_force(missing.state, missing.wrench * (1.0 + 1e-7), 50)[0] < 1e-3 * np.linalg.norm(missing.force)
    force, moment = unbalanced(missing.state)
    assert max(force, moment) < 1e-6 * missing.state.chord_tension.max()
    text = re.sub(r"<[^>]+>", " ", unescape(explanation(snapshot, missing, None, searching=False)))
    told = re.search(r"with moment\s+([\d.,]+)\sN", text)
    assert told is not None
    assert float(told[1].replace(",", "")) == pytest.approx(np.linalg.norm(missing.moment), rel=1e-3)


@pytest.mark.parametrize(("name", "place"), wide([case for case in CASES if "pulleys" not in case[0]]))
def test_no_nearer_pose_is_feasible(name: str, place: list[float]) -> None:
    robot, generator = sl.load_robot(name), np.random.default_rng(8)
    pose = sl.Pose(place, np.eye(3))
    nearest = nearest_feasible(robot, pose, sl.Catenary(), None)
    assert nearest is not None
    assert not nearest.turned
    assert sl.inverse(robot, nearest.pose).feasible
    assert nearest.distance == pytest.approx(np.linalg.norm(nearest.pose.position - pose.position))
    ways = generator.normal(size=(1500, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    share = 0.97 * generator.uniform(0.0, 1.0, (1500, 1)) ** (1.0 / 3.0)
    tried = pose.position + nearest.distance * share * ways
    plan = sl.inverse(robot, sl.Pose(tried, np.broadcast_to(np.eye(3), (1500, 3, 3))), tension=sl.MinimumNorm())
    assert not plan.feasible.any()


def test_a_platform_with_an_infeasible_rotation_is_leveled() -> None:
    robot = sl.load_robot("ipanema-1")
    pose = sl.Pose.from_euler(home_pose(robot).position, 0.0, np.radians(80.0), np.radians(40.0))
    assert not at(robot, pose).feasible
    nearest = nearest_feasible(robot, pose, sl.Catenary(), None)
    assert nearest is not None
    assert nearest.turned
    assert nearest.distance < 1e-3
    assert sl.inverse(robot, nearest.pose).feasible


def test_a_load_is_considered() -> None:
    robot = sl.load_robot("cogiro")
    load = locked(np.array([0.0, 0.0, 1e5, 0.0, 0.0, 0.0]))
    pose = sl.Pose([0.0, 0.0, 2.0], np.eye(3))
    snapshot = snapshot_at(robot, pose, Settings(mass=robot.mass), None, wrench=load)
    missing = MissingWrench.of(snapshot)
    assert missing is not None
    weight = robot.mass * robot.gravity
    assert -missing.force[2] > 1e5 - 60.0 * weight  # cables from above hardly pull down
    assert nearest_feasible(robot, pose, sl.Catenary(), load) is None
    assert "none within" in explanation(snapshot, missing, None, searching=False)


def test_a_planar_robot_is_explained_in_its_plane() -> None:
    pose = sl.Pose([2.0, 0.0, 3.5], np.eye(3))
    missing = MissingWrench.of(at(PLANAR, pose))
    assert missing is not None
    assert missing.force[1] == 0.0
    assert missing.force[2] > 0.0
    nearest = nearest_feasible(PLANAR, pose, sl.Catenary(), None)
    assert nearest is not None
    assert nearest.pose.position[1] == 0.0
    assert nearest.pose.position[2] < 3.0


def test_other_reasons_are_explained() -> None:
    robot = sl.load_robot("article-suspended")
    far = sl.Pose([5.0, 3.0, 2.2], np.eye(3))
    settings = Settings(mass=50.0, tension=sl.ClosedForm())
    html = explanation(snapshot_at(robot, far, settings, None), None, None, searching=False)
    assert chosen_by("sharing", "AnalyticCenter") in html
    anchor = sl.Pose(robot.frame_anchors[0] - robot.platform_anchors[0], np.eye(3))
    lost = at(robot, anchor)
    assert lost.plan is None
    nearest = nearest_feasible(robot, anchor, sl.Catenary(), None)
    assert isinstance(nearest, NearestFeasible)
    assert "Go there" in explanation(lost, MissingWrench.of(lost), nearest, searching=False)
    upside = sl.Pose([1.0, 0.5, 6.0], np.eye(3))  # cables level
    singular = at(robot, upside)
    if singular.status is sl.PoseStatus.SINGULAR:
        assert "Unconstrained motion" in explanation(singular, None, None, searching=True)


def test_the_text_states_a_running_search(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = threading.Event()
    monkeypatch.setattr("sagline.viewer.features.missing.nearest_feasible", lambda *_: ended.wait(PATIENCE) and None)

    def made(server: PageServer) -> Page:
        pose = sl.Pose(OUTSIDE["cogiro"][0], np.eye(3))
        return Page(server, FEATURES, sl.load_robot("cogiro"), pose=pose)

    with contextmanager(shown)(made) as page:
        assert "searching" in page.text
        assert "none within" not in page.text
        view = page.viewer.view
        assert view is not None
        assert view.missing is not None
        for k, (cable, lower) in enumerate(view.missing.limits.items()):
            found = re.findall(r"\d+|lower|upper", page.node(f"/limits_names/{k}").text)
            assert found == [str(cable), "lower" if lower else "upper"]
        ended.set()
        await_that(lambda: "none within" in page.text)


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, sl.load_robot("cogiro")))


@extended
def test_the_platform_moves_to_the_feasible_pose(page: Shown) -> None:
    with Client(page.url) as client:
        client.grab()
        client.drag([6.3, 2.1, 5.4])
        await_that(lambda: page.viewer.view is not None and not page.viewer.view.snapshot.feasible)
        texts: list[str] = []
        for message in client.heard(20.0):
            texts += [unescape(str(message.get("updates", {}).get("content", "")))]
            if "Go there" in texts[-1]:
                break
        assert any("Missing force" in text for text in texts)
        say(page, client, "", "go-there")
        await_that(lambda: page.viewer.view is not None and page.viewer.view.snapshot.feasible)
        robot = page.viewer.robot
        pose = nearest_feasible(robot, sl.Pose([6.3, 2.1, 5.4], np.eye(3)), sl.Catenary(), None)
        assert pose is not None
        assert page.position == pytest.approx(pose.pose.position, abs=1e-9)
        before = page.position
        say(page, client, "", "go-there")  # there is nowhere to go from here
        say(page, client, {"x": 1}, "go-there")
        time.sleep(0.3)
        np.testing.assert_array_equal(page.position, before)


@pytest.mark.soak
def test_thirty_explanations_a_second(page: Shown) -> None:
    with Client(page.url) as client:

        def move(angle: float) -> None:
            client.drag([6.3 + 0.3 * np.cos(angle), 2.1 + 0.3 * np.sin(angle), 5.4])

        assert best_rate(lambda: updates_a_second(page, client, move, "/missing"), 30.0) >= 30.0

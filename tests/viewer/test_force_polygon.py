"""Forces on the platform: forces of catenaries close the polygon; drawings and texts."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.features.proof import force_polygon_figure, forces_on_platform, residual
from sagline.viewer.page import Page, home_pose
from sagline.viewer.snapshot import MissingWrench, Settings, snapshot_at
from sagline.viewer.tension_scale import ForceUnit
from tests.tiers import wide
from tests.viewer.client import Client, await_that
from tests.viewer.planar import PLANAR
from tests.viewer.platform_forces import pulled
from tests.viewer.shown import Shown, handle, shown
from tests.viewer.test_dot import HEAVY

LOAD = np.array([60.0, -40.0, -200.0, 5.0, 3.0, -2.0])
ROW = r"<td><span[^>]*></span> (\w+)</td>((?:<td>[^<]*</td>)+)"
ARROW = r'<line x1="([\d.-]+)" y1="([\d.-]+)" x2="([\d.-]+)" y2="([\d.-]+)"[^>]*/><polygon points="([\d.-]+),([\d.-]+) '


def held(robot: sl.Robot, away: tuple[float, float, float] = (0.4, 0.3, -0.3)) -> sl.Equilibrium:
    pose = sl.Pose.from_euler(home_pose(robot).position + away, 0.05, -0.03, 0.02)
    plan = sl.inverse(robot, pose, wrench=LOAD)
    assert plan.feasible
    return plan.state


@pytest.mark.parametrize("robot", [HEAVY, sl.load_robot("cogiro"), sl.load_robot("ipanema-2-pulleys")])
def test_forces_are_tangent_to_the_catenaries(robot: sl.Robot) -> None:
    state = held(robot)
    expected = pulled(state)
    forces = {each.name: each.wrench[:3] for each in forces_on_platform(state)}
    found = [forces[str(k)] for k in range(robot.cable_count)]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-7 * np.abs(expected).max())
    if robot is HEAVY:  # and not of their chords
        ends = state.pose.transform(robot.platform_anchors)
        chords = (state.exit_point - ends) / np.linalg.norm(state.exit_point - ends, axis=1, keepdims=True)
        assert np.abs(state.chord_tension[:, None] * chords - expected).max() > 10.0


def test_forces_close_with_weight_and_load() -> None:
    state = held(HEAVY)
    pulls = forces_on_platform(state)
    assert [each.name for each in pulls][-2:] == ["weight", "load"]
    assert sorted(each.name for each in pulls[:-2]) == [str(k) for k in range(8)]
    force, moment = residual(state, pulls)
    scale = float(state.chord_tension.max())
    assert force < 1e-9 * scale
    assert moment < 1e-9 * scale
    np.testing.assert_allclose(pulls[-1].wrench[:3], LOAD[:3])
    np.testing.assert_allclose(pulls[-1].wrench[3:], LOAD[3:])
    center = state.pose.transform(HEAVY.center_of_mass)
    for each in pulls[:-2]:
        assert each.wrench[3:] == pytest.approx(np.cross(each.at - center, each.wrench[:3]))
    away = forces_on_platform(state)[:-1]  # without the load they do not
    assert residual(state, away) == pytest.approx((np.linalg.norm(LOAD[:3]), np.linalg.norm(LOAD[3:])), rel=1e-6)


def arrows(html: str) -> list[np.ndarray]:
    """Starts and ends of the arrows of each view [px], y up, shape (k, 2, 2)."""
    views = []
    for svg in re.findall(r"<svg.*?</svg>", html):
        found = np.array(re.findall(ARROW, svg), dtype=float)
        views.append(np.stack((found[:, :2], found[:, 4:]), axis=1) * [1.0, -1.0])
    return views


def test_arrows_are_head_to_tail_with_the_lengths_of_forces() -> None:
    state = held(HEAVY)
    pulls = forces_on_platform(state)
    html = force_polygon_figure(state)
    views = arrows(html)
    assert len(views) == 2
    named = re.findall(r'aria-label="forces on the platform head to tail, (\w) to the right, (\w) up"', html)
    for view, names in zip(views, named, strict=True):
        axes = ["xyz".index(name) for name in names]
        forces = np.array([each.wrench[axes] for each in pulls])
        forces = forces[np.linalg.norm(forces, axis=1) > 1e-9]  # the weight, from above
        scale = np.linalg.norm(view[:, 1] - view[:, 0]) / np.linalg.norm(forces)
        np.testing.assert_allclose(view[1:, 0], view[:-1, 1], atol=0.11)
        np.testing.assert_allclose(view[-1, 1], view[0, 0], atol=0.11)  # it closes
        np.testing.assert_allclose(view[:, 1] - view[:, 0], scale * forces, atol=0.2)


def names_in(html: str) -> Iterator[list[np.ndarray]]:
    """The boxes of the names of arrows in each view [px], as large as a wide font has them: low and high corner."""
    for svg in re.findall(r"<svg.*?</svg>", html):
        found = re.findall(r'<text x="([\d.-]+)" y="([\d.-]+)" text-anchor="middle">(\w+)</text>', svg)
        middles = [np.array([float(x), float(y) - 4.0]) for x, y, _ in found]
        halves = [np.array([3.7 * len(name), 5.4]) for *_, name in found]
        yield [np.array([middle - half, middle + half]) for middle, half in zip(middles, halves, strict=True)]


@pytest.mark.parametrize("name", wide(sl.robot_names(), 3))
def test_names_of_arrows_do_not_overlap(name: str) -> None:
    robot = sl.load_robot(name)
    plan = sl.inverse(robot, home_pose(robot))
    for boxes in names_in(force_polygon_figure(plan.state)):
        assert len(boxes) > 3
        for k, (low, high) in enumerate(boxes):
            assert low[0] >= -0.1
            assert high[0] <= 340.1
            for other in boxes[:k]:
                assert (np.minimum(high, other[1]) - np.maximum(low, other[0])).min() <= 0.0


def test_numbers_agree_with_the_cables() -> None:
    state = held(HEAVY)
    rows = dict(re.findall(ROW, force_polygon_figure(state)))
    expected, arm = pulled(state), state.pose.rotation.apply(HEAVY.platform_anchors - HEAVY.center_of_mass)
    for k in range(8):
        numbers = [float(cell) for cell in re.findall(r"<td>([^<]*)</td>", rows[str(k)])]
        np.testing.assert_allclose(numbers, [*expected[k], *np.cross(arm[k], expected[k])], atol=0.0501)
    assert rows["weight"].startswith(f"<td>0.0</td><td>0.0</td><td>{-HEAVY.mass * HEAVY.gravity:.1f}</td>")
    assert re.search(r"sum</td>(<td>0\.0</td>){6}</tr>", force_polygon_figure(state))


@pytest.mark.parametrize("name", wide(sl.robot_names(), 3))
def test_the_largest_force_has_three_digits_at_least(name: str) -> None:
    robot = sl.load_robot(name)
    state = sl.inverse(robot, home_pose(robot)).state
    rows = re.findall(ROW, force_polygon_figure(state))
    forces = np.array([[float(cell) for cell in re.findall(r"<td>([^<]*)</td>", cells)][:3] for _, cells in rows])
    expected = np.array([each.wrench[:3] for each in sorted(forces_on_platform(state), key=lambda each: each.name)])
    expected /= ForceUnit.of(robot).newtons
    np.testing.assert_allclose(forces, expected, rtol=0.0, atol=6e-4 * np.abs(expected).max())


def test_the_gap_is_the_missing_force() -> None:
    robot = sl.load_robot("cogiro")
    snapshot = snapshot_at(robot, sl.Pose([6.3, 2.1, 5.4], np.eye(3)), Settings(mass=robot.mass), None)
    missing = MissingWrench.of(snapshot)
    assert missing is not None
    pulls = forces_on_platform(missing.state, missing.wrench)
    assert [each.name for each in pulls][-2:] == ["weight", "missing"]
    others = pulled(missing.state).sum(axis=0) - np.array([0.0, 0.0, robot.mass * robot.gravity])
    np.testing.assert_allclose(pulls[-1].wrench[:3], -others, atol=1e-6 * missing.state.chord_tension.max())
    html = force_polygon_figure(missing.state, missing.wrench)
    assert 'class="gap"' in html
    told = re.search(r"The gap is the missing force, ([\d.]+).(k?)N", html)
    assert told is not None
    size = float(told[1]) * (1e3 if told[2] else 1.0)
    assert size == pytest.approx(np.linalg.norm(others), rel=6e-4)


def test_a_platform_that_cannot_turn_has_no_moments() -> None:
    robot = sl.load_robot("cogiro").replace(motion_pattern="3T")
    plan = sl.inverse(robot, home_pose(robot))
    assert plan.feasible
    html = force_polygon_figure(plan.state)
    assert "M<sub>" not in html
    assert "N m" not in html
    assert residual(plan.state, forces_on_platform(plan.state))[0] < 1e-6
    flat = held_planar()
    assert len(arrows(force_polygon_figure(flat))) == 1


def test_level_forces_are_drawn_from_above() -> None:
    anchors = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
    level = sl.Robot(
        name="level", frame_anchors=anchors, platform_anchors=(anchors - [2.0, 2.0, 0.0]) * [-0.1, 0.1, 0.0], mass=10.0,
        cables=sl.Cable(linear_density=0.02, axial_stiffness=1e5), tension_min=5.0, tension_max=300.0, gravity=0.0,
        inertia=np.eye(3), motion_pattern="1R2T", plane_normal=[0.0, 0.0, 1.0],
    )  # fmt: skip
    plan = sl.inverse(level, sl.Pose([2.0, 2.0, 0.0], np.eye(3)))
    assert plan.feasible
    html = force_polygon_figure(plan.state)
    (places,) = {html.split('aria-label="')[1].split('"')[0]}
    assert re.findall(r"\b([xyz]) ", places) == ["x", "y"]  # to the right and up
    assert all(np.isfinite([float(x) for x in each]).all() for each in re.findall(ARROW, html))


def held_planar() -> sl.Equilibrium:
    return sl.inverse(PLANAR, sl.Pose([2.2, 0.0, 1.4], np.eye(3))).state


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, sl.load_robot("falcon-7")))


def test_arrows_in_the_scene_are_shown_and_hidden(page: Shown) -> None:
    wanted = handle(page, "Forces in the scene")
    with Client(page.url) as client:
        client.replayed()
        client.set(wanted, True)
        await_that(lambda: page.node("/forces") is not None)
        points = page.node("/forces").points
        view = page.viewer.view
        assert view is not None
        assert isinstance(view.snapshot.robot, sl.Robot)
        state = view.snapshot.plan.state  # type: ignore[union-attr]
        forces = np.array([each.wrench[:3] for each in forces_on_platform(state)])
        scale = np.linalg.norm(points[:, 1] - points[:, 0]) / np.linalg.norm(forces)
        np.testing.assert_allclose(points[:, 1] - points[:, 0], scale * forces, atol=1e-5)
        center = view.snapshot.pose.transform(view.snapshot.robot.center_of_mass)
        np.testing.assert_allclose(points[-1, 0], center, atol=1e-6)
        client.set(wanted, False)
        await_that(lambda: not page.node("/forces").visible)

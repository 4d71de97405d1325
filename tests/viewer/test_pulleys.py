"""Pulleys with axes of any direction, and winches on the platform: geometry of the drawing, and the page."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from sagline.viewer import shapes
from sagline.viewer.features import FEATURES
from sagline.viewer.features.proof import forces_on_platform, residual
from sagline.viewer.features.tensions import DotField
from sagline.viewer.page import Page
from sagline.viewer.player import InMotion
from sagline.viewer.readout import verdict
from sagline.viewer.snapshot import ByHand, Settings, snapshot_at
from tests.kinematics.test_slanted import COGIRO, four_cables
from tests.viewer.client import await_that
from tests.viewer.shown import Shown, handle, shown

RADII = np.array([0.1, 0.15, 0.2, 0.05, 0.08, 0.12, 0.1, 0.2])
SOME = np.array([True, False] * 4)
HORIZONTAL = -COGIRO.frame_anchors * [1.0, 1.0, 0.0]


def random_robot(seed: int, aboard: Array | bool) -> sl.Robot:
    """CoGiRo with random axes; `aboard`: True for cables whose winches are on the platform."""
    rng = np.random.default_rng(seed)
    axes = np.where(np.broadcast_to(aboard, 8)[:, None], [0.0, 0.0, 1.0], HORIZONTAL) + 0.3 * rng.normal(size=(8, 3))
    winches = sl.Winch(RADII, swivel_axis=axes, dead_cable=0.5, drum_radius=0.1, on_platform=aboard)
    return COGIRO.replace(winches=winches)


def random_pose(seed: int) -> sl.Pose:
    rng = np.random.default_rng(100 + seed)
    return sl.Pose.from_euler(rng.uniform((-2.0, -2.0, 1.0), (2.0, 2.0, 3.0)), *rng.uniform(-0.15, 0.15, 3))


def dot(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("...k,...k->...", one, other))


def exit_forces(state: sl.Equilibrium) -> Array:
    """Unit vectors of the forces of the free spans at their exit points, away from the pulleys, (m, 3)."""
    robot, cables, winches = state.one_robot, state.cables, state.one_robot.winches
    assert winches is not None
    on = winches.on_platform
    ends = np.where(on[:, None], robot.frame_anchors, state.pose.transform(robot.platform_anchors))
    level = (ends - state.exit_point)[:, :2]
    level *= (cables.horizontal_tension / np.linalg.norm(level, axis=1))[:, None]
    up = np.where(on, -cables.vertical_force, cables.vertical_force - cables.cable_weight)
    force = np.column_stack((level, up))
    return np.asarray(force / np.linalg.norm(force, axis=1)[:, None])


@pytest.mark.parametrize("model", [sl.Elastic(), sl.Catenary()])
@pytest.mark.parametrize("aboard", [False, SOME, True], ids=["frame", "some", "platform"])
@pytest.mark.parametrize("seed", range(4))
def test_wheels_touch_their_axes_and_their_cables(seed: int, aboard: Array | bool, model: sl.CableModel) -> None:
    robot, pose = random_robot(seed, aboard), random_pose(seed)
    plan = sl.inverse(robot, pose, model)
    assert plan.feasible
    state, on, winches = plan.state, np.broadcast_to(aboard, 8)[:, None], robot.winches
    assert winches is not None
    ends = pose.transform(robot.platform_anchors)
    entry, other = np.where(on, ends, robot.frame_anchors), np.where(on, robot.frame_anchors, ends)
    axis = np.where(on, winches.swivel_axis @ pose.matrix.T, winches.swivel_axis)
    centers, turns = shapes.wheels(robot, pose, state, state.unstrained_length)
    spin = Rotation.from_quat(turns, scalar_first=True).apply([0.0, 1.0, 0.0])
    # the axis touches the wheel at the entry point, and is in its plane
    np.testing.assert_allclose(dot(entry - centers, axis), 0.0, atol=1e-15)
    np.testing.assert_allclose(dot(spin, axis), 0.0, atol=1e-15)
    # the drawn cable follows the rim from the entry point, along the axis, to the exit point of the equilibrium
    course = shapes.courses(robot, pose, state, 1.0)
    rim, free = course[:, : shapes.WRAP_POINTS], course[:, shapes.WRAP_POINTS :]
    np.testing.assert_array_equal(rim[:, 0], entry)
    np.testing.assert_allclose(rim[:, -1], state.exit_point, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(rim - centers[:, None], axis=2), RADII[:, None] * np.ones(16), rtol=1e-12)
    np.testing.assert_allclose(dot(rim - centers[:, None], spin[:, None]), 0.0, atol=1e-12)
    step = rim[:, 1] - rim[:, 0]
    assert plan.wrap_angle is not None
    assert (dot(step, axis) / np.linalg.norm(step, axis=1) > np.cos(plan.wrap_angle / 15.0)).all()
    # the force at the exit point has no component along the radius; without weight it is in the plane of the wheel
    force = exit_forces(state)
    np.testing.assert_allclose(dot(force, state.exit_point - centers) / RADII, 0.0, atol=1e-10)
    assert (dot(force, rim[:, -1] - rim[:, -2]) > 0.0).all()
    fleet = np.abs(dot(force, spin)).max()
    assert fleet < (1e-12 if isinstance(model, sl.Elastic) else 1e-3)
    np.testing.assert_allclose(free[:, 0], state.exit_point, atol=1e-9)
    np.testing.assert_allclose(free[:, -1], other, atol=1e-9)


@pytest.mark.parametrize("aboard", [False, SOME, True], ids=["frame", "some", "platform"])
def test_cables_without_tensions_are_drawn_like_weightless_ones(aboard: Array | bool) -> None:
    robot, pose = random_robot(7, aboard), random_pose(7)
    state = sl.inverse(robot, pose, sl.Elastic()).state
    drawn, exact = shapes.courses(robot, pose, None, 1.0), shapes.courses(robot, pose, state, 1.0)
    np.testing.assert_allclose(drawn, exact, atol=1e-9)
    for found, expected in zip(shapes.wheels(robot, pose), shapes.wheels(robot, pose, state), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("aboard", [False, True], ids=["frame", "platform"])
def test_wheels_turn_with_the_cable(aboard: bool) -> None:
    robot, pose, more = random_robot(1, aboard), random_pose(1), 1e-3
    state = sl.inverse(robot, pose).state
    (centers, first), (_, second) = (
        shapes.wheels(robot, pose, state, state.unstrained_length + length) for length in (0.0, more)
    )
    turn = Rotation.from_quat(second, scalar_first=True) * Rotation.from_quat(first, scalar_first=True).inv()
    rim = shapes.wraps(robot, pose, state)
    # a longer cable moves into the pulley along the rim
    for place, along in ((rim[:, 0], rim[:, 1] - rim[:, 0]), (rim[:, -1], rim[:, -1] - rim[:, -2])):
        moved = centers + turn.apply(place - centers) - place
        np.testing.assert_allclose(np.linalg.norm(moved, axis=1), more, rtol=1e-3)
        assert (dot(moved, along) > 0.99 * more * np.linalg.norm(along, axis=1)).all()


def test_dead_lengths_and_drums_are_on_the_axes_and_move_with_the_platform() -> None:
    robot = random_robot(3, SOME)
    winches = robot.winches
    assert winches is not None
    runs, known = shapes.dead_runs(robot)
    entry = np.where(SOME[:, None], robot.platform_anchors, robot.frame_anchors)
    np.testing.assert_allclose(runs[:, 1], entry - 0.5 * winches.swivel_axis, atol=1e-15)
    assert known[SOME].all()
    assert not known[~SOME].any()  # the axes rise, but dead_rise is 0
    matching = replace_rise(robot, 0.5 * winches.swivel_axis[:, 2])
    assert shapes.dead_runs(matching)[1].all()
    drums = shapes.drum_axes(robot)
    middle, along = drums.mean(axis=1), drums[:, 1] - drums[:, 0]
    np.testing.assert_allclose(np.linalg.norm(middle - runs[:, 1], axis=1), 0.1, rtol=1e-12)
    np.testing.assert_allclose(dot(middle - runs[:, 1], winches.swivel_axis), 0.0, atol=1e-15)
    np.testing.assert_allclose(dot(along, winches.swivel_axis), 0.0, atol=1e-15)
    pose = random_pose(2)
    drawn = shapes.in_world(robot, pose, runs)
    np.testing.assert_allclose(drawn[SOME, 0], pose.transform(robot.platform_anchors)[SOME], atol=1e-15)
    np.testing.assert_array_equal(drawn[~SOME], runs[~SOME])


def replace_rise(robot: sl.Robot, rise: Array) -> sl.Robot:
    assert robot.winches is not None
    return robot.replace(winches=robot.winches.replace(dead_rise=np.where(SOME, 0.0, rise)))


@pytest.mark.parametrize("aboard", [False, SOME, True], ids=["frame", "some", "platform"])
def test_the_platform_is_in_balance_on_eyelets_at_the_exit_points(aboard: Array | bool) -> None:
    robot, pose = random_robot(5, aboard), random_pose(5)
    wrench = np.array([30.0, -20.0, 50.0, 5.0, 4.0, 3.0])
    snapshot = snapshot_at(robot, pose, Settings(mass=robot.mass), None, wrench)
    assert snapshot.plan is not None
    state = snapshot.plan.state
    forces = forces_on_platform(state)
    assert max(residual(state, forces)) < 1e-9
    assert forces[-1].wrench == pytest.approx(state.wrench)
    weight = next(each.wrench for each in forces if each.name == "weight")
    lighter = robot.mass * robot.gravity + weight[2]
    assert lighter == pytest.approx(state.cables.cable_weight[np.broadcast_to(aboard, 8)].sum(), rel=1e-9)
    # a force slightly below the margin is feasible in every direction
    spare = re.search(r"Spare force</dt><dd>([\d.]+) N", verdict(snapshot))
    assert spare is not None
    margin = float(spare[1])
    ways = np.random.default_rng(0).normal(size=(20, 3))
    ways *= 0.9 * margin / np.linalg.norm(ways, axis=1)[:, None]
    loads = state.wrench + np.hstack((ways, np.zeros((20, 3))))
    poses = sl.Pose.from_quaternion(np.tile(pose.position, (20, 1)), np.tile(pose.quaternion, (20, 1)))
    assert sl.inverse(robot, poses, wrench=loads).feasible.all()


@pytest.mark.parametrize("aboard", [False, True], ids=["frame", "platform"])
def test_feasible_tensions_chosen_by_hand_are_found(aboard: bool) -> None:
    robot, pose, settings = random_robot(6, aboard), random_pose(6), Settings(mass=COGIRO.mass)
    snapshot = snapshot_at(robot, pose, settings, None)
    field = DotField.of(snapshot)
    assert field is not None
    polygon = field.polygon
    np.testing.assert_allclose(field.tension(polygon.coordinates(snapshot.tension)), snapshot.tension, atol=1e-8)
    middle = field.tension(polygon.vertices.mean(axis=0))
    found = snapshot_at(robot, pose, replace(settings, tension=ByHand(target=middle)), None)
    np.testing.assert_allclose(found.tension, middle, atol=0.3)  # exit points and sag forces change with tensions


def test_a_broken_cable_of_a_simulation_is_a_point_and_its_wheel_stays() -> None:
    robot = random_robot(2, False)
    state = sl.inverse(robot, random_pose(2)).state
    motion = InMotion(robot, state.pose, 0, state.chord_tension, state.unstrained_length, "", (), (), "", broken=[3])
    assert not np.ptp(motion.courses(1.0)[3], axis=0).any()
    exact = shapes.courses(robot, state.pose, state, 1.0)
    assert np.abs(motion.courses(1.0) - exact)[[0, 1, 2, 4]].max() < 0.01
    assert all(np.isfinite(each).all() for each in motion.wheels())


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, random_robot(1, SOME)))


def test_the_page_follows_the_platform_with_wheels_and_winches(page: Shown) -> None:
    pose = random_pose(1)
    page.viewer.later(lambda: page.viewer.go(pose))
    await_that(lambda: np.allclose(page.position, pose.position) and "Feasible" in page.text)
    robot = page.viewer.robot
    state = page.viewer.state
    assert state is not None
    centers, turns = shapes.wheels(robot, pose, state, state.unstrained_length)
    wheels = page.node("/pulleys")
    np.testing.assert_allclose(wheels.batched_positions, centers, atol=1e-6)
    np.testing.assert_allclose(wheels.batched_wxyzs, turns, atol=1e-6)
    for name, count in (("/platform/body", 4), ("", 4)):
        points = np.asarray(page.node(f"{name}/dead{'' if name else '_assumed'}").points)
        lengths = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
        assert lengths.sum() == pytest.approx(count * 0.5 * (1.0 if name else 0.5), rel=1e-5)
        assert page.node(f"{name}/winches") is not None
    assert set(handle(page, "Cable model").options) == {"catenary (exact)", "elastic, weightless"}
    assert "Spare force" in page.text


def test_the_page_finds_the_nearest_feasible_pose_and_states_what_is_not_computed(page: Shown) -> None:
    low = sl.Pose.from_euler([6.5, 0.5, 5.5], 0.0, 0.0, 0.0)
    page.viewer.later(lambda: page.viewer.go(low))
    await_that(lambda: "Go there" in page.text)
    page.viewer.later(page.viewer.go_home)
    await_that(lambda: "Feasible" in page.text)
    await_that(lambda: "on_platform" in page.text)  # modes with cable mass


def test_a_run_of_four_cables_on_horizontal_axes_is_played() -> None:
    from sagline.viewer.playback import PlayedPlan  # a scene with a run

    robot = four_cables()
    path = sl.quintic_path([(0.0, 0.0, 1.0), (0.3, 0.2, 1.2)], durations=1.0, rate=20)
    played = PlayedPlan(sl.inverse(robot, path))
    found = [played.at(time) for time in (0.0, 1.0)]
    spun = [each.wheels()[1] for each in found]
    assert np.abs(spun[1] - spun[0]).max() > 0.1
    assert played.confirmation.position_error.max() < 1e-9

"""Margins and workspaces with pulleys that swivel about axes of any direction, and winches on the platform."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.test_slanted import COGIRO, four_cables
from tests.tiers import wide

ROBOT = four_cables().replace(tension_max=120.0)
BOX = sl.PoseBox([-0.9, -0.7, 1.0], [0.9, 0.7, 2.3])


def test_verdicts_and_margins_are_those_of_inverse() -> None:
    space = sl.workspace(ROBOT, BOX, cells=6, refine=False)
    nodes = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1).reshape(-1, 3)
    plan = sl.inverse(ROBOT, sl.Pose.from_quaternion(nodes, np.tile([0.0, 0.0, 0.0, 1.0], (len(nodes), 1))))
    inside = space.level.ravel() >= 0.0
    np.testing.assert_array_equal(inside, plan.solved)
    assert 0 < inside.sum() < inside.size
    tension = plan.chord_tension[inside]
    margin = np.minimum(tension - ROBOT.tension_min, ROBOT.tension_max - tension).min(axis=1)
    scale = space.criteria[0].scale(ROBOT)
    np.testing.assert_allclose(space.level.ravel()[inside] * scale, margin, rtol=1e-9, atol=1e-9)


def test_a_slightly_slanted_axis_continues_the_volume_of_the_vertical_axis() -> None:
    winches = ROBOT.winches
    assert winches is not None
    volumes = [
        sl.workspace(ROBOT.replace(winches=winches.replace(swivel_axis=axis)), BOX, cells=5, refine=False).volume
        for axis in ([1e-9, 0.0, 1.0], [0.0, 0.0, 1.0])
    ]
    np.testing.assert_allclose(volumes[0], volumes[1], rtol=1e-3)
    assert abs(sl.workspace(ROBOT, BOX, cells=5, refine=False).volume / volumes[1] - 1.0) > 1e-3


def test_poses_inside_a_pulley_are_outside() -> None:
    place = ROBOT.frame_anchors[0] - ROBOT.platform_anchors[0] + [0.01, 0.0, -0.01]
    levels = sl.workspace(ROBOT, BOX, cells=4, refine=False).levels()
    assert levels(np.vstack((place, [0.0, 0.0, 1.6])))[0] == -np.inf


LOADS = sl.WrenchBox(force=80.0, moment=30.0)
TURN = Rotation.from_euler("xyz", [0.7, -0.4, 1.1])


def with_pulleys(rng: np.random.Generator, aboard: bool) -> sl.Robot:
    """CoGiRo with random pulleys and limits; about half of the winches are on the platform if `aboard`."""
    axes = 0.7 * rng.normal(size=(8, 3)) - 0.1 * COGIRO.frame_anchors * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]
    where = rng.random(8) < 0.5 if aboard else False
    winches = sl.Winch(rng.uniform(0.0, 0.2, 8), swivel_axis=axes, dead_cable=0.5, on_platform=where)
    return COGIRO.replace(winches=winches, tension_min=rng.uniform(1.0, 300.0), tension_max=rng.uniform(700.0, 3000.0))


def random_poses(robot: sl.Robot, rng: np.random.Generator, count: int) -> sl.Pose:
    """Poses at which every cable has a tangent to its pulley."""
    place = rng.uniform((-7.0, -5.0, 0.5), (7.0, 5.0, 5.0), (count, 3))
    pose = sl.Pose.from_euler(place, *rng.uniform(-0.3, 0.3, (3, count)))
    return pose[sl.margin(robot, pose, model="straight").status != sl.MarginStatus.NO_CHORD]


def farthest_multiple(plan: sl.Plan, k: int, load: Array, along: Array) -> float:
    """Largest multiple of `along` (6,) that the cables supply beyond weight and `load`: linear program of HiGHS."""
    robot, exits, pose = plan.robot, plan.exit_point, plan.state.pose[k]
    assert exits is not None
    assert robot.winches is not None
    aboard = robot.winches.on_platform[:, None]
    ends = np.where(aboard, exits[k], pose.transform(robot.platform_anchors))
    away = np.where(aboard, robot.frame_anchors, exits[k]) - ends
    away /= np.linalg.norm(away, axis=1)[:, None]
    columns = np.hstack((away, np.cross(ends - pose.transform(robot.center_of_mass[None]), away))).T
    needed = [0.0, 0.0, robot.mass * robot.gravity, 0.0, 0.0, 0.0] - load
    limits = [*zip(robot.tension_min, robot.tension_max, strict=True), (None, None)]
    found = linprog([0.0] * 8 + [-1.0], A_eq=np.column_stack((columns, -along)), b_eq=needed, bounds=limits)
    return float(found.x[-1]) if found.status == 0 else np.nan


@pytest.mark.parametrize("seed", wide(range(8)))
@pytest.mark.parametrize("aboard", [False, True])
def test_margins_of_massless_cables_are_those_of_a_linear_program(seed: int, aboard: bool) -> None:
    rng = np.random.default_rng(seed)
    robot = with_pulleys(rng, aboard)
    pose = random_poses(robot, rng, 40)
    plan = sl.inverse(robot, pose, "elastic", stability=False)
    found = sl.margin(robot, pose, LOADS, model="elastic", moment_arm=0.7)
    checked = np.flatnonzero(plan.feasible)
    assert checked.size > 8
    for k in checked:
        y = found.direction[k]
        along = y * [1.0, 1.0, 1.0, 0.49, 0.49, 0.49]  # the load of unit length that reaches the nearest facet first
        worst = -np.sign(y) * LOADS.segments.diagonal()
        multiple = farthest_multiple(plan, int(k), worst, along)
        if found.value[k] >= 0.0:  # HiGHS accepts errors of 1e-7 of its right side
            np.testing.assert_allclose(multiple, found.value[k], atol=1e-4)
        else:
            assert not multiple > found.value[k] + 1e-4
    assert (found.value[checked] > 0.0).any()
    np.testing.assert_array_equal(found.low, found.value)


@pytest.mark.parametrize("seed", wide(range(10)))
@pytest.mark.parametrize("aboard", [False, True])
def test_margins_of_massless_cables_have_the_sign_of_inverse(seed: int, aboard: bool) -> None:
    rng = np.random.default_rng(seed + 20)
    robot = with_pulleys(rng, aboard)
    pose = random_poses(robot, rng, 400)
    feasible = sl.inverse(robot, pose, "elastic", stability=False).feasible
    np.testing.assert_array_equal(sl.margin(robot, pose, model="elastic").value >= 0.0, feasible)
    assert 0 < feasible.sum() < feasible.size


@pytest.mark.parametrize("model", ["elastic", "straight"])
def test_slightly_slanted_axes_have_the_margins_of_vertical_axes(model: str) -> None:
    pose = random_poses(COGIRO, np.random.default_rng(3), 50)
    robots = [
        COGIRO.replace(winches=sl.Winch(0.1, swivel_axis=[[x, 0.0, 1.0]] * 4 + [[x, 0.0, -1.0]] * 4, dead_cable=2.0))
        for x in (1e-9, 0.0)
    ]
    slanted, vertical = (sl.margin(robot, pose, LOADS, model=model) for robot in robots)
    np.testing.assert_allclose(slanted.value, vertical.value, rtol=1e-7, atol=1e-5)
    np.testing.assert_array_equal(slanted.limiting_cable, vertical.limiting_cable)


@pytest.mark.parametrize("aboard", [False, True])
def test_a_robot_turned_as_a_whole_keeps_its_margins(aboard: bool) -> None:
    rng = np.random.default_rng(5)
    robot = with_pulleys(rng, aboard).replace(gravity=0.0)
    if not aboard:
        robot = robot.replace(winches=sl.Winch(0.1, dead_cable=2.0))
    winches = robot.winches
    assert winches is not None
    axes = np.where(winches.on_platform[:, None], winches.swivel_axis, winches.swivel_axis @ TURN.as_matrix().T)
    turned = robot.replace(
        frame_anchors=robot.frame_anchors @ TURN.as_matrix().T,
        winches=winches.replace(swivel_axis=axes),
        frame_size=None,
    )
    pose = random_poses(robot, rng, 50)
    moved = sl.Pose.from_quaternion(
        pose.position @ TURN.as_matrix().T, (TURN * Rotation.from_matrix(pose.matrix)).as_quat()
    )
    loads = sl.WrenchEllipsoid(force=80.0, moment=30.0)
    found, other = (sl.margin(*each, loads, model="elastic").value for each in ((robot, pose), (turned, moved)))
    np.testing.assert_allclose(other, found, rtol=1e-9, atol=1e-7)


def test_several_robots_have_their_own_exit_points() -> None:
    rng = np.random.default_rng(6)
    robots = [with_pulleys(rng, True) for _ in range(3)]
    pose = sl.Pose.from_euler(rng.uniform((-1.0, -1.0, 1.5), (1.0, 1.0, 2.5), (3, 3)), 0.1, 0.0, 0.2)
    found = sl.margin(robots, pose, model="elastic").value
    each = [float(sl.margin(one, pose[k], model="elastic").value) for k, one in enumerate(robots)]
    np.testing.assert_array_equal(found, each)


@pytest.mark.parametrize("aboard", [False, True])
def test_the_workspace_of_massless_cables_has_the_verdicts_of_inverse(aboard: bool) -> None:
    robot = with_pulleys(np.random.default_rng(8), aboard)
    box = sl.PoseBox([-6.0, -4.0, 1.0], [6.0, 4.0, 4.5])
    space = sl.workspace(robot, box, model="elastic", cells=8, refine=False)
    nodes = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1).reshape(-1, 3)
    pose, level = sl.Pose.from_euler(nodes, 0.0, 0.0, 0.0), space.level.ravel()
    known = sl.margin(robot, pose, model="straight").status != sl.MarginStatus.NO_CHORD
    feasible = sl.inverse(robot, pose[known], "elastic", stability=False).feasible
    np.testing.assert_array_equal(level[known] >= 0.0, feasible)
    assert not (level[~known] >= 0.0).any()
    assert 0 < feasible.sum() < feasible.size
    assert space.volume > 0.0

"""Margins of cables with mass over pulleys whose exit points move with the tensions."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.statics.tables import cable_table, chord_geometry, tangent_exits
from sagline.workspaces.moving_exits import errors_of_exits
from tests.kinematics.test_slanted import COGIRO
from tests.tiers import wide
from tests.workspaces.test_slanted import random_poses, with_pulleys

KINDS = ("cogiro", "heavy", "frame end", "slack", "aboard")


def robot_of(kind: str, rng: np.random.Generator) -> sl.Robot:
    """CoGiRo with random pulleys, limits, and cables."""
    robot = with_pulleys(rng, kind == "aboard")
    if kind == "heavy":
        return robot.replace(cables=sl.Cable(0.5, 4e5))
    if kind == "frame end":
        return robot.replace(tension_limits_of="frame_end")
    return robot.replace(tension_min=1.0) if kind == "slack" else robot


def corners_of(loads: sl.WrenchSet) -> Array:
    """The 64 corners of a box."""
    return np.array(list(product((-1.0, 1.0), repeat=6))) * loads.segments.diagonal()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", wide(range(6)))
def test_margins_have_the_sign_of_inverse(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed + 50)
    robot = robot_of(kind, rng)
    pose = random_poses(robot, rng, 60 if kind == "slack" else 300)
    plan, found = sl.inverse(robot, pose, stability=False), sl.margin(robot, pose)
    infeasible = plan.status == sl.PoseStatus.INFEASIBLE
    np.testing.assert_array_equal(found.value[plan.feasible] >= 0.0, True)
    np.testing.assert_array_equal(found.value[infeasible] < 0.0, True)
    np.testing.assert_array_equal(found.status[plan.feasible], sl.MarginStatus.FEASIBLE)
    np.testing.assert_array_equal(found.status[infeasible], sl.MarginStatus.INFEASIBLE)
    assert (found.low <= found.value).all()
    assert (found.value <= found.high).all()
    assert plan.feasible.sum() > 5
    assert infeasible.any()


@pytest.mark.parametrize("limits_of", ["chord", "frame_end"])
@pytest.mark.parametrize("aboard", [False, True])
@pytest.mark.parametrize("seed", wide(range(4)))
def test_inverse_decides_loads_at_the_bounds_of_the_margin(limits_of: str, aboard: bool, seed: int) -> None:
    rng = np.random.default_rng(seed + 70)
    robot = with_pulleys(rng, aboard).replace(tension_limits_of=limits_of, tension_min=150.0)
    pose = random_poses(robot, rng, 100)
    found = sl.margin(robot, pose, moment_arm=0.7)
    pose, found = pose[found.low > 1.0], sl.margin(robot, pose[found.low > 1.0], moment_arm=0.7)
    assert len(pose) > 5
    against = -found.direction * [1.0, 1.0, 1.0, 0.49, 0.49, 0.49]  # of length 1, towards the nearest facet
    inside = sl.inverse(robot, pose, wrench=0.999 * found.low[:, None] * against, stability=False)
    beyond = sl.inverse(robot, pose, wrench=1.001 * found.high[:, None] * against, stability=False)
    np.testing.assert_array_equal(inside.status, sl.PoseStatus.SOLVED)
    np.testing.assert_array_equal(beyond.status, sl.PoseStatus.INFEASIBLE)


@pytest.mark.parametrize("kind", ["cogiro", "heavy"])
@pytest.mark.parametrize("seed", wide(range(4)))
def test_errors_of_forces_are_within_their_bounds(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed + 90)
    robot = robot_of(kind, rng).replace(tension_min=150.0, tension_max=1e5)
    pose = random_poses(robot, rng, 150)
    plan, table = sl.inverse(robot, pose, stability=False), cable_table(robot, slanted=True)
    geometry = chord_geometry(robot, pose, slanted=True)
    bound = errors_of_exits(table, robot.gravity, geometry, codes.LIMITS_OF_CHORD).force
    ends, exits = pose.transform(robot.platform_anchors), plan.exit_point
    assert exits is not None

    def forces(start: Array, vertical: Array, horizontal: Array) -> Array:
        """Forces on the platform."""
        level = start - ends
        level *= (horizontal / np.hypot(level[..., 0], level[..., 1]))[..., None]
        level[..., 2] = -vertical
        return level

    straight = tangent_exits(table, pose, geometry)
    run = ends - straight
    span, rise = np.hypot(run[..., 0], run[..., 1]), run[..., 2]
    tension = np.where(plan.feasible[:, None], plan.chord_tension, 200.0)
    other = sl.Catenary().from_tension(robot.cables, span, rise, tension, robot.gravity)
    cables = plan.state.cables
    error = np.linalg.norm(
        forces(exits, cables.vertical_force, cables.horizontal_tension)
        - forces(straight, other.vertical_force, other.horizontal_tension),
        axis=-1,
    )
    share = (error / bound)[plan.feasible & np.isfinite(bound).all(axis=1)]
    assert share.size > 200
    assert share.max() < 1.0
    assert share.max() > 0.2  # the bounds are not far too large


def test_feasible_sets_have_feasible_corners() -> None:
    rng = np.random.default_rng(4)
    robot, loads = with_pulleys(rng, False), sl.WrenchBox(force=60.0, moment=20.0)
    pose = random_poses(robot, rng, 60)
    found = sl.margin(robot, pose, loads)
    kinds = sl.MarginStatus.FEASIBLE, sl.MarginStatus.INFEASIBLE
    counts = dict.fromkeys(kinds, 0)
    for k in range(len(pose)):
        repeated = sl.Pose.from_quaternion(np.tile(pose.position[k], (64, 1)), np.tile(pose.quaternion[k], (64, 1)))
        feasible = sl.inverse(robot, repeated, wrench=corners_of(loads), stability=False).feasible
        if found.status[k] in kinds:
            assert feasible.all() == (found.status[k] == sl.MarginStatus.FEASIBLE)
            counts[kinds[0] if feasible.all() else kinds[1]] += 1
    assert min(counts.values()) > 3
    assert sum(counts.values()) > len(pose) - 3


def test_the_least_favorable_load_of_a_sum_of_sets_decides() -> None:
    rng = np.random.default_rng(11)
    robot = robot_of("slack", rng)  # inverse decides at every pose
    pose = random_poses(robot, rng, 40)
    loads = (
        sl.WrenchEllipsoid(force=60.0, moment=10.0)
        + sl.WrenchPolytope([[0.0] * 6, [100.0, 0.0, -900.0, 0.0, 50.0, 0.0]])
        + sl.Accelerations(linear=0.5, angular=5.0)
    )
    found = sl.margin(robot, pose, loads)
    y, mass = found.direction, robot.mass
    inertia = pose.matrix @ robot.inertia @ np.swapaxes(pose.matrix, 1, 2)
    axes = np.array([60.0] * 3 + [10.0] * 3)
    worst = -y * axes**2 / np.linalg.norm(y * axes, axis=1)[:, None]
    heavy = y @ loads.corners.T
    worst += loads.corners[heavy.argmin(axis=1)]
    worst[:, :3] -= 0.5 * mass * np.sign(y[:, :3])
    for k in range(3):  # angular accelerations about each axis
        moment = 5.0 * inertia[:, :, k]
        worst[:, 3:] -= np.sign((moment * y[:, 3:]).sum(axis=1))[:, None] * moment
    plan = sl.inverse(robot, pose, wrench=worst, stability=False)
    known = plan.feasible | (plan.status == sl.PoseStatus.INFEASIBLE)
    np.testing.assert_array_equal(found.value[known] >= 0.0, plan.feasible[known])
    assert 0 < plan.feasible.sum() < known.sum()


def test_slightly_slanted_axes_have_nearly_the_margins_of_vertical_axes() -> None:
    pose = random_poses(COGIRO, np.random.default_rng(3), 100)
    slanted, vertical = (
        sl.margin(COGIRO.replace(winches=sl.Winch(0.1, swivel_axis=[x, 0.0, 1.0], dead_cable=2.0)), pose)
        for x in (1e-9, 0.0)
    )
    finite = np.isfinite(vertical.value)
    # the limits of vertical axes apply to the tension along the tangent
    np.testing.assert_allclose(slanted.value[finite], vertical.value[finite], rtol=5e-3, atol=2.0)


def test_several_robots_have_their_own_exit_points() -> None:
    rng = np.random.default_rng(6)
    robots = [robot_of(kind, rng) for kind in ("cogiro", "heavy", "slack")]
    pose = sl.Pose.from_euler(rng.uniform((-1.0, -1.0, 1.5), (1.0, 1.0, 2.5), (3, 3)), 0.1, 0.0, 0.2)
    found = sl.margin(robots, pose)
    for k, one in enumerate(robots):
        alone = sl.margin(one, pose[k])
        np.testing.assert_array_equal([found.value[k], found.low[k]], [alone.value, alone.low])


@pytest.mark.parametrize("kind", wide(["cogiro", "aboard"]))
def test_the_workspace_has_the_verdicts_of_inverse(kind: str) -> None:
    robot = robot_of(kind, np.random.default_rng(8))
    cells = 8 if kind == "cogiro" else 5
    space = sl.workspace(robot, sl.PoseBox([-6.0, -4.0, 1.0], [6.0, 4.0, 4.5]), cells=cells, refine=False)
    nodes = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1).reshape(-1, 3)
    plan = sl.inverse(robot, sl.Pose.from_euler(nodes, 0.0, 0.0, 0.0), stability=False)
    known = plan.feasible | (plan.status == sl.PoseStatus.INFEASIBLE)
    np.testing.assert_array_equal(space.level.ravel()[known] >= 0.0, plan.feasible[known])
    assert known.mean() > 0.99
    assert 0 < plan.feasible.sum() < known.sum()
    assert space.volume > 0.0

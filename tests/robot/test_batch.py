"""Positions of pulleys and cables on them: circles and tangents."""

import numpy as np
import pytest

import sagline as sl
from sagline.robot.batch import dead_cable, outward, points_on_pulleys, pulley_centers

BASE = sl.load_robot("article-suspended")
RADII = [0.05, 0.0, 0.1, 0.2, 0.3, 0.15, 0.25, 0.1]
WINCH = sl.Winch(pulley_radius=RADII, swivel_axis=[[0, 0, 1]] * 4 + [[0, 0, -1]] * 4, dead_cable=np.arange(8.0))
ROBOT = BASE.replace(winches=WINCH)


def pose_of(seed: int) -> sl.Pose:
    rng = np.random.default_rng(seed)
    return sl.Pose.from_euler(rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 5.0)), *rng.uniform(-0.3, 0.3, 3))


@pytest.mark.parametrize("seed", range(5))
def test_pulleys_are_beside_their_anchors_towards_the_platform(seed: int) -> None:
    pose = pose_of(seed)
    ends = pose.transform(ROBOT.platform_anchors)
    away = pulley_centers(ROBOT, pose) - ROBOT.frame_anchors
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), RADII, atol=1e-15)
    assert not away[:, 2].any()
    reach = (ends - ROBOT.frame_anchors)[:, :2]
    np.testing.assert_allclose(np.cross(np.c_[away[:, :2], np.zeros(8)], np.c_[reach, np.zeros(8)]), 0.0, atol=1e-14)
    assert (np.einsum("ij,ij->i", away[:, :2], reach) >= 0.0).all()


@pytest.mark.parametrize("seed", range(5))
def test_cables_leave_their_pulleys_along_the_force_there(seed: int) -> None:
    """The exit point is on the circle, and the cable continues in the direction of its tangent."""
    pose = pose_of(seed)
    plan = sl.inverse(ROBOT, pose)
    assert plan.feasible
    assert plan.wrap_angle is not None
    centers = pulley_centers(ROBOT, pose)
    arm = plan.exit_point - centers
    np.testing.assert_allclose(np.linalg.norm(arm, axis=1), RADII, rtol=1e-13, atol=1e-15)
    cables = plan.state.cables
    weight = cables.cable.linear_density * 9.81 * plan.free_length
    level = outward(ROBOT, pose)[:, :2] * cables.horizontal_tension[:, None]
    force = np.concatenate((level, (cables.vertical_force - weight)[:, None]), axis=1)
    force /= np.linalg.norm(force, axis=1, keepdims=True)
    np.testing.assert_allclose(np.einsum("ij,ij->i", arm, force), 0.0, atol=1e-9)
    np.testing.assert_array_equal(points_on_pulleys(ROBOT, pose, plan.wrap_angle), plan.exit_point)


def test_cables_enter_upward_or_downward_at_their_anchors() -> None:
    pose, step = pose_of(9), 1e-6
    np.testing.assert_array_equal(points_on_pulleys(ROBOT, pose, np.zeros(8)), ROBOT.frame_anchors)
    first = (points_on_pulleys(ROBOT, pose, np.full(8, step)) - ROBOT.frame_anchors) / step
    np.testing.assert_allclose(first, np.array(RADII)[:, None] * WINCH.swivel_axis, atol=1e-6)


def test_the_axis_of_an_eyelet_has_no_effect() -> None:
    pose = pose_of(1)
    slanted, upright = (BASE.replace(winches=sl.Winch(0.0, swivel_axis=axis)) for axis in ([1.0, 0.5, 1.0], [0, 0, 1]))
    np.testing.assert_array_equal(outward(slanted, pose), outward(upright, pose))


def test_dead_length_of_one_robot_and_of_several() -> None:
    np.testing.assert_array_equal(dead_cable(ROBOT), np.arange(8.0))
    np.testing.assert_array_equal(dead_cable((ROBOT, BASE)), [np.arange(8.0), np.zeros(8)])

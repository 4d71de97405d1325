"""Tensions of the inverse kinematics with swivel axes of any direction, by every method, and their limits."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.test_slanted import AXES, LEVEL, with_axes

ROBOT = with_axes(AXES["any"], 0.15)
PLACE = np.random.default_rng(5).uniform((-2.0, -2.0, 1.0), (2.0, 2.0, 3.0), (12, 3))
POSES = sl.Pose.from_quaternion(PLACE, np.tile(LEVEL, (12, 1)))
METHODS: dict[str, sl.TensionMethod | str] = {
    "MinimumNorm": sl.MinimumNorm(),
    "horizontal": sl.MinimumNorm(variable="horizontal"),
    "frame end": sl.MinimumNorm(variable="frame_end"),
    "Closest": sl.Closest(),
    "PNorm": sl.PNorm(),
    "ImprovedClosedForm": sl.ImprovedClosedForm(),
}


def unbalanced(plan: sl.Plan, robot: sl.Robot) -> Array:
    """Weight and cable forces at the platform, and their moments about the center of mass, (N, 6) [N, N m]."""
    cables, exits = plan.state.cables, plan.exit_point
    assert exits is not None
    ends = plan.state.pose.transform(robot.platform_anchors)
    force = exits - ends
    force *= (cables.horizontal_tension / np.hypot(force[..., 0], force[..., 1]))[..., None]
    force[..., 2] = -cables.vertical_force
    arms = ends - plan.state.pose.transform(robot.center_of_mass[None])
    weight = [0.0, 0.0, robot.mass * robot.gravity]
    return np.hstack((force.sum(axis=-2) - weight, np.cross(arms, force).sum(axis=-2)))


@pytest.mark.parametrize("method", METHODS)
def test_forces_balance_the_weight_and_forward_returns_the_pose(method: str) -> None:
    plan = sl.inverse(ROBOT, POSES, tension=METHODS[method])
    assert plan.solved.all()
    assert np.abs(unbalanced(plan, ROBOT)).max() < 1e-8
    assert plan.wrench_residual.max() < 1e-8
    found = sl.forward(ROBOT, plan.unstrained_length, POSES)
    np.testing.assert_allclose(found.state.pose.position, PLACE, atol=1e-11)
    np.testing.assert_allclose(found.state.chord_tension, plan.chord_tension, rtol=1e-8)


def test_limits_of_the_frame_ends_hold_at_the_exit_points_found() -> None:
    free = sl.inverse(ROBOT, POSES).state.cables.frame_end_tension
    least = 0.5 * (np.median(free.min(axis=1)) + free.min())
    limited = ROBOT.replace(tension_min=least, tension_limits_of="frame_end")
    plan = sl.inverse(limited, POSES)
    assert plan.solved.any()
    smallest = plan.state.cables.frame_end_tension[plan.solved].min(axis=1)
    assert smallest.min() >= least * (1.0 - 1e-9)
    assert (np.abs(smallest / least - 1.0) < 1e-9).any()


def test_weightless_cables_leave_their_pulleys_along_straight_lines() -> None:
    plan = sl.inverse(ROBOT, POSES, "elastic")
    assert plan.solved.all()
    assert np.abs(unbalanced(plan, ROBOT)).max() < 1e-8
    found = sl.forward(ROBOT, plan.unstrained_length, POSES, model="elastic")
    np.testing.assert_allclose(found.state.pose.position, PLACE, atol=1e-11)


@pytest.mark.parametrize("kind", ["any", "tangential"])
def test_stability_is_that_of_the_stiffness(kind: str) -> None:
    robot, pose = with_axes(AXES[kind]), sl.Pose.from_euler([0.5, 0.3, 2.0], 0.0, 0.0, 0.0)
    found = []
    for height in np.linspace(0.0, 60.0, 25):
        plan = sl.inverse(robot.replace(center_of_mass=[0.0, 0.0, height], tension_max=1e5), pose)
        found.append(plan.status == sl.PoseStatus.SOLVED)
        assert found[-1] == (plan.stiffness_min > 0.0)
    assert 0 < sum(found) < len(found)


def test_a_slightly_slanted_axis_continues_the_tensions_of_the_vertical_axis() -> None:
    tilted, vertical = (sl.inverse(with_axes([tilt, 0.0, 1.0], 0.15), POSES) for tilt in (1e-9, 0.0))
    for name in ("frame_end_tension", "horizontal_tension", "vertical_force"):
        found, known = (getattr(plan.state.cables, name) for plan in (tilted, vertical))
        np.testing.assert_allclose(found, known, rtol=2e-3)
    np.testing.assert_allclose(tilted.unstrained_length, vertical.unstrained_length, atol=2e-6)
    reached = sl.forward(with_axes([1e-9, 0.0, 1.0], 0.15), vertical.unstrained_length, POSES)
    np.testing.assert_allclose(reached.state.pose.position, PLACE, atol=1e-8)


def test_closest_tensions_keep_their_reference_beside_infeasible_samples() -> None:
    places = [(1.0, 1.0, 2.0), (3.0, 2.0, 2.0), (7.5, 5.0, 2.0)]
    first, whole = (sl.quintic_path(places[:count], durations=2.0, rate=10.0) for count in (2, 3))
    plan, before = (sl.inverse(ROBOT, path, tension=sl.Closest()) for path in (whole, first))
    assert before.solved.all()
    assert not plan.solved.all()
    np.testing.assert_allclose(plan.chord_tension[: len(first.time)], before.chord_tension, rtol=1e-6)

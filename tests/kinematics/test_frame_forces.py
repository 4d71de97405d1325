"""Forces on the frame: equilibrium of robot and cables, tension at the drum, and the envelope of a path."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.calibration.machines import robots
from tests.tiers import wide

WRENCH = np.array([20.0, -15.0, 10.0, 8.0, -6.0, 12.0])
ROBOTS = robots()
UP = np.array([0.0, 0.0, 1.0])


def plan_of(robot: sl.Robot, model: sl.CableModel, winding: Array | None = None) -> sl.Plan:
    pose = sl.Pose((0.8, 0.4, 1.6), np.eye(3))
    wrench = WRENCH if robot.motion_pattern == "3R3T" else 0.0 * WRENCH
    if robot.motion_pattern == "1R2T":
        pose = sl.Pose((0.4, 0.0, -0.3), Rotation.from_rotvec((0.0, 0.1, 0.0)))
    plan = sl.inverse(robot, pose, wrench=wrench, model=model, tension=sl.MinimumNorm(), winding=winding)
    assert plan.solved
    return plan


@pytest.mark.parametrize("name", wide(ROBOTS, first=7))
def test_the_frame_carries_platform_cables_and_wrench(name: str) -> None:
    robot = ROBOTS[name]
    plan = plan_of(robot, sl.Catenary())
    found = plan.frame_forces()
    # the mass of a platform with winches includes their cables
    at_frame = np.ones(robot.cable_count) if robot.winches is None else ~robot.winches.on_platform
    cables = float((at_frame * plan.unstrained_length) @ robot.cables.linear_density)
    expected = plan.state.wrench[:3] - (robot.mass + cables) * robot.gravity * UP
    np.testing.assert_allclose((found.pulley + found.winch).sum(axis=0), expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["cogiro", "pulleys"])
def test_moments_of_massless_cables_are_in_balance(name: str) -> None:
    plan = plan_of(ROBOTS[name], sl.Elastic())
    state, robot = plan.state, plan.state.one_robot
    force = plan.frame_forces().exit
    center = state.pose.position + state.pose.matrix @ robot.center_of_mass
    load = state.wrench[:3] - robot.mass * robot.gravity * UP
    expected = state.wrench[3:] + np.cross(center, load)
    found = np.cross(plan.exit_point, force).sum(axis=0)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(load).max())


@pytest.mark.parametrize("winding", [0, 1, -1])
def test_the_cable_behind_the_pulley_has_the_tension_of_the_drum(winding: int) -> None:
    robot = ROBOTS["pulleys"]
    assert robot.winches is not None
    winches = robot.winches.replace(dead_rise=0.0, pulley_friction=0.1, rolling_friction=0.02)
    plan = plan_of(robot.replace(winches=winches), sl.Catenary(), np.full(8, winding))
    found, state = plan.frame_forces(), plan.state
    assert state.contact is not None
    weight = robot.cables.linear_density[:, None] * robot.gravity * UP
    pull = found.winch + weight * state.contact.dead_length[:, None]
    path = sl.Path([0.0, 1.0], sl.Pose(np.tile(state.pose.position, (2, 1)), np.eye(3)), *np.zeros((2, 2, 6)))
    wound = robot.replace(winches=winches.replace(drum_radius=0.05))
    both = np.full((2, 8), winding)
    still = sl.inverse(wound, path, wrench=WRENCH, tension=sl.MinimumNorm(), winding=both)
    expected = sl.winch_rates(still).drum_tension[0]
    np.testing.assert_allclose(pull, expected[:, None] * winches.swivel_axis, rtol=1e-9, atol=1e-9)
    on_pulley = weight * state.contact.wrapped_length[:, None]
    np.testing.assert_allclose(found.pulley, found.exit - pull - on_pulley, rtol=1e-12, atol=1e-9)


def test_slanted_pulleys_carry_the_same_forces_as_vertical_ones_within_a_small_angle() -> None:
    robot = ROBOTS["pulleys"]
    assert robot.winches is not None
    axis = np.array([1e-7, 0.0, 1.0]) * robot.winches.swivel_axis[:, 2:]
    slanted = robot.replace(winches=robot.winches.replace(swivel_axis=axis))
    one, other = (plan_of(each, sl.Catenary()).frame_forces() for each in (robot, slanted))
    np.testing.assert_allclose(one.pulley, other.pulley, rtol=1e-4, atol=1e-3)


def test_the_envelope_of_a_path() -> None:
    robot = ROBOTS["drums"]
    plan = sl.inverse(robot, sl.quintic_path([(0, 0, 1), (0, 0, 40)], durations=1.0, rate=20))
    assert plan.feasible.any()
    assert not plan.feasible.all()
    found = plan.frame_forces()
    known = found.pulley[plan.feasible]
    for i in range(8):
        size = np.linalg.norm(known[:, i], axis=1)
        np.testing.assert_array_equal(found.largest[i], known[np.argmax(size), i])
    np.testing.assert_array_equal(found.extremes, [known.min(axis=0), known.max(axis=0)])
    np.testing.assert_array_equal(found.table()["Fz3"], found.pulley[:, 3, 2])
    single = sl.inverse(robot, (0, 0, 1)).frame_forces()
    np.testing.assert_array_equal(single.largest, single.pulley)


@pytest.mark.parametrize("radius", [0.0, 0.05])
@pytest.mark.parametrize("winding", [0, 1])
def test_guides_and_drums_carry_the_guided_cables(radius: float, winding: int) -> None:
    robot = sl.load_robot("cogiro")
    eyelet, drum = robot.frame_anchors * [2.0, 2.0, 1.0], robot.frame_anchors * [2.0, 2.0, 0.0]
    winches = sl.Winch(radius, guides=np.stack((drum, eyelet), axis=1), pulley_friction=0.1, drum_radius=0.05)
    robot = robot.replace(winches=winches)
    plan = plan_of(robot, sl.Catenary(), np.full(8, winding))
    found, state = plan.frame_forces(), plan.state
    whole = float(plan.unstrained_length @ robot.cables.linear_density) * robot.gravity
    total = (found.pulley + found.winch + found.guides[:, 0]).sum(axis=0)
    expected = state.wrench[:3] - (robot.mass * robot.gravity + whole) * UP
    np.testing.assert_allclose(total, expected, atol=1e-9 * np.abs(expected).max())
    # the drum is below the eyelet, which is beside the anchor: the pull on the drum is upward, on the anchor outward
    path = sl.Path([0.0, 1.0], sl.Pose(np.tile(state.pose.position, (2, 1)), np.eye(3)), *np.zeros((2, 2, 6)))
    both = np.full((2, 8), winding)
    still = sl.inverse(robot, path, wrench=WRENCH, tension=sl.MinimumNorm(), winding=both)
    drawn = sl.winch_rates(still).drum_tension[0]
    np.testing.assert_allclose(found.winch, drawn[:, None] * UP, rtol=1e-9, atol=1e-6)
    assert state.contact is not None
    weight = robot.cables.linear_density[:, None] * robot.gravity * state.contact.wrapped_length[:, None] * UP
    behind = found.pulley - found.exit + weight
    out = eyelet - robot.frame_anchors
    assert (np.abs(np.cross(behind, out)[:, 2]) < 1e-9 * np.linalg.norm(out, axis=1)).all()  # in its vertical plane
    assert ((behind * out).sum(axis=1) > 0.75 * drawn * np.linalg.norm(out, axis=1)).all()

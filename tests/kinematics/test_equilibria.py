"""Search for all equilibria: symmetric equilibria are found."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from tests.kinematics.feasible import feasible_plan

SUSPENDED = sl.load_robot("article-suspended")


def test_the_planned_pose_is_found_and_the_lowest_energy_is_first() -> None:
    robot = sl.load_robot("cogiro")
    plan = feasible_plan(robot, 3, seed=1)
    for i in range(3):
        found = sl.equilibria(robot, plan.unstrained_length[i], starts=100)
        assert found.solutions.stable.all()
        assert found.solutions.wrench_residual.max() < 1e-8
        assert (np.diff(found.solutions.energy) > 0.0).all()
        distance = np.linalg.norm(found.solutions.pose.position - plan.state.pose.position[i], axis=1)
        assert distance.min() < 1e-9
        assert found.reached.sum() <= found.starts == 100


def test_a_symmetric_robot_has_symmetric_equilibria() -> None:
    # a half turn about z maps robot and lengths onto themselves: the image of each equilibrium has the same energy
    plan = sl.inverse(SUSPENDED, sl.Pose((0.0, 0.0, 2.0), np.eye(3)), tension=sl.MinimumNorm())
    found = sl.equilibria(SUSPENDED, plan.unstrained_length, starts=400)
    assert len(found) >= 3
    half = Rotation.from_rotvec([0.0, 0.0, np.pi])
    for pose, energy in zip(found.solutions.pose, found.solutions.energy, strict=True):
        # rotated platform, with cables renumbered by a half turn about its own z
        image = half.as_matrix() @ pose.matrix @ half.as_matrix()
        position = half.apply(pose.position.copy())
        same = np.abs(found.solutions.pose.position - position).max(axis=1) < 1e-7
        same &= np.abs(found.solutions.pose.matrix - image).max(axis=(1, 2)) < 1e-7
        assert same.any()
        assert found.solutions.energy[same][0] == pytest.approx(energy, abs=1e-7)


def test_a_planar_robot_has_twisted_equilibria() -> None:
    corners = np.array([[1.0, 0, 1], [-1, 0, 1], [-1, 0, -1], [1, 0, -1]])
    robot = sl.Robot(
        "planar", 3 * corners, 0.3 * corners[:, ::-1], sl.Cable(0.01, 5e4), 3.0, np.eye(3),
        motion_pattern="1R2T", plane_normal=(0, 1, 0), tension_min=20.0,
    )  # fmt: skip
    pose = sl.Pose.from_euler((-0.4, 0.0, -0.3), 0.0, 0.1, 0.0)
    plan = sl.inverse(robot, pose)
    found = sl.equilibria(robot, plan.unstrained_length)
    assert len(found) == 2  # the pose and the one with opposite rotation, with nearly the same energy
    assert found.reached.sum() == found.starts
    distance = np.linalg.norm(found.solutions.pose.position - pose.position, axis=1)
    assert distance.min() < 1e-9
    assert distance.max() > 5e-3
    assert np.abs(found.solutions.pose.position[:, 1]).max() < 1e-12  # all poses are in the plane
    np.testing.assert_allclose(found.solutions.pose.matrix[:, 1], [[0, 1, 0]] * len(found), atol=1e-12)


def test_without_an_energy_the_most_frequent_pose_is_first() -> None:
    plan = sl.inverse(SUSPENDED, sl.Pose((0.0, 0.0, 2.0), np.eye(3)), sl.Parabolic(), sl.MinimumNorm())
    found = sl.equilibria(SUSPENDED, plan.unstrained_length, sl.Parabolic(), starts=200)
    assert np.isnan(found.solutions.energy).all()
    assert len(set(found.reached.tolist())) > 1
    assert (np.diff(found.reached) <= 0).all()


def test_straight_cables_have_mirrored_poses() -> None:
    frame = [[3, 2, 4], [-3, 2, 4], [0, -3, 4]]
    robot = sl.Robot("tripod", frame, np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T")
    at = np.array([0.5, -0.4, 1.5])
    lengths = np.linalg.norm(at - np.array(frame), axis=1)
    below = sl.forward(robot, lengths, sl.Pose((0, 0, 1.0), np.eye(3)), sl.Straight())
    above = sl.forward(robot, lengths, sl.Pose((0, 0, 7.0), np.eye(3)), sl.Straight())
    np.testing.assert_allclose(below.pose.position, at, atol=1e-9)
    np.testing.assert_allclose(above.pose.position, [0.5, -0.4, 6.5], atol=1e-9)  # mirrored at z = 4


def test_bad_arguments() -> None:
    with pytest.raises(sl.InvalidValueError, match="starts"):
        sl.equilibria(SUSPENDED, [7.0] * 8, starts=0)
    with pytest.raises(sl.InvalidValueError, match="unstrained_length"):
        sl.equilibria(SUSPENDED, [[7.0] * 8])
    with pytest.raises(sl.InvalidValueError, match="cable 2"):
        sl.equilibria(SUSPENDED, [7.0, 7.0, -7.0, 7.0, 7.0, 7.0, 7.0, 7.0])

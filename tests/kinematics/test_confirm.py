import sys

import numpy as np
import pytest

import sagline as sl

SUSPENDED = sl.load_robot("article-suspended")
PATH = sl.article_path(rate=2.0)


def test_exact_lengths_give_the_planned_poses() -> None:
    proof = sl.confirm(sl.inverse(SUSPENDED, PATH))
    assert proof.held.all()
    assert np.abs(proof.position_error).max() < 1e-12
    assert proof.rotation_error.max() < 1e-12
    assert proof.wrench_residual.max() < 1e-8


def test_lengths_of_straight_cables_lower_the_platform() -> None:
    proof = sl.confirm(sl.inverse(SUSPENDED, PATH, model=sl.Straight()))
    assert proof.held.all()
    assert proof.position_error[:, 2].max() < -0.02  # cables stretch: tensions of 100 N and more, EA of 44 kN


@pytest.mark.parametrize("block", [1, 7, 1000])
def test_the_block_size_has_no_influence(monkeypatch: pytest.MonkeyPatch, block: int) -> None:
    plan = sl.inverse(SUSPENDED, PATH, model=sl.Empirical())
    whole = sl.forward(SUSPENDED, plan.unstrained_length, start=PATH.pose, wrench=plan.state.wrench)
    monkeypatch.setattr(sys.modules[sl.confirm.__module__], "BLOCK", block)
    proof = sl.confirm(plan)
    np.testing.assert_allclose(proof.pose.position, whole.pose.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(proof.pose.quaternion, whole.pose.quaternion, rtol=0.0, atol=1e-12)
    assert proof.wrench_residual.max() < 1e-8
    assert 1e-3 < np.linalg.norm(proof.position_error, axis=1).max() < 3e-3


def test_a_single_pose() -> None:
    pose = sl.Pose.from_euler((1.0, 2.0, 1.7), 0.05, -0.02, 0.03)
    proof = sl.confirm(sl.inverse(SUSPENDED, pose, wrench=(5.0, 0.0, 0.0, 0.0, 0.0, 1.0)))
    assert proof.position_error.shape == (3,)
    assert np.abs(proof.position_error).max() < 1e-12
    assert float(proof.rotation_error) < 1e-12


def test_poses_without_lengths_have_no_confirmation() -> None:
    poses = sl.Pose.from_euler([(0.0, 0.0, 1.5), (0.0, 0.0, 7.0)], 0.0, 0.0, 0.0)
    proof = sl.confirm(sl.inverse(SUSPENDED, poses))
    assert list(proof.status) == [sl.ForwardStatus.SOLVED, sl.ForwardStatus.NO_LENGTHS]
    assert np.isnan(proof.position_error[1]).all()
    assert np.isnan(proof.rotation_error[1])


def test_the_angle_between_orientations() -> None:
    plan = sl.inverse(SUSPENDED, sl.Pose.from_euler([(0.0, 0.0, 2.0)] * 4, 0.0, 0.0, 0.0))
    turned = sl.Pose.from_euler([(0.0, 0.0, 2.0)] * 4, [0.0, 1e-9, 1.0, -3.0], 0.0, 0.0)
    proof = sl.Confirmation(plan, turned, plan.status, plan.wrench_residual)
    np.testing.assert_allclose(proof.rotation_error, [0.0, 1e-9, 1.0, 3.0], rtol=1e-14)

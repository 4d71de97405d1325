"""Plans mark unstable equilibria, and commands that move a robot refuse such plans."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
import sagline.control.checks
from sagline.kernels import codes
from sagline.kinematics import inverse_rows
from tests.kinematics.feasible import box_poses

LOW = sl.load_robot("article-mixed").replace(tension_min=1.0)
POSE = sl.Pose.from_euler((2.0, 1.0, 1.5), 0.0, 0.0, 0.0)
METHOD = sl.MinimumNorm()
TOP = (4.0, 2.0, 5.0)  # half the size of the region of poses [m], above the floor


def planar(moment: float = 0.0) -> sl.Robot:
    """A platform compressed by its four cables: low tensions cannot prevent its rotation."""
    frame = [[3.0, 0.0, 3.0], [-3.0, 0.0, 3.0], [-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]]
    ends = [[-0.4, 0.0, 0.1], [0.4, 0.0, 0.1], [0.4, 0.0, -0.1], [-0.4, 0.0, -0.1]]
    return sl.Robot(
        "planar", frame, ends, sl.Cable(0.05, 2e3), 10.0, np.eye(3), center_of_mass=(0.0, 0.0, moment),
        motion_pattern="1R2T", plane_normal=(0, 1, 0), tension_min=1.0,
    )  # fmt: skip


CASES: dict[str, tuple[sl.Robot, sl.CableModel]] = {
    "mixed": (LOW, sl.Catenary()),
    "parabolic": (LOW, sl.Parabolic()),
    "empirical": (LOW.replace(cables=LOW.cables.replace(linear_density=0.3), tension_min=8.0), sl.Empirical()),
    "parabolic, pulleys": (LOW.replace(winches=sl.Winch(0.1, dead_cable=3.0, dead_rise=2.0)), sl.Parabolic()),
    "pulleys": (LOW.replace(winches=sl.Winch(0.1, dead_cable=3.0, dead_rise=2.0)), sl.Catenary()),
    "soft": (LOW.replace(cables=LOW.cables.replace(axial_stiffness=2e3)), sl.Catenary()),
    "elastic": (LOW.replace(cables=LOW.cables.replace(axial_stiffness=500.0)), sl.Elastic()),
    "heavy": (LOW.replace(cables=LOW.cables.replace(linear_density=0.3), tension_min=8.0), sl.Catenary()),
    "planar": (planar(0.5), sl.Catenary()),
}


def poses_of(robot: sl.Robot, count: int) -> sl.Pose:
    rng = np.random.default_rng(7)
    place = rng.uniform(-1.0, 1.0, (count, 3)) * TOP + (0.0, 0.0, 5.5)
    turn = rng.uniform(-0.2, 0.2, (count, 3))
    if robot.motion_pattern == "1R2T":
        place, turn = np.column_stack((place[:, 0] / 2.0, 0.0 * place[:, 1], 0.25 * place[:, 2])), turn * (0, 1, 0)
    else:
        place[:, 2] *= 0.5
    return sl.Pose.from_euler(place, *turn.T[::-1])


@pytest.mark.parametrize("case", CASES)
def test_the_status_is_the_sign_of_the_smallest_stiffness(case: str) -> None:
    robot, model = CASES[case]
    plan = sl.inverse(robot, poses_of(robot, 400), model, METHOD)
    found = sl.stiffness(plan.state).matrix
    arc = np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1)
    units = np.ones((len(robot.freedom), 1))
    units[np.abs(robot.freedom[:, 3:]).sum(axis=1) > 0.0] = 1.0 / np.sqrt(np.mean(arc**2))
    motions = robot.freedom * units
    matrix = motions @ found @ motions.T
    known = ~np.isnan(matrix[:, 0, 0])
    least = np.linalg.eigvalsh(0.5 * (matrix + np.swapaxes(matrix, 1, 2))[known])[:, 0]
    np.testing.assert_array_equal(known, plan.feasible)
    np.testing.assert_array_equal(plan.status[known] == sl.PoseStatus.UNSTABLE, least <= 0.0)
    np.testing.assert_array_equal(plan.solved[known], least > 0.0)
    np.testing.assert_allclose(plan.stiffness_min[known], least, rtol=1e-9, atol=1e-9 * np.abs(found[known]).max())
    assert np.isnan(plan.stiffness_min[~known]).all()
    assert min((least <= 0.0).sum(), (least > 0.0).sum()) >= 10


def test_an_unstable_plan_has_values_and_its_platform_leaves() -> None:
    plan = sl.inverse(LOW, POSE, tension=METHOD)
    assert plan.status == sl.PoseStatus.UNSTABLE
    assert plan.feasible
    assert not plan.solved
    assert plan.stiffness_min == pytest.approx(-66.5, abs=0.05)
    assert np.isfinite(plan.unstrained_length).all()
    assert plan.shortfall == 0.0
    near = sl.Pose.from_euler((2.001, 1.0, 1.5), 0.0, 0.0, 0.0)
    found = sl.forward(LOW, plan.unstrained_length, near)
    assert found.stable
    assert np.linalg.norm(found.pose.position - POSE.position) > 0.2
    exact = sl.forward(LOW, plan.unstrained_length, POSE)
    assert exact.status == sl.ForwardStatus.UNSTABLE
    assert exact.stiffness_min == pytest.approx(float(plan.stiffness_min), rel=1e-6)
    higher = sl.inverse(LOW.replace(tension_min=100.0), POSE, tension=METHOD)
    assert higher.solved
    assert higher.stiffness_min > 0.0


def test_the_check_is_optional_and_changes_no_number() -> None:
    poses = poses_of(LOW, 100)
    checked, plain = (sl.inverse(LOW, poses, tension=METHOD, stability=each) for each in (True, False))
    assert (checked.status == sl.PoseStatus.UNSTABLE).any()
    assert not (plain.status == sl.PoseStatus.UNSTABLE).any()
    np.testing.assert_array_equal(plain.feasible, checked.feasible)
    np.testing.assert_array_equal(plain.unstrained_length, checked.unstrained_length)
    with pytest.raises(sl.InvalidValueError, match="stability"):
        sl.inverse(LOW, POSE, stability="yes")  # type: ignore[arg-type]


@pytest.mark.parametrize("stability", [True, False])
def test_a_solver_agrees_with_the_batch(stability: bool) -> None:
    poses, lengths = poses_of(LOW, 100), np.empty(8)
    plan = sl.inverse(LOW, poses, tension=METHOD, stability=stability)
    solver = sl.InverseSolver(LOW, tension=METHOD, stability=stability)
    for k, pose in enumerate(poses):
        assert solver.step_into(pose.position, pose.quaternion, lengths) == plan.status[k]
        np.testing.assert_array_equal(lengths, plan.unstrained_length[k])


MODELS = (sl.Catenary(), sl.Elastic(), sl.Parabolic(), sl.Empirical(), sl.Straight())


@pytest.mark.parametrize("name", [name for name in sl.robot_names() if name != "article-mixed"])
def test_presets_need_no_eigenvalues(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The proof from the solution takes a tenth of the time of the inverse; eigenvalues would take as long as it."""
    monkeypatch.setattr(inverse_rows, "stabilities_of_poses", None)
    robot = sl.load_robot(name)
    for model in MODELS:
        plan = sl.inverse(robot, box_poses(robot, 300, seed=3), model)
        assert plan.solved.sum() >= 250
        least = plan.stiffness_min[plan.solved]
        assert np.isnan(least).all() if model == sl.Straight() else (least > 0.0).all()


@pytest.mark.parametrize("case", CASES)
def test_proofs_and_eigenvalues_agree(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """At tensions near the limit of stability, all poses have the same status by proofs and by eigenvalues alone."""
    robot, _ = CASES[case]
    proved, decide = 0, inverse_rows.decide_stability

    def by_eigenvalues(robot: Any, model: Any, rows: Any, found: inverse_rows.InverseRows) -> None:
        nonlocal proved
        proved += int((found.pose_status == codes.POSE_SOLVED).sum())
        decide(robot, model, rows, found)
        expected = found.pose_status.copy()
        found.pose_status[np.isin(expected, (codes.POSE_SOLVED, codes.POSE_UNSTABLE))] = codes.UNPROVED_STABILITY
        decide(robot, model, rows, found)
        np.testing.assert_array_equal(found.pose_status, expected)

    monkeypatch.setattr(inverse_rows, "decide_stability", by_eigenvalues)
    for model in MODELS:
        for least in (1.0, 30.0, 60.0, 120.0):
            tight = robot.replace(tension_min=least)
            sl.inverse(tight, poses_of(tight, 150), model, METHOD)
    assert proved > 100


def test_gaps_separate_infeasible_and_unstable_poses() -> None:
    place = np.linspace((2.0, 1.0, 1.5), (2.0, 1.0, 9.0), 40)
    plan = sl.inverse(LOW, sl.Pose(place, np.eye(3)), tension=METHOD)
    kinds = [gap.status for gap in plan.gaps]
    assert kinds[0] is sl.PoseStatus.UNSTABLE
    assert kinds[-1] is sl.PoseStatus.INFEASIBLE
    unstable = plan.gaps[0]
    assert np.isnan(unstable.shortfall)
    assert unstable.cables == ()
    covered = sorted(k for gap in plan.gaps for k in range(gap.first, gap.last + 1))
    np.testing.assert_array_equal(covered, np.flatnonzero(~plan.solved))


def test_an_unstable_plan_is_saved_and_loaded(tmp_path: Any) -> None:
    plan = sl.inverse(LOW, poses_of(LOW, 50), tension=METHOD)
    plan.save(tmp_path / "run.nc")
    again = sl.load_plan(tmp_path / "run.nc")
    np.testing.assert_array_equal(again.status, plan.status)
    np.testing.assert_array_equal(again.stiffness_min, plan.stiffness_min)


def test_a_controller_and_a_fast_motion_refuse_unstable_poses() -> None:
    path = sl.quintic_path([(2.0, 1.0, 1.5), (2.0, 1.2, 1.5)], durations=2.0)
    assert (sl.inverse(LOW, path, tension=METHOD).status == sl.PoseStatus.UNSTABLE).all()
    with pytest.raises(sl.InvalidValueError, match="unstable"):
        sl.fastest(LOW, path)
    with pytest.raises(sl.control.RefusedError, match="UNSTABLE"):
        sl.control.checks.plan_motion(LOW, path, 0.01, sl.Catenary(), METHOD)

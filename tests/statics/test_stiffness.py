"""Stiffness, sensitivities and modes compared with differences of an independent balance, SciPy and a pendulum."""

import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from sagline.statics.stiffness import compliance_of, least_stiffness
from tests.kinematics.feasible import center, feasible_plan, motion_between, unbalance

MODELS = [sl.Catenary(), sl.Elastic(), sl.Parabolic(), sl.Empirical()]
COGIRO = sl.load_robot("cogiro")
WRENCH = np.array([20.0, -15.0, 10.0, 8.0, -6.0, 12.0])


def richardson(at, h: float) -> Array:  # type: ignore[no-untyped-def]
    """Derivative of at(h) at 0 from central differences at h and h/2."""
    coarse = (at(h) - at(-h)) / (2 * h)
    fine = (at(0.5 * h) - at(-0.5 * h)) / h
    slope: Array = (4.0 * fine - coarse) / 3.0
    return slope


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
def test_the_matrix_is_minus_the_slope_of_the_wrench(model: sl.CableModel) -> None:
    plan = feasible_plan(COGIRO, 3, seed=1, model=model)
    found = sl.forward(COGIRO, plan.unstrained_length, plan.state.pose, model, wrench=WRENCH)
    matrices = sl.stiffness(found.state).matrix
    for pose, lengths, matrix in zip(found.pose, found.state.cables.unstrained_length, matrices, strict=True):

        def wrench(motion: Array, pose: sl.Pose = pose, lengths: Array = lengths) -> Array:
            turned = Rotation.from_rotvec(motion[3:]) * Rotation.from_quat(pose.quaternion.copy())
            position = center(pose, COGIRO) + motion[:3] - turned.apply(COGIRO.center_of_mass.copy())
            return unbalance(COGIRO, model, lengths.copy(), position, turned, WRENCH)

        columns = [-richardson(lambda h, one=one, of=wrench: of(h * one), 5e-5) for one in np.eye(6)]
        np.testing.assert_allclose(matrix, np.transpose(columns), rtol=1e-7, atol=1e-7 * np.abs(matrix).max())


def test_stiffness_is_symmetric_except_for_half_of_a_moment() -> None:
    plan = feasible_plan(COGIRO, 2, seed=2)
    free = sl.stiffness(plan.state).matrix
    np.testing.assert_allclose(free, np.swapaxes(free, 1, 2), atol=1e-8)
    loaded = sl.inverse(COGIRO, plan.state.pose[0], wrench=WRENCH, tension=sl.MinimumNorm())
    skew = sl.stiffness(loaded.state).matrix
    skew = 0.5 * (skew - skew.T)
    x, y, z = -0.5 * WRENCH[3:]
    np.testing.assert_allclose(skew[3:, 3:], [[0, -z, y], [z, 0, -x], [-y, x, 0]], atol=1e-8)
    np.testing.assert_allclose(skew[:3], 0.0, atol=1e-8)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
def test_sensitivities_are_the_slopes_of_the_forward_solution(model: sl.CableModel) -> None:
    plan = feasible_plan(COGIRO, 2, seed=3, model=model)
    lengths, pose = plan.unstrained_length, plan.state.pose
    found = sl.stiffness(plan.state)
    density, axial = COGIRO.cables.linear_density, COGIRO.cables.axial_stiffness

    def solve(robot: sl.Robot = COGIRO, change: Array | float = 0.0, wrench: Array | None = None) -> sl.ForwardSolution:
        return sl.forward(robot, lengths + change, pose, model, wrench)

    rest = solve()

    def compare(slope: Array, expected: Array) -> None:
        np.testing.assert_allclose(slope, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max() + 1e-13)

    for i in (0, 3):
        one = np.eye(8)[i]
        by_length = richardson(lambda h, one=one: motion_between(rest, solve(change=h * one)), 2e-4)
        compare(found.length_sensitivity[..., i], by_length)

        def heavier(h: float, one: Array = one) -> Array:
            cables = sl.Cable(density * (1.0 + h * one), axial)
            return motion_between(rest, solve(COGIRO.replace(cables=cables)))

        def stiffer(h: float, one: Array = one) -> Array:
            return motion_between(rest, solve(COGIRO.replace(cables=sl.Cable(density, axial * (1.0 + h * one)))))

        compare(found.density_sensitivity[..., i], richardson(heavier, 1e-2) / density[i])
        compare(found.stiffness_sensitivity[..., i], richardson(stiffer, 1e-2) / axial[i])
    for k in range(6):
        push = np.eye(6)[k]
        by_load = richardson(lambda h, push=push: motion_between(rest, solve(wrench=h * push)), 10.0)
        compare(found.compliance[..., k], by_load)


def test_modes_agree_with_scipy() -> None:
    plan = feasible_plan(COGIRO, 3, seed=4)
    modes = sl.modes(plan.state)
    for i in range(3):
        rotation = plan.state.pose[i].matrix
        mass = scipy.linalg.block_diag(COGIRO.mass * np.eye(3), rotation @ COGIRO.inertia @ rotation.T)
        matrix = sl.stiffness(plan.state).matrix[i]
        squares = scipy.linalg.eigh(matrix, mass, eigvals_only=True)
        np.testing.assert_allclose((2 * np.pi * modes.frequency[i]) ** 2, squares, rtol=1e-9)
        np.testing.assert_allclose(modes.shape[i].T @ mass @ modes.shape[i], np.eye(6), atol=1e-12)
        np.testing.assert_allclose(matrix @ modes.shape[i], mass @ modes.shape[i] * squares, atol=1e-6)


def test_a_mass_on_one_cable_is_a_pendulum_on_a_spring() -> None:
    robot = sl.Robot("pendulum", [[0, 0, 10.0]], [[0, 0, 0]], sl.Cable(1e-9, 1e5), 20.0, motion_pattern="3T")
    found = sl.forward(robot, [4.0])
    assert found.status == sl.ForwardStatus.SOLVED
    stretched = 4.0 * (1.0 + 20.0 * 9.81 / 1e5)
    np.testing.assert_allclose(found.pose.position, [0, 0, 10.0 - stretched], atol=1e-9)
    swing = np.sqrt(9.81 / stretched) / (2 * np.pi)
    bounce = np.sqrt(1e5 / 4.0 / 20.0) / (2 * np.pi)
    np.testing.assert_allclose(sl.modes(found.state).frequency, [swing, swing, bounce], rtol=1e-6)


def test_a_pose_without_lengths_has_no_stiffness() -> None:
    robot = sl.load_robot("article-suspended")
    plan = sl.inverse(robot, sl.Pose([[0, 0, 1.5], [0, 0, 9.0]], np.tile(np.eye(3), (2, 1, 1))))
    assert plan.feasible.tolist() == [True, False]
    for values in (
        sl.stiffness(plan.state).matrix,
        sl.stiffness(plan.state).compliance,
        sl.modes(plan.state).frequency,
    ):
        assert np.isfinite(values[0]).all()
        assert np.isnan(values[1]).all()


def test_a_platform_suspended_at_one_point_has_no_compliance() -> None:
    frame = [[3, 3, 3], [-3, 3, 3], [-3, -3, 3], [3, -3, 3]]
    robot = sl.Robot("point", frame, np.zeros((4, 3)), sl.Cable(0.05, 5e4), 10.0, np.eye(3))
    found = sl.forward(robot, [4.4] * 4)
    assert found.status == sl.ForwardStatus.SINGULAR
    assert not found.stable
    assert np.isnan(sl.stiffness(found.state).compliance).all()


@pytest.mark.parametrize("pattern", ["3R3T", "3T"])
def test_compliances_are_inverses_for_the_free_motions_and_nan_if_singular(pattern: str) -> None:
    freedom = COGIRO.replace(motion_pattern=pattern).freedom
    rng = np.random.default_rng(8)
    matrices = rng.normal(size=(50, 6, 6)) * np.outer([1.0, 1.0, 1.0, 1e3, 1e3, 1e3], [1.0, 1.0, 1.0, 1e3, 1e3, 1e3])
    matrices[1, :, 0] = matrices[1, :, 1]
    matrices[2, 0, 0] = np.nan
    found = compliance_of(freedom, matrices)
    assert np.isnan(found[1:3]).all()
    expected = freedom.T @ np.linalg.inv(freedom @ matrices[3:] @ freedom.T) @ freedom
    np.testing.assert_allclose(found[3:], expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


def test_least_stiffness_is_the_smallest_ratio_of_force_to_displacement() -> None:
    freedom, rng = COGIRO.freedom, np.random.default_rng(9)
    root = rng.normal(size=(20, 6, 6))
    matrices = root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(6)
    matrices[0] -= 5.0 * np.eye(6)
    matrices[1] = np.nan
    found = least_stiffness(freedom, matrices)
    assert found[0] == 0.0
    assert np.isnan(found[1])
    largest = np.linalg.norm(np.linalg.inv(matrices[2:])[:, :3, :3], 2, axis=(1, 2))
    np.testing.assert_allclose(found[2:], 1.0 / largest, rtol=1e-11)


def test_a_slack_weightless_cable_leaves_a_basis_of_length_changes() -> None:
    pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
    lengths = sl.inverse(COGIRO, pose, model=sl.Elastic()).unstrained_length + np.array([0.5, *[0.0] * 7])
    found = sl.stiffness(sl.forward(COGIRO, lengths, pose, sl.Elastic()).state)
    null = found.null_lengths
    np.testing.assert_allclose(null.T @ null, np.eye(2), atol=1e-13)
    np.testing.assert_allclose(found.length_sensitivity @ null, 0.0, atol=1e-11)
    assert np.linalg.norm(null[0]) == pytest.approx(1.0)  # the slack cable has no effect

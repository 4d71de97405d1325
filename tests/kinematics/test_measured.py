"""Noisy lengths and load cells: the corrected pose is more accurate, and its covariance is correct."""

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.feasible import feasible_plan, motion_between, position_error

COGIRO = sl.load_robot("cogiro")
PLAN = feasible_plan(COGIRO, 40, seed=1)
TRUE = sl.forward(COGIRO, PLAN.unstrained_length, PLAN.state.pose)
TENSIONS = PLAN.state.cables.frame_end_tension
COUNT = len(TENSIONS)


def test_the_covariance_is_that_of_the_errors() -> None:
    rng = np.random.default_rng(2)
    lengths = PLAN.unstrained_length + rng.normal(scale=0.003, size=(COUNT, 8))
    tensions = TENSIONS + rng.normal(scale=1.0, size=(COUNT, 8))
    plain = sl.forward(COGIRO, lengths, PLAN.state.pose)
    found = sl.forward(COGIRO, lengths, PLAN.state.pose, tension_measured=sl.MeasuredTension(tensions, 1.0, 0.003))
    assert found.stable.all()
    assert found.wrench_residual.max() < 1e-8
    assert found.covariance is not None
    error = motion_between(TRUE, found)
    squares = np.einsum("ni,ni->n", error, np.linalg.solve(found.covariance, error[..., None])[..., 0])
    # the sum has a chi-square distribution; five of its standard deviations
    assert abs(squares.sum() - 6 * COUNT) < 5 * np.sqrt(2 * 6 * COUNT)
    assert np.median(position_error(found, PLAN.state.pose)) < 0.95 * np.median(position_error(plain, PLAN.state.pose))


def test_without_readings_only_the_lengths_are_used() -> None:
    lengths = PLAN.unstrained_length[:3]
    blind = sl.MeasuredTension(np.full(8, np.nan), 5.0, 0.003)
    found = sl.forward(COGIRO, lengths, PLAN.state.pose[:3], tension_measured=blind)
    np.testing.assert_allclose(found.pose.position, PLAN.state.pose.position[:3], atol=1e-9)
    by_length = sl.stiffness(TRUE.state).length_sensitivity[:3]
    assert found.covariance is not None
    np.testing.assert_allclose(found.covariance, 0.003**2 * by_length @ np.swapaxes(by_length, 1, 2), rtol=1e-6)


def test_deviations_per_cable() -> None:
    """Covariance of the least-squares fit, B (1/sigma_L^2 + S^T S/sigma_T^2)^-1 B^T, cable by cable."""
    by_tension, by_length = np.geomspace(0.3, 10.0, 8), np.linspace(0.001, 0.004, 8)
    measured = sl.MeasuredTension(TENSIONS[0], by_tension, by_length)
    found = sl.forward(COGIRO, PLAN.unstrained_length[0], PLAN.state.pose[0], tension_measured=measured)
    known = sl.stiffness(found.state)
    slopes, motion = known.tension_sensitivity, known.length_sensitivity
    weight = np.diag(by_length**-2) + slopes.T @ np.diag(by_tension**-2) @ slopes
    expected = motion @ np.linalg.solve(weight, motion.T)
    assert found.covariance is not None
    np.testing.assert_allclose(found.covariance, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_exact_readings_correct_wrong_lengths() -> None:
    # one encoder has an error of 20 mm and a large deviation; all load cells are good
    wrong = PLAN.unstrained_length[0].copy()
    wrong[3] += 0.02
    deviation = np.full(8, 1e-5)
    deviation[3] = 0.05
    plain = sl.forward(COGIRO, wrong)
    found = sl.forward(COGIRO, wrong, tension_measured=sl.MeasuredTension(TENSIONS[0], 0.01, deviation))
    assert position_error(plain, PLAN.state.pose[0]) > 3e-3
    assert position_error(found, PLAN.state.pose[0]) < 1e-5
    assert found.state.cables.unstrained_length[3] == pytest.approx(PLAN.unstrained_length[0, 3], abs=1e-5)


def test_the_slopes_of_the_frame_end_tensions_are_those_of_the_forward_solution() -> None:
    lengths, pose = PLAN.unstrained_length[0], PLAN.state.pose[0]
    state = sl.forward(COGIRO, lengths, pose).state
    found = sl.stiffness(state).tension_sensitivity

    def tensions(change: Array) -> Array:
        return sl.forward(COGIRO, lengths + change, pose).state.cables.frame_end_tension

    def central(step: Array) -> Array:
        slope: Array = (tensions(step) - tensions(-step)) / (2.0 * np.abs(step).max())
        return slope

    for j in range(8):
        step = 2e-4 * np.eye(8)[j]
        expected = (4.0 * central(0.5 * step) - central(step)) / 3.0
        # the weight of additional cable is 1e-5 of these slopes
        np.testing.assert_allclose(found[:, j], expected, atol=1e-7 * np.abs(expected).max())


def test_bad_input() -> None:
    lengths = PLAN.unstrained_length[:2]
    with pytest.raises(sl.InvalidValueError, match="tension_deviation"):
        sl.MeasuredTension(TENSIONS, 0.0, 0.003)
    with pytest.raises(sl.InvalidValueError, match="frame_end_tension"):
        sl.MeasuredTension([-1.0] * 8, 5.0, 0.003)
    with pytest.raises(sl.InvalidValueError, match="frame_end_tension"):
        sl.forward(COGIRO, lengths, tension_measured=sl.MeasuredTension([100.0] * 7, 5.0, 0.003))
    with pytest.raises(sl.InvalidValueError, match="Straight"):
        sl.forward(COGIRO, lengths, model=sl.Straight(), tension_measured=sl.MeasuredTension([100.0] * 8, 5.0, 0.003))

"""Speeds compared with differences of counts, torques with the balance of power."""

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.robot.drum import Drums
from tests.kinematics.winches import wound
from tests.refusal import refused
from tests.tension.reference import presets

LIMITS: dict[str, Any] = {"inertia": 2e-4, "friction": 15.0, "speed_limit": 350.0, "torque_limit": 2.0}


@pytest.fixture(scope="module")
def plan() -> sl.Plan:
    path = sl.quintic_path([(0, 0, 1.5), (3, 1, 2.5)], durations=3.0, rate=200.0)
    return sl.inverse(wound(**LIMITS), path)


@pytest.fixture(scope="module")
def rates(plan: sl.Plan) -> sl.WinchRates:
    return sl.winch_rates(plan)


def differences(plan: sl.Plan, values: np.ndarray) -> np.ndarray:
    """Central differences between samples, of second order."""
    assert plan.path is not None
    return np.asarray((values[2:] - values[:-2]) / (plan.path.time[2:] - plan.path.time[:-2])[:, None])


def test_speeds_are_differences_of_counts(plan: sl.Plan, rates: sl.WinchRates) -> None:
    drums = Drums(plan.state.one_robot)
    counts = drums.counts(plan.unstrained_length * (1.0 + drums.rest_strain))
    assert rates.count_rate is not None
    scale = np.abs(rates.count_rate).max()
    off = np.abs(differences(plan, counts) - rates.count_rate[1:-1])
    turns, _ = drums.turns(plan.unstrained_length * (1.0 + drums.rest_strain))
    layer = np.floor(turns / 20.0)
    same = layer[2:] == layer[:-2]  # the speed jumps at the end of a layer
    assert not same.all()
    assert off[same].max() < 2e-4 * scale
    np.testing.assert_allclose(rates.count_rate, rates.motor_speed / (2.0 * np.pi) * 4096.0, rtol=1e-14)
    np.testing.assert_allclose(rates.motor_speed, rates.drum_speed * np.array([12.0, -12.0] * 4), rtol=1e-14)
    np.testing.assert_allclose(
        differences(plan, rates.motor_speed)[same], rates.motor_acceleration[1:-1][same],
        atol=1e-3 * np.abs(rates.motor_acceleration).max(),
    )  # fmt: skip


def test_power_is_that_of_cable_friction_and_inertia(plan: sl.Plan, rates: sl.WinchRates) -> None:
    assert rates.motor_torque is not None
    assert plan.length_rate is not None
    pull = plan.length_rate * (1.0 + 160.0 / plan.state.one_robot.cables.axial_stiffness)
    motor = rates.motor_torque * rates.motor_speed
    spent = 15.0 * np.abs(pull) - rates.drum_tension * pull + 2e-4 * rates.motor_speed * rates.motor_acceleration
    np.testing.assert_allclose(motor, spent, rtol=0.0, atol=1e-10 * np.abs(motor).max())
    assert np.abs(spent + rates.drum_tension * pull).max() > 0.02 * np.abs(motor).max()


def test_the_torque_has_the_radius_of_the_layer(plan: sl.Plan, rates: sl.WinchRates) -> None:
    assert rates.motor_torque is not None
    drums = Drums(plan.state.one_robot)
    turns, _ = drums.turns(plan.unstrained_length * (1.0 + drums.rest_strain))
    radius = 0.05 + np.floor(turns / 20.0) * 0.004 * np.sqrt(3.0) / 2.0
    assert np.unique(radius).size > 1
    pull = 15.0 * np.sign(rates.drum_speed) - rates.drum_tension
    expected = 2e-4 * rates.motor_acceleration + pull * radius / np.array([12.0, -12.0] * 4)
    np.testing.assert_allclose(rates.motor_torque, expected, rtol=1e-3, atol=1e-3)
    # without pulleys and dead length the tension at the drum is the frame-end tension
    np.testing.assert_allclose(rates.drum_tension, plan.state.cables.frame_end_tension, rtol=1e-14)


def test_exceeded_limits_are_marked(rates: sl.WinchRates) -> None:
    assert rates.too_fast is not None
    assert rates.too_strong is not None
    assert rates.motor_torque is not None
    np.testing.assert_array_equal(rates.too_fast, np.abs(rates.motor_speed) > 350.0)
    np.testing.assert_array_equal(rates.too_strong, np.abs(rates.motor_torque) > 2.0)
    assert 0 < rates.too_fast.sum() < rates.too_fast.size
    assert 0 < rates.too_strong.sum() < rates.too_strong.size
    np.testing.assert_array_equal(rates.exceeding, (rates.too_fast | rates.too_strong).any(axis=1))


def test_unknown_quantities_are_none(plan: sl.Plan) -> None:
    robot = wound(counts_per_turn=None, length_zero=None)
    rates = sl.winch_rates(sl.inverse(robot, plan.path))  # type: ignore[arg-type]
    assert (rates.motor_torque, rates.count_rate, rates.too_fast, rates.too_strong) == (None,) * 4
    assert not rates.exceeding.any()
    np.testing.assert_array_equal(rates.drum_speed, sl.winch_rates(plan).drum_speed)


def test_samples_without_lengths_have_no_rates() -> None:
    path = sl.quintic_path([(0, 0, 1.5), (9, 1, 2.5), (0, 0, 1.5)], durations=3.0, rate=20.0)
    plan = sl.inverse(wound(**LIMITS), path)
    assert 0 < plan.feasible.sum() < plan.feasible.size
    rates = sl.winch_rates(plan)
    for values in (rates.drum_speed, rates.motor_acceleration, rates.motor_torque):
        assert values is not None
        np.testing.assert_array_equal(np.isfinite(values).all(axis=1), plan.feasible)
    assert not rates.exceeding[~plan.feasible].any()


def test_poses_without_times_have_no_rates(plan: sl.Plan) -> None:
    with refused("plan", "a plan of poses without times"):
        sl.winch_rates(sl.inverse(wound(), plan.state.pose[0]))


def test_the_lever_arm_differs_from_the_radius_as_documented() -> None:
    """A drum with one layer whose exit point moves from 40 mm on one side of the pulley to 40 mm on the other."""
    robot = wound(drum_width=0.08, layers=1, cable_length=12.0, length_zero=10.0)
    drums = Drums(robot)
    turns = np.linspace(0.0, 20.0, 201)[:, None] * np.ones(8)
    _, travel = drums.turns(drums.lengths(turns))
    off = travel / (2.0 * np.pi * 0.05) - 1.0
    helix = np.hypot(2.0 * np.pi * 0.05, 0.004) / (2.0 * np.pi * 0.05) - 1.0
    assert 5e-5 < helix < 1e-4
    assert 100.0 * np.abs(off - helix).max() == pytest.approx(0.06, abs=0.005)


def test_a_preset_with_only_a_drum_radius_has_rates() -> None:
    robot = sl.load_robot("article-prototype")
    plan = sl.inverse(robot, sl.quintic_path([(0.0, 0.0, 1.5), (0.5, 0.5, 1.5)], durations=2.0))
    rates = sl.winch_rates(plan)
    assert robot.winches is not None
    assert plan.length_rate is not None
    assert rates.motor_torque is not None
    np.testing.assert_allclose(rates.motor_speed, plan.length_rate * 20.0 / 0.03, rtol=1e-12)
    friction = 15.0 * np.sign(rates.motor_speed)
    expected = 3.19e-5 * rates.motor_acceleration + (friction - rates.drum_tension) * 0.03 / 20.0
    np.testing.assert_allclose(rates.motor_torque, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("robot", presets(), ids=lambda robot: robot.name)
def test_every_preset_with_drums_has_rates_and_the_others_name_what_is_missing(robot: sl.Robot) -> None:
    assert robot.test_box is not None
    middle, size = 0.5 * (robot.test_box.low + robot.test_box.high), robot.test_box.high - robot.test_box.low
    plan = sl.inverse(robot, sl.quintic_path([middle, middle + 0.05 * size], durations=2.0, rate=20))
    if robot.winches is None or robot.winches.drum_radius is None:
        with pytest.raises(sl.InvalidValueError) as caught:
            sl.winch_rates(plan)
        assert "drum_radius" in str(caught.value)
        return
    rates = sl.winch_rates(plan)
    assert plan.length_rate is not None
    assert plan.feasible.all()
    paid_out = plan.length_rate * (1.0 + robot.winches.winding_tension / robot.cables.axial_stiffness)
    radius = paid_out[1:-1] / rates.drum_speed[1:-1]
    assert radius == pytest.approx(np.broadcast_to(robot.winches.drum_radius, radius.shape), rel=0.1)
    assert rates.motor_torque is not None
    assert np.isfinite(rates.motor_torque).all()
    # a slow motion: the torque at the motor is that of the cable's tension and the friction
    against = robot.winches.friction * np.sign(rates.drum_speed[1:-1]) - rates.drum_tension[1:-1]
    assert rates.motor_torque[1:-1] == pytest.approx(against * radius / robot.winches.gear, rel=0.2, abs=0.02)

"""Simulations of robots whose pulleys swivel about axes of any direction."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from tests.kinematics.test_slanted import AXES, four_cables, with_axes
from tests.refusal import refused

POSE = sl.Pose.from_euler([1.0, 0.5, 2.0], 0.0, 0.0, 0.1)


@pytest.mark.parametrize("kind", AXES)
def test_a_robot_at_rest_keeps_pose_and_tensions(kind: str) -> None:
    state = sl.inverse(with_axes(AXES[kind], 0.15), POSE).state
    run = sl.simulate(state, duration=0.1)
    np.testing.assert_allclose(run.pose.position, np.tile(POSE.position, (len(run.time), 1)), atol=1e-10)
    np.testing.assert_allclose(run.tensions[-1], state.cables.frame_end_tension, rtol=1e-8)


def test_motions_end_at_the_equilibrium_of_forward() -> None:
    robot = with_axes(AXES["any"], 0.15)
    state = sl.inverse(robot, POSE).state
    longer = np.add(state.unstrained_length, [0.01, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.0])
    table = ([0.0, 0.5, 6.0], [state.unstrained_length, longer, longer])
    run = sl.simulate(state, unstrained_length=table, damping=sl.Damping(loss_time=0.05))
    rest = sl.forward(robot, longer, POSE).state
    np.testing.assert_allclose(run.pose.position[-1], rest.pose.position, atol=1e-6)
    np.testing.assert_allclose(run.tensions[-1], rest.cables.frame_end_tension, rtol=1e-4)


def test_winches_supply_the_energy_of_the_motion() -> None:
    robot = with_axes(AXES["any"], 0.15)
    state = sl.inverse(robot, POSE).state
    longer = np.add(state.unstrained_length, [0.1, 0.1, 0.05, 0.05, 0.1, 0.1, 0.05, 0.05])
    table = ([0.0, 0.4, 0.8], [state.unstrained_length, longer, longer])
    run = sl.simulate(state, unstrained_length=table, damping=sl.Damping(loss_time=0.005))
    assert np.ptp(run.energy.supplied) > 10.0
    assert np.abs(run.energy.error).max() < 1e-7 * np.ptp(run.energy.supplied)


def check_that_small_swings_have_a_frequency_of_the_modes(robot: sl.Robot) -> None:
    """Push a robot of four cables about its vertical axis, and compare the spectrum of its rotation."""
    state = sl.inverse(robot, sl.Pose.from_euler([0.1, 0.05, 1.3], 0.0, 0.0, 0.0)).state
    lowest = float(sl.modes(state).frequency[0])
    push = ([0.0, 0.01, 0.02], np.outer([0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.02]))
    run = sl.simulate(state, wrench=push, duration=8.0 / lowest, record=0.02 / lowest)
    turned = (run.pose.rotation * state.pose.rotation.inv()).as_rotvec()
    shape = np.linalg.svd(turned - turned.mean(axis=0), full_matrices=False)[2][0]
    signal = turned @ shape * np.hanning(len(turned))
    spectrum = np.abs(np.fft.rfft(signal, 32 * len(signal)))
    found = np.fft.rfftfreq(32 * len(signal), run.time[1])[1 + int(spectrum[1:].argmax())]
    assert np.abs(sl.modes(state).frequency / found - 1.0).min() < 5e-3


def test_small_swings_have_the_frequencies_of_the_modes() -> None:
    check_that_small_swings_have_a_frequency_of_the_modes(four_cables())


def test_cables_with_mass_need_vertical_axes() -> None:
    with refused("winches: swivel_axis[0]", allowed="up or down here", kind=sl.InvalidValueError):
        sl.simulate(sl.inverse(with_axes(AXES["any"]), POSE).state, duration=0.1, cable_mass="lumped")

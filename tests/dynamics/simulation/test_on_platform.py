"""Simulations of robots with winches on the platform."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.dynamics.simulation.test_slanted import check_that_small_swings_have_a_frequency_of_the_modes
from tests.kinematics.test_on_platform import POSE, ROBOTS
from tests.kinematics.test_slanted import four_cables

# principal axes in other directions and in another order than those of the platform
TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
INERTIA = TURN @ np.diag([30.0, 12.0, 21.0]) @ TURN.T
WINCHES = [("ideal", 1e-7), ("robot", 2e-5)]  # with the error of the energy, relative to the supplied energy


def robot_of(kind: str) -> sl.Robot:
    return ROBOTS[kind].replace(inertia=0.5 * (INERTIA + INERTIA.T))


def wound(state: sl.Equilibrium) -> Array:
    return np.add(state.unstrained_length, [0.1, 0.1, 0.05, 0.05, 0.1, 0.1, 0.05, 0.05])


@pytest.mark.parametrize("kind", ROBOTS)
def test_equilibria_of_forward_are_at_rest(kind: str) -> None:
    robot = robot_of(kind)
    lengths = wound(sl.inverse(robot, POSE).state)
    state = sl.forward(robot, lengths, POSE).state
    run = sl.simulate(state, duration=0.1)
    np.testing.assert_allclose(run.pose.position, np.tile(state.pose.position, (len(run.time), 1)), atol=1e-9)
    np.testing.assert_allclose(run.pose.matrix, np.tile(state.pose.matrix, (len(run.time), 1, 1)), atol=1e-9)
    np.testing.assert_allclose(run.tensions[-1], state.cables.frame_end_tension, rtol=1e-8)


@pytest.mark.parametrize("kind", ["heavy", "some"])
@pytest.mark.parametrize(("winches", "error"), WINCHES)
def test_winches_supply_the_energy_of_the_motion(kind: str, winches: Literal["ideal", "robot"], error: float) -> None:
    robot = robot_of(kind)
    gains = {"position_gain": 20.0, "speed_gain": 2e3, "integral_gain": 1e4}
    assert robot.winches is not None
    drums = robot.winches.replace(drum_radius=0.05, gear=10.0, inertia=4e-4, winding_tension=150.0, **gains)
    state = sl.inverse(robot.replace(winches=drums), POSE).state
    table = ([0.0, 0.4, 0.8], [state.unstrained_length, wound(state), wound(state)])
    run = sl.simulate(state, unstrained_length=table, winches=winches, damping=sl.Damping(0.002), step=2.5e-4)
    assert np.ptp(run.energy.supplied) > 10.0
    assert np.abs(run.energy.error).max() < error * np.ptp(run.energy.supplied)


def test_moving_anchors_supply_energy_and_a_swing_without_damping_keeps_its_energy() -> None:
    robot = robot_of("some")
    state, time = sl.inverse(robot, POSE).state, np.linspace(0.0, 0.6, 61)
    moved = np.where(time < 0.3, np.sin(np.pi * time / 0.3) ** 2, 0.0)
    places = robot.frame_anchors + moved[:, None, None] * [0.03, -0.02, 0.02]
    run = sl.simulate(state, duration=0.6, anchors=sl.AnchorMotion(time, places), step=2.5e-4)
    assert np.ptp(run.energy.supplied) > 1.0
    assert np.abs(run.energy.error).max() < 1e-6 * np.ptp(run.energy.supplied)
    still = run.time > 0.5
    energy = (run.energy.kinetic + run.energy.potential)[still]
    assert run.energy.kinetic[still].max() > 0.1
    assert np.ptp(energy) < 1e-6 * run.energy.kinetic[still].max()


def test_small_swings_have_the_frequencies_of_the_modes() -> None:
    winches = sl.Winch(
        0.03, swivel_axis=[[1, 0, 1], [-1, 0, 1], [-1, 0, 1], [1, 0, 1]], dead_cable=0.2, on_platform=True
    )
    check_that_small_swings_have_a_frequency_of_the_modes(four_cables().replace(winches=winches))


def test_the_simulator_holds_a_robot_at_its_lengths() -> None:
    state = sl.inverse(robot_of("some"), POSE).state
    simulator = sl.Simulator(state.one_robot, state, winches="ideal")
    for _ in range(50):
        reading = simulator.step(state.unstrained_length, 0.01)
    np.testing.assert_allclose(reading.position, POSE.position, atol=1e-9)
    np.testing.assert_allclose(reading.tension, state.cables.frame_end_tension, rtol=1e-6)

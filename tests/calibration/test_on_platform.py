"""Calibration of robots with winches on the platform: logs with noise, natural frequencies, expected errors."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from tests.calibration.machines import robots
from tests.kinematics.test_on_platform import POSE
from tests.refusal import refused

DRAWN = robots()["aboard"]
LENGTH, CELL, ANCHOR = 1e-3, 2.0, 0.01  # deviations of lengths [m] and load cells [N], tolerance of anchors [m]
SENSORS = sl.Sensors(LENGTH, CELL)


@cache
def true_robot() -> sl.Robot:
    random = np.random.default_rng(1)
    frame = DRAWN.frame_anchors + ANCHOR * random.normal(size=(8, 3))
    return DRAWN.replace(frame_anchors=frame, mass=1.03 * DRAWN.mass, center_of_mass=[0.02, -0.01, 0.03])


@cache
def log_of(noise: float) -> sl.WinchLog:
    robot, random = true_robot(), np.random.default_rng(2)
    turns = Rotation.from_rotvec(random.uniform(-0.1, 0.1, (60, 3)))
    pose = sl.Pose.from_quaternion(random.uniform([-2.0, -2.0, 1.0], [2.0, 2.0, 3.0], (60, 3)), turns.as_quat())
    plan = sl.inverse(robot, pose, tension=sl.MinimumNorm())
    plan = sl.inverse(robot, pose[plan.feasible], tension=sl.MinimumNorm())
    assert plan.feasible.sum() > 30
    tension, lengths = plan.state.cables.frame_end_tension, plan.unstrained_length
    assert robot.winches is not None
    cells = robot.winches.load_cell_gain * tension + robot.winches.load_cell_bias
    return sl.WinchLog(
        unstrained_length=lengths + noise * LENGTH * random.normal(size=lengths.shape),
        load_cells=cells + noise * CELL * random.normal(size=lengths.shape),
        commanded=plan.state.pose,
        sensors=SENSORS,
    )


def test_a_robot_is_found_at_the_noise_of_its_log() -> None:
    drawn = DRAWN.replace(tolerances={"frame_anchors": ANCHOR})
    found = sl.calibrate(drawn, log_of(1.0), ["frame_anchors", "mass", "center_of_mass"], folds=0)
    assert found.status is sl.CalibrationStatus.FOUND
    at, robot = dict(zip(found.parameters.labels, range(len(found.values)), strict=True)), true_robot()
    truth = {f"frame_anchors[{i}].{axis}": robot.frame_anchors[i, k] for i in range(8) for k, axis in enumerate("xyz")}
    truth |= {f"center_of_mass.{axis}": robot.center_of_mass[k] for k, axis in enumerate("xyz")} | {"mass": robot.mass}
    off = np.array([(found.values[at[name]] - truth[name]) / found.standard_error[at[name]] for name in truth])
    assert np.sqrt((off**2).mean()) < 1.4
    assert found.standard_error[at["mass"]] < 1e-3 * robot.mass
    # the cables on the platform in the frame instead cannot explain the log
    assert drawn.winches is not None
    wrong = sl.calibrate(drawn.replace(winches=drawn.winches.replace(on_platform=False)), log_of(1.0), folds=0)
    assert wrong.chi_squared > 1.5 * found.chi_squared


def test_pulley_radii_and_dead_lengths_are_found_at_the_noise() -> None:
    few, true = np.linspace(0.9, 1.1, 8), DRAWN.winches
    assert true is not None
    guess = true_robot().replace(winches=true.replace(pulley_radius=0.06 * few, dead_cable=0.403 * few))
    unknowns = [
        sl.Unknown("pulley_radius", shared=False, deviation=0.02),
        sl.Unknown("dead_cable", shared=False, deviation=0.005),
    ]
    found = sl.calibrate(guess, log_of(1.0), unknowns, folds=0)
    assert found.status is sl.CalibrationStatus.FOUND
    parts = ("pulley_radius", true.pulley_radius, 0.012), ("dead_cable", true.dead_cable, 0.005)
    for name, value, most in parts:
        known, errors = np.transpose([found.value_of(f"{name}[{i}]") for i in range(8)])
        assert np.sqrt(np.square((known - value) / errors).mean()) < 1.5
        assert errors.max() < most


def test_natural_frequencies_are_readings() -> None:
    robot = true_robot()
    commanded = log_of(0.0).commanded
    assert commanded is not None
    state = sl.inverse(robot, commanded, tension=sl.MinimumNorm()).state
    sensors = sl.Sensors(LENGTH, frequency_deviation=0.01)
    log = sl.WinchLog(
        unstrained_length=state.unstrained_length,
        frequency=sl.modes(state).frequency,
        commanded=state.pose,
        sensors=sensors,
    )
    found = sl.calibrate(
        robot.replace(mass=0.97 * robot.mass), log, [sl.Unknown("mass", deviation=0.1 * robot.mass)], folds=0
    )
    assert found.robot.mass == pytest.approx(robot.mass, rel=1e-5)


def test_expected_errors_are_those_of_differences() -> None:
    few = {"mass": 0.5, "pulley_radius": 1e-3, "dead_cable": 2e-3}
    robot = DRAWN.replace(tolerances=few)
    plan = sl.inverse(robot, POSE, tension=sl.MinimumNorm())
    found = plan.uncertainty()
    lengths = plan.unstrained_length

    def moved(other: sl.Robot) -> np.ndarray:
        pose = sl.forward(other, lengths, POSE).pose
        turned = Rotation.from_matrix(pose.matrix @ POSE.matrix.T).as_rotvec()
        return np.concatenate((pose.position - POSE.position, turned))

    assert robot.winches is not None
    winches = robot.winches
    by_mass = moved(robot.replace(mass=robot.mass + 0.25)) - moved(robot.replace(mass=robot.mass - 0.25))
    np.testing.assert_allclose(found.pose_variance[:, found.names.index("mass")], by_mass**2, rtol=1e-3, atol=1e-14)
    for name, step in (("pulley_radius", 1e-3), ("dead_cable", 2e-3)):
        ends = [
            [
                moved(robot.replace(winches=winches.replace(**{name: getattr(winches, name) + sign * one})))
                for sign in (0.5, -0.5)
            ]
            for one in step * np.eye(8)
        ]
        expected = sum((up - down) ** 2 for up, down in ends)
        given = found.pose_variance[:, found.names.index(name)]
        np.testing.assert_allclose(given, expected, rtol=1e-3, atol=1e-5 * expected.max())


def test_swivel_angles_and_straight_cables_are_refused() -> None:
    log = log_of(0.0)
    angles = log.replace(swivel=np.zeros((len(log), 8)), sensors=SENSORS.replace(swivel_deviation=0.01))
    with refused("winches: on_platform[0]", kind=sl.InvalidValueError):
        sl.calibrate(DRAWN, angles)
    with refused("winches: on_platform[0]", kind=sl.InvalidValueError):
        sl.calibrate(DRAWN, log, model=sl.Straight())

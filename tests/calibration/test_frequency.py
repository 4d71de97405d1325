"""Measured natural frequencies: derivatives against differences, and logs of a twin with its own vibration."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.calibration.observations import MachineTerms, unwhitened_slopes
from sagline.calibration.parameters import parameters_of, with_values
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.four_cables import (
    GRAVITY,
    PLATFORM,
    Twin,
    at_rest,
    cable_vectors,
    drawn_robot,
    log_with_poses,
    turn_of,
    twin_of,
)
from tests.calibration.machines import robots, standing
from tests.refusal import refused
from tests.tiers import extended, wide

DEVIATION = 0.02  # Hz
ROWS = (0, 5, 11, 17)  # poses with measured frequencies
DRAWN = np.diag([0.2, 0.3, 0.4])  # kg m^2
FOUND = sl.CalibrationStatus.FOUND


@pytest.mark.parametrize("name", wide(["pulleys", "slanted", "cogiro", "article-suspended"]))
def test_slopes_are_those_of_the_equilibrium(name: str) -> None:
    machine, pose, lengths = standing(robots()[name])
    robot, sensors = machine.robot, sl.Sensors(frequency_deviation=1.0)
    kinds = ["frame_anchors", "platform_anchors", "axial_stiffness", "linear_density", "mass", "center_of_mass"]
    kinds += ["inertia", "pulley_radius"] if robot.winches is not None else ["inertia"]
    asked = parameters_of(robot, kinds, sensors, counted=False)
    rows, m = reference.pose_rows(pose), robot.cable_count
    size = sl.modes(sl.forward(robot, lengths, pose).state).frequency.shape[1]
    wanted = np.zeros((len(rows), size))
    by_values, by_length = unwhitened_slopes(
        MachineTerms(robot, sl.Catenary(), asked, sensors), rows, lengths, frequencies=wanted
    )

    def frequencies(changed: sl.Robot, lengths: Array) -> Array:
        return sl.modes(sl.forward(changed, lengths, pose).state).frequency

    for k, label in enumerate(asked.labels):
        if label.endswith((".y", "[3].x", "inertia.x")) or "[" not in label:
            step = 2e-6 * np.eye(len(asked.prior))[k] * (asked.prior[k] if asked.logarithmic[k] else 1.0)
            ends = (with_values(robot, asked, asked.prior + sign * step) for sign in (-1.0, 1.0))
            low, high = (frequencies(end, lengths) for end in ends)
            slope = (high - low) / (2.0 * step[k])
            unit = abs(asked.prior[k]) if asked.logarithmic[k] else 1.0
            np.testing.assert_allclose(by_values[:, m + 6 :, k] * unit, slope * unit, rtol=2e-4, atol=2e-4)
    for cable in range(m):
        step = 2e-6 * np.eye(m)[cable]
        slope = (frequencies(robot, lengths + step) - frequencies(robot, lengths - step)) / 4e-6
        np.testing.assert_allclose(by_length[:, m + 6 :, cable], slope, rtol=2e-4, atol=1e-3)


class Swung(NamedTuple):
    """A twin, logarithms of its second moments of the mass relative to the drawing (3,), and its log."""

    twin: Twin
    change: Array
    log: sl.WinchLog


def force_at(vector: Array, start: Array, length: float, stiffness: float) -> Array:
    """Force (3,) of a cable on the platform with the vector from platform end to frame end `vector` [m]; Newton."""
    force = start.copy()
    for _ in range(30):
        here = cable_vectors(force[None], np.array([length]), stiffness)[0][0]
        moved = [cable_vectors((force + way)[None], np.array([length]), stiffness)[0][0] for way in 1e-4 * np.eye(3)]
        change = np.linalg.solve((np.array(moved) - here).T / 1e-4, vector - here)
        force = force + change
        if np.abs(change).max() < 1e-9:
            break
    return force


def frequencies_of(twin: Twin, inertia: Array, place: Array, found: Array) -> Array:
    """Natural frequencies (6,) [Hz]: differences of the wrench at fixed lengths. found, place: as in `at_rest`."""
    turn, lengths, forces = turn_of(found, place), found[2:6], found[6:].reshape(4, 3)
    center = place[:3] + turn @ twin.center

    def wrench(motion: Array) -> Array:
        turned = Rotation.from_rotvec(motion[3:]).as_matrix()
        arms = (PLATFORM - twin.center) @ turn.T @ turned.T
        vectors = twin.frame - (center + motion[:3] + arms)
        each = zip(vectors, forces, lengths, strict=True)
        pulls = np.array([force_at(vector, force, length, twin.stiffness) for vector, force, length in each])
        return np.concatenate((pulls.sum(axis=0), np.cross(arms, pulls).sum(axis=0)))

    step = 1e-5
    stiffness = np.array([(wrench(-step * way) - wrench(step * way)) / (2.0 * step) for way in np.eye(6)])
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = twin.mass * np.eye(3), turn @ inertia @ turn.T
    squares = np.linalg.eigvals(np.linalg.solve(mass, 0.5 * (stiffness + stiffness.T))).real
    return np.sqrt(np.sort(squares)) / (2.0 * np.pi)


def swung(seed: int, modes: int = 6) -> Swung:
    """A twin and its log."""
    twin, random = twin_of(seed), np.random.default_rng((seed, 3))
    change = 0.2 * random.normal(size=3)
    moments = np.array([0.25, 0.15, 0.05]) * np.exp(change)  # those of DRAWN are 0.25, 0.15 and 0.05
    inertia = np.diag(moments.sum() - moments)
    log, angles, places = log_with_poses(twin, seed)
    read = np.full((len(log), modes), np.nan)
    for row in ROWS:
        place = np.append(places[row], angles[row, 0])
        found = at_rest(twin, place)
        assert found is not None
        true = frequencies_of(twin, inertia, place, found)[:modes]
        read[row] = np.sort(true + DEVIATION * random.normal(size=modes))
    return Swung(twin, change, log.replace(frequency=read, sensors=log.sensors.replace(frequency_deviation=DEVIATION)))


def test_the_twin_has_the_frequencies_of_its_robot() -> None:
    twin = twin_of(2)
    _, angles, places = log_with_poses(twin, 2, 1)
    place = np.append(places[0], angles[0, 0])
    found = at_rest(twin, place)
    assert found is not None
    robot = drawn_robot().replace(
        frame_anchors=twin.frame,
        mass=twin.mass,
        center_of_mass=twin.center,
        cables=sl.Cable(0.006, twin.stiffness),
    )
    pose = sl.Pose(place[:3], turn_of(found, place))
    own = sl.modes(sl.forward(robot, found[2:6], pose).state).frequency
    np.testing.assert_allclose(frequencies_of(twin, DRAWN, place, found), own, rtol=1e-6)
    assert robot.gravity == GRAVITY


def test_frequencies_determine_the_axial_stiffness(tmp_path: Path) -> None:
    twin, _, log = swung(2)
    log.save(tmp_path / "log.csv")
    found = sl.calibrate(drawn_robot(), sl.load_log(tmp_path / "log.csv"), folds=0)
    assert found.status is FOUND
    assert found.residuals.shape == (len(log), 20)
    assert np.count_nonzero(~np.isnan(found.residuals[:, 14:])) == 24
    value, error = found.value_of("axial_stiffness")
    assert error == pytest.approx(0.04 * value, rel=0.2)
    assert abs(value - twin.stiffness) < 2.0 * error
    before = found.parameters.prior_deviation[found.parameters.labels.index("axial_stiffness")]
    assert before == pytest.approx(0.2 * found.parameters.prior[found.parameters.labels.index("axial_stiffness")])
    found.save(tmp_path / "found.nc")
    again = sl.load_calibration(tmp_path / "found.nc")
    np.testing.assert_array_equal(again.residuals, found.residuals)
    np.testing.assert_array_equal(again.robot.inertia, found.robot.inertia)
    assert again.sensors.frequency_deviation == DEVIATION


def test_a_wrong_frequency_is_an_outlier() -> None:
    log = swung(2).log
    assert log.frequency is not None
    wrong = log.frequency.copy()
    wrong[5, 3] += 0.4
    found = sl.calibrate(drawn_robot(), log.replace(frequency=wrong), folds=0)
    assert [(one.row, one.quantity) for one in found.outliers] == [(5, "frequency")]


def test_wrong_arguments_are_refused() -> None:
    log = swung(2).log
    assert log.frequency is not None
    with refused("sensors: frequency_deviation", "None"):
        log.replace(sensors=log.sensors.replace(frequency_deviation=None))
    with refused("frequency[0, 1]", next_step="Order the frequencies of each row; leave a missing one blank."):
        log.replace(frequency=log.frequency[:, ::-1])
    with refused("frequency[0, 0]"):
        log.replace(frequency=-log.frequency)
    more = np.hstack((log.frequency, log.frequency[:, -1:] + 5.0))
    with refused("log: frequency", "7 columns"):
        sl.calibrate(drawn_robot(), log.replace(frequency=more), folds=0)
    bare = log.replace(frequency=None, sensors=log.sensors.replace(frequency_deviation=None))
    with refused("unknown: inertia", "observed by no reading"):
        sl.calibrate(drawn_robot(), bare, ["mass", "inertia"])


@extended
def test_true_values_are_within_their_standard_errors() -> None:
    """Axial stiffness, inertia and center of mass of 40 twins; a normal distribution has 68 % and 95 %."""
    off: list[float] = []
    stiffness, statuses = [], []
    for seed in range(40):
        twin, change, log = swung(seed)
        found = sl.calibrate(drawn_robot(), log, folds=0)
        statuses.append(found.status)
        truth = {f"center_of_mass.{axis}": twin.center[k] for k, axis in enumerate("xyz")}
        truth |= {f"inertia.{axis}": change[k] for k, axis in enumerate("xyz")}
        for name, value in truth.items():
            mean, error = found.value_of(name)
            off.append((mean - value) / error)
        mean, error = found.value_of("axial_stiffness")
        stiffness.append((mean - twin.stiffness) / error)
    assert np.mean([status is FOUND for status in statuses]) >= 0.9
    assert np.mean(np.abs(stiffness) < 2.0) >= 0.9
    assert 0.60 < np.mean(np.abs(off) < 1.0) < 0.82
    assert np.mean(np.abs(off) < 2.0) > 0.92

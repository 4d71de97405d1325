"""Swivel angles of pulleys: predictions and derivatives against differences, and logs of a twin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.calibration.diagnostics import diagnose_log
from sagline.calibration.observations import MachineTerms, unwhitened_slopes
from sagline.calibration.parameters import parameters_of, with_values
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.four_cables import PLATFORM, Twin, drawn_robot, log_with_poses, twin_of
from tests.calibration.machines import robots, standing
from tests.refusal import refused
from tests.tiers import extended, wide

DEVIATION = 3e-3  # rad
FOUND = sl.CalibrationStatus.FOUND


def directions(robot: sl.Robot, lengths: Array, start: sl.Pose) -> Array:
    """Swivel angles (N, m) [rad] of a robot in equilibrium, by their definition."""
    state = sl.forward(robot, lengths, start).state
    reach = state.pose.transform(robot.platform_anchors) - robot.frame_anchors
    axis = np.array([0.0, 0.0, 1.0]) if robot.winches is None else robot.winches.swivel_axis
    if robot.winches is None or (np.abs(axis[:, 2]) == 1.0).all():
        sense = np.sign(np.broadcast_to(axis, robot.frame_anchors.shape)[:, 2])
        return np.asarray(sense * np.arctan2(*reach.T[1::-1]).T)
    return np.stack(
        [
            angle_about(n, p)
            for n, p in zip(axis, np.moveaxis(state.exit_point, 1, 0) - robot.frame_anchors[:, None], strict=True)
        ],
        axis=1,
    )


def angle_about(axis: Array, vectors: Array) -> Array:
    """Angles (N,) [rad] of vectors (N, 3) about an axis: 0 toward x, or up for an axis within 45 degrees of x."""
    zero = np.eye(3)[2 if abs(axis[0]) > np.sqrt(0.5) else 0]
    return np.asarray(np.arctan2(vectors @ np.cross(axis, zero), vectors @ np.cross(np.cross(axis, zero), axis)))


@pytest.mark.parametrize("name", wide(["pulleys", "slanted", "cogiro", "article-suspended"], 2))
def test_slopes_are_those_of_the_equilibrium(name: str) -> None:
    machine, pose, lengths = standing(robots()[name])
    robot = machine.robot
    sensors = sl.Sensors(swivel_deviation=1.0)
    kinds = ["frame_anchors", "platform_anchors", "axial_stiffness", "linear_density", "mass", "center_of_mass"]
    kinds += ["length_zero"]
    kinds += ["swivel_zero", "pulley_radius", "dead_cable"] if robot.winches is not None else ["swivel_zero"]
    asked = parameters_of(robot, kinds, sensors, counted=False)
    rows, m = reference.pose_rows(pose), robot.cable_count
    by_values, by_length = unwhitened_slopes(MachineTerms(robot, sl.Catenary(), asked, sensors), rows, lengths)
    for k, label in enumerate(asked.labels):
        if label.endswith((".y", "[3].x")) or "[" not in label:
            step = 1e-5 * np.eye(len(asked.prior))[k] * (asked.prior[k] if asked.logarithmic[k] else 1.0)
            ends = (with_values(robot, asked, asked.prior + sign * step) for sign in (-1.0, 1.0))
            low, high = (directions(end, lengths, pose) for end in ends)
            wanted, size = (high - low) / (2.0 * step[k]), abs(asked.prior[k]) if asked.logarithmic[k] else 1.0
            np.testing.assert_allclose(by_values[:, m + 6 :, k], wanted, rtol=2e-5, atol=2e-7 / size)
    zero = asked.labels.index("swivel_zero[1]")
    np.testing.assert_allclose(by_values[:, m + 6 :, zero], np.tile(np.eye(m)[1], (len(rows), 1)), atol=1e-15)
    for cable in range(m):
        offset = by_values[:, m + 6 :, asked.labels.index(f"length_zero[{cable}]")]
        np.testing.assert_allclose(offset, by_length[:, m + 6 :, cable], rtol=1e-6, atol=1e-9)
        step = 1e-5 * np.eye(m)[cable]
        wanted = (directions(robot, lengths + step, pose) - directions(robot, lengths - step, pose)) / 2e-5
        np.testing.assert_allclose(by_length[:, m + 6 :, cable], wanted, rtol=2e-5, atol=2e-6)


def turned(seed: int, *, cells: bool = True) -> tuple[Twin, sl.WinchLog, Array]:
    """A twin, its log with swivel angles, and the zeros of the angles (4,) [rad]."""
    twin, random = twin_of(seed), np.random.default_rng((seed, 2))
    log, angles, places = log_with_poses(twin, seed)
    reach = sl.Pose(places, Rotation.from_euler("ZYX", angles)).transform(PLATFORM) - twin.frame
    zeros = random.uniform(-np.pi, np.pi, 4)
    angles = np.arctan2(reach[..., 1], reach[..., 0]) + zeros + DEVIATION * random.normal(size=reach.shape[:2])
    sensors = log.sensors.replace(swivel_deviation=DEVIATION)
    if not cells:
        log, sensors = log.replace(load_cells=None), sensors.replace(tension_deviation=None)
    return twin, log.replace(swivel=np.remainder(angles, 2.0 * np.pi), sensors=sensors), zeros


@pytest.mark.parametrize("cells", [True, False])
def test_a_log_with_swivel_angles_is_found(cells: bool, tmp_path: Path) -> None:
    _, log, zeros = turned(2, cells=cells)
    log.save(tmp_path / "log.csv")
    found = sl.calibrate(drawn_robot(), sl.load_log(tmp_path / "log.csv"), folds=0)
    assert found.status is FOUND
    assert found.residuals.shape == (len(log), 18)
    off = np.angle(np.exp(1j * (found.swivel_zero - zeros)))
    errors = np.array([found.value_of(f"swivel_zero[{k}]")[1] for k in range(4)])
    assert (np.abs(off) < 2.5 * errors).all()
    assert {one.quantity: one.stated for one in found.sensor_deviations()}["swivel angle"] == DEVIATION
    assert any("vertical" in way.name for way in found.gauge)
    found.save(tmp_path / "found.nc")
    again = sl.load_calibration(tmp_path / "found.nc")
    np.testing.assert_array_equal(again.residuals, found.residuals)
    np.testing.assert_array_equal(again.swivel_zero, found.swivel_zero)
    assert again.sensors.swivel_deviation == DEVIATION


def test_exchanged_load_cells_of_a_log_with_swivel_angles_are_recognized() -> None:
    _, log, _ = turned(2)
    assert log.load_cells is not None
    exchanged = log.replace(load_cells=log.load_cells[:, [2, 1, 0, 3]])
    assert diagnose_log(drawn_robot(), log) == ()
    (sentence,) = diagnose_log(drawn_robot(), exchanged)
    assert "cables 0 and 2" in sentence


def test_swivel_angles_reduce_the_error_of_the_height_of_the_center_of_mass() -> None:
    _, log, _ = turned(2)
    error = sl.calibrate(drawn_robot(), log, folds=0).value_of("center_of_mass.z")[1]
    without = log.replace(swivel=None, sensors=log.sensors.replace(swivel_deviation=None))
    assert error < 0.9 * sl.calibrate(drawn_robot(), without, folds=0).value_of("center_of_mass.z")[1]


def test_a_wrong_swivel_angle_is_an_outlier() -> None:
    _, log, _ = turned(4)
    assert log.swivel is not None
    wrong = log.swivel.copy()
    wrong[7, 2] += 0.1
    found = sl.calibrate(drawn_robot(), log.replace(swivel=wrong), folds=0)
    assert [(one.row, one.cable, one.quantity) for one in found.outliers] == [(7, 2, "swivel angle")]
    assert found.outliers[0].size == pytest.approx(0.1, abs=5.0 * DEVIATION)


def test_zeros_that_were_not_estimated_are_criticized() -> None:
    _, log, zeros = turned(4)
    assert log.swivel is not None
    known = log.replace(swivel=log.swivel - zeros + 0.02 * np.array([0.0, 1.0, 0.0, 0.0]))
    found = sl.calibrate(drawn_robot(), known, ["frame_anchors", "length_zero", "mass"], folds=0)
    assert "swivel_zero" in [one.kind for one in found.criticisms]


def test_missing_angles_and_arguments() -> None:
    _, log, _ = turned(2)
    assert log.swivel is not None
    part = log.swivel.copy()
    part[::3, 1] = np.nan
    found = sl.calibrate(drawn_robot(), log.replace(swivel=part), folds=0)
    assert found.status is FOUND
    np.testing.assert_array_equal(np.isnan(found.residuals[:, 14:]), np.isnan(part))
    with refused("sensors: swivel_deviation", "None"):
        log.replace(sensors=log.sensors.replace(swivel_deviation=None))
    with refused("swivel", "of shape (27, 3)"):
        log.replace(swivel=part[:, :3])
    bare = log.replace(swivel=None, sensors=log.sensors.replace(swivel_deviation=None))
    with refused("unknown: swivel_zero", "observed by no reading"):
        sl.calibrate(drawn_robot(), bare, ["mass", "swivel_zero"])


@extended
def test_true_values_are_within_their_standard_errors() -> None:
    """Anchors, zeros and center of mass of 60 twins; a normal distribution has 68 % and 95 %."""
    off: list[float] = []
    statuses = []
    for seed in range(60):
        twin, log, zeros = turned(seed, cells=seed % 2 == 0)
        found = sl.calibrate(drawn_robot(), log, folds=0)
        statuses.append(found.status)
        at = dict(zip(found.parameters.labels, range(len(found.values)), strict=True))
        truth = {f"frame_anchors[{i}].{axis}": twin.frame[i, k] for i in range(4) for k, axis in enumerate("xyz")}
        truth |= {f"center_of_mass.{axis}": twin.center[k] for k, axis in enumerate("xyz")}
        off += [(found.values[at[name]] - value) / found.standard_error[at[name]] for name, value in truth.items()]
        errors = found.standard_error[[at[f"swivel_zero[{k}]"] for k in range(4)]]
        off += list(np.angle(np.exp(1j * (found.swivel_zero - zeros))) / errors)
    assert np.mean([status is FOUND for status in statuses]) >= 0.94
    assert 0.62 < np.mean(np.abs(off) < 1.0) < 0.80
    assert 0.93 < np.mean(np.abs(off) < 2.0) < 0.99

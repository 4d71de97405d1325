"""Roll and pitch without yaw: residuals and slopes by definition, and logs of a twin with an inclinometer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.calibration.observations import (
    MachineTerms,
    Readings,
    predicted_rows,
    whitened_rows,
)
from sagline.kernels.calibration import kinds
from tests.calibration import reference
from tests.calibration.four_cables import drawn_robot, log_with_inclinations, twin_of
from tests.calibration.machines import robots, standing
from tests.refusal import refused
from tests.tiers import wide

FOUND = sl.CalibrationStatus.FOUND
TILT = 1e-3  # rad
UP = np.array([0.0, 0.0, 1.0])
COLUMNS = [
    ("frame_anchors", kinds.FRAME + 2),
    ("center_of_mass", kinds.CENTER),
    ("mass", kinds.MASS),
    ("measuring_frame", kinds.TURN),
]


def test_slopes_are_rotations_about_the_horizontal_axes_of_the_world() -> None:
    machine, pose, lengths = standing(robots()["cogiro"])
    level = machine.sensors.replace(rotation_deviation=[2e-3, 3e-3, np.inf])
    for kind, row in COLUMNS:
        asked = reference.parameters(machine, (kind,))
        seen = predicted_rows(
            MachineTerms(machine.robot, sl.Catenary(), asked, level), reference.pose_rows(pose), lengths
        )
        found = seen.matrix[:, -3:, asked.where[row, 0]] * [2e-3, 3e-3, 1.0]
        turned = reference.slopes(machine, pose, lengths, row, 0)[:, -3:] @ machine.sensors.frame.matrix.T
        wanted = 0.0 * turned if kind == "measuring_frame" else turned * [1.0, 1.0, 0.0]
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-6 * max(np.abs(wanted).max(), 1e-3))


def test_residuals_turn_the_predicted_into_the_measured_vertical() -> None:
    machine, pose, lengths = standing(robots()["cogiro"])
    level = machine.sensors.replace(rotation_deviation=[2e-3, 3e-3, np.inf])
    read = Rotation.from_euler("ZYX", [[2.5, 0.2, -0.1], [-3.0, -0.15, 0.25]])
    asked = reference.parameters(machine, ("mass",))
    terms = MachineTerms(machine.robot, sl.Catenary(), asked, level, np.zeros(8))
    none = np.full((2, 3), np.nan)
    readings = Readings(lengths, np.full(lengths.shape, np.nan), none, read.as_quat())
    rows = whitened_rows(terms, readings, terms.winch_slopes(lengths), reference.pose_rows(pose), lengths)
    vectors = rows.residual[:, -3:]
    assert np.isnan(vectors[:, 2]).all()
    turns = Rotation.from_rotvec(np.column_stack((vectors[:, :2], np.zeros(2))))
    measured = read.apply(UP, inverse=True)  # vertical in the frame of the platform
    predicted = Rotation.from_quat(pose.quaternion.copy()).apply(measured)
    np.testing.assert_allclose(turns.apply(predicted), np.tile(UP, (2, 1)), atol=1e-12)


def inclined(seed: int, yaw: float = 0.0) -> tuple[sl.WinchLog, float]:
    """Log of a twin with an inclinometer, whose quaternions have the given yaw, and the true height of its center."""
    twin = twin_of(seed)
    log, angles = log_with_inclinations(twin, seed)
    angles = angles + TILT * np.random.default_rng(seed).normal(size=angles.shape)
    angles[:, 0] = yaw
    sensors = sl.Sensors(log.sensors.length_deviation, log.sensors.tension_deviation, None, [TILT, TILT, np.inf])
    turned = Rotation.from_euler("ZYX", angles).as_quat()
    return log.replace(rotation=turned, sensors=sensors), twin.center[2]


def test_a_log_with_an_inclinometer_is_found(tmp_path: Path) -> None:
    log, height = inclined(5)
    found = sl.calibrate(drawn_robot(), log, folds=0)
    assert found.status is sl.CalibrationStatus.FOUND
    assert np.isnan(found.residuals[:, -1]).all()
    value, error = found.value_of("center_of_mass.z")
    assert abs(value - height) < 2.5 * error
    without = sl.calibrate(drawn_robot(), log_with_inclinations(twin_of(5), 5)[0], folds=0)
    assert error < 0.5 * without.value_of("center_of_mass.z")[1]
    assert {one.quantity: one.stated for one in found.sensor_deviations()}["rotation"] == TILT
    found.save(tmp_path / "found.nc")
    again = sl.load_calibration(tmp_path / "found.nc").sensors.rotation_deviation
    np.testing.assert_array_equal(again, [TILT, TILT, np.inf])


def test_lengths_and_inclinations_are_sufficient() -> None:
    log, height = inclined(1)
    alone = log.replace(load_cells=None, sensors=log.sensors.replace(tension_deviation=None))
    found = sl.calibrate(drawn_robot(), alone, folds=0)
    value, error = found.value_of("center_of_mass.z")
    assert found.status is sl.CalibrationStatus.FOUND
    assert len(found.rows) == len(log)
    assert error < 2e-3
    assert abs(value - height) < 2.5 * error


def test_the_yaw_of_the_quaternions_has_no_effect() -> None:
    one, other = (sl.calibrate(drawn_robot(), inclined(5, yaw)[0], folds=0) for yaw in (0.0, 2.0))
    np.testing.assert_allclose(one.values, other.values, rtol=1e-9, atol=1e-12)


def test_only_the_yaw_may_be_unmeasured() -> None:
    for wrong in (np.inf, [np.inf, TILT, TILT], [TILT, np.inf, np.inf]):
        with refused("rotation_deviation", "infinite", kind=sl.InvalidValueError):
            sl.Sensors(rotation_deviation=wrong)
    log = inclined(5)[0]
    with refused("unknown: measuring_frame", "observed by no reading", kind=sl.InvalidValueError):
        sl.calibrate(drawn_robot(), log, ["mass", "measuring_frame"])


def test_a_roll_with_the_wrong_sign_is_named() -> None:
    log = inclined(5)[0]
    assert log.rotation is not None
    angles = Rotation.from_quat(log.rotation.copy()).as_euler("ZYX") * [1.0, 1.0, -1.0]
    with refused("log", kind=sl.InvalidValueError) as caught:
        sl.calibrate(drawn_robot(), log.replace(rotation=Rotation.from_euler("ZYX", angles).as_quat()), folds=0)
    assert "inclinations" in caught.value.value
    assert "gamma" in caught.value.next_step


MISTAKES = {  # yaw, pitch and roll: which column is read for each, and its sign
    "change the sign of gamma": ([0, 1, 2], [1.0, 1.0, -1.0]),
    "change the sign of beta": ([0, 1, 2], [1.0, -1.0, 1.0]),
    "change the signs of beta and gamma": ([0, 1, 2], [1.0, -1.0, -1.0]),
    "exchange beta and gamma": ([0, 2, 1], [1.0, 1.0, 1.0]),
    "exchange beta and gamma, and change the sign of gamma": ([0, 2, 1], [1.0, -1.0, 1.0]),
    "exchange beta and gamma, and change the sign of beta": ([0, 2, 1], [1.0, 1.0, -1.0]),
    "exchange beta and gamma, and change both signs": ([0, 2, 1], [1.0, -1.0, -1.0]),
}


def alone(seed: int, columns: list[int], signs: list[float]) -> sl.WinchLog:
    """Log of lengths and inclinations without load cells, with changed columns of yaw, pitch and roll."""
    log = inclined(seed)[0]
    assert log.rotation is not None
    angles = Rotation.from_quat(log.rotation.copy()).as_euler("ZYX")[:, columns] * signs
    sensors = log.sensors.replace(tension_deviation=None)
    return log.replace(load_cells=None, rotation=Rotation.from_euler("ZYX", angles).as_quat(), sensors=sensors)


@pytest.mark.parametrize("seed", wide(range(4, 25)))
def test_inclinations_without_load_cells_are_accepted(seed: int) -> None:
    assert sl.calibrate(drawn_robot(), alone(seed, [0, 1, 2], [1.0, 1.0, 1.0]), folds=0).status is FOUND


@pytest.mark.parametrize(("seed", "correction"), wide([(k, name) for k in range(4, 25) for name in MISTAKES], 2))
def test_wrong_inclinations_without_load_cells_are_named_with_their_correction(seed: int, correction: str) -> None:
    with refused("log", kind=sl.InvalidValueError) as caught:
        sl.calibrate(drawn_robot(), alone(seed, *MISTAKES[correction]), folds=0)
    assert "inclinations" in caught.value.value
    step = caught.value.next_step
    assert step[:1].lower() + step[1:].partition(" (misfit")[0] == correction

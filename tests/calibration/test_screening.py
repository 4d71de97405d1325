"""Excluded rows of a log with the reasons; no valid row is excluded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.screening import _lengths_of, reading_count, screen
from sagline.core.arrays import Array
from tests.calibration.synthetic import Synthetic, log_of, true_robot, usual_sensors, with_drums
from tests.refusal import refused

ROBOT = with_drums()
SENSORS = usual_sensors(position_deviation=1e-3, rotation_deviation=1e-3)


@pytest.fixture(scope="module")
def faultless_log() -> Synthetic:
    return log_of(true_robot(ROBOT, seed=1, sensors=SENSORS), 40, seed=1, positions=7, rotations=3)


def changed(values: Array | None, index: Any, value: float) -> Array:
    assert values is not None
    copied = values.copy()
    copied[index] = value
    return copied


def left_out(log: sl.WinchLog, **options: Any) -> dict[str, list[int]]:
    fit, fit_rows, others = screen(ROBOT, log, **options)
    assert len(fit) == len(fit_rows)
    np.testing.assert_array_equal(fit.readings, log.readings[fit_rows])
    omitted = np.concatenate([fit_rows, *others.values()])
    np.testing.assert_array_equal(np.sort(omitted), np.arange(len(log)))  # each row has one reason
    return {reason.name: rows.tolist() for reason, rows in others.items()}


def test_every_row_of_a_faultless_log_is_kept(faultless_log: Synthetic) -> None:
    assert left_out(faultless_log.log) == {}
    assert screen(ROBOT, faultless_log.log)[0] is faultless_log.log


def test_lengths_are_those_of_the_counts(faultless_log: Synthetic) -> None:
    counts = faultless_log.log.counts
    assert counts is not None
    np.testing.assert_array_equal(_lengths_of(ROBOT, faultless_log.log), sl.lengths_from_counts(ROBOT, counts))
    lengths = faultless_log.log.replace(counts=None, unstrained_length=faultless_log.length)
    assert _lengths_of(ROBOT, lengths) is lengths.unstrained_length


def test_informative_readings_are_counted(faultless_log: Synthetic) -> None:
    assert reading_count(faultless_log.log) == 40 * 8 + 7 * 3 + 3 * 3
    log = faultless_log.log.replace(
        load_cells=changed(faultless_log.log.load_cells, (slice(4), 2), np.nan), rotation=None
    )
    assert reading_count(log) == 40 * 8 - 4 + 7 * 3
    assert reading_count(faultless_log.log.replace(load_cells=None, position=None, rotation=None)) == 0


def test_rows_without_a_common_reading_are_excluded(faultless_log: Synthetic) -> None:
    log = faultless_log.log
    assert left_out(log.replace(counts=changed(log.counts, (5, 2), np.nan))) == {"NOT_A_NUMBER": [5]}
    cells = changed(log.load_cells, (9, 1), np.nan)
    assert left_out(log.replace(load_cells=cells)) == {"NOT_A_NUMBER": [9]}
    assert (
        left_out(log.replace(load_cells=changed(log.load_cells, (slice(None), 3), np.nan))) == {}
    )  # a cable without load cell
    rare = changed(log.load_cells, (slice(0, 30), 3), np.nan)
    assert left_out(log.replace(load_cells=rare)) == {}
    often = changed(log.load_cells, (slice(0, 19), 3), np.nan)
    assert left_out(log.replace(load_cells=often)) == {"NOT_A_NUMBER": list(range(19))}


def test_repeated_rows_are_excluded(faultless_log: Synthetic) -> None:
    log = faultless_log.log.rows(np.array([0, 1, 2, 1, 3, 0, 1]))
    assert left_out(log) == {"REPEATED": [3, 5, 6]}
    cells = log.load_cells
    assert cells is not None
    almost = log.replace(load_cells=changed(cells, (5, 7), float(np.nextafter(cells[5, 7], 1e9))))
    assert left_out(almost) == {"REPEATED": [3, 6]}


def test_moving_rows_are_excluded() -> None:
    """Three rows of a stop, four rows of motion and a stop at 10 Hz; then a row half a minute later."""
    drive = np.array([0.0, 0.0, 0.0, 0.002, 0.03, 0.06, 0.09, 0.09, 0.0901, 5.0])
    time = np.array([*np.arange(9) / 10.0, 30.0])
    length = 8.0 + drive[:, None] * np.array([1.0, -0.5, 0, 0, 0, 0, 0, 0]) + 1e-9 * np.arange(10)[:, None]
    log = sl.WinchLog(unstrained_length=length, time=time)
    assert left_out(log) == {"MOVING": [2, 3, 4, 5, 6]}
    mixed = np.array([9, 3, 4, 0, 1, 2, 8, 7, 6, 5])
    assert left_out(log.rows(mixed)) == {"MOVING": [1, 2, 5, 8, 9]}
    assert left_out(log, speed_limit=0.31) == {}
    assert left_out(log, speed_limit=0.0009)["MOVING"] == [2, 3, 4, 5, 6, 7, 8]
    assert left_out(log.replace(time=None)) == {}
    assert left_out(log.replace(time=np.zeros(10))) == {}


@pytest.mark.parametrize("rate", [10.0, 100.0, 2000.0])
def test_encoder_rounding_is_not_motion(rate: float) -> None:
    """Rounding of one count is 9 mm/s between rows at a kilohertz; a creep of 6 mm/s is not detected."""
    time = np.arange(0.0, 2.0, 1.0 / rate)
    counts = np.random.default_rng(0).integers(-1, 2, (len(time), 8)).astype(np.float64)
    still = sl.WinchLog(counts=counts, time=time)
    assert "MOVING" not in left_out(still)
    creeping = still.replace(counts=counts + 1.1e5 * 0.007 * time[:, None])
    assert left_out(creeping) == {"MOVING": list(range(len(time)))}


def test_slack_rows_are_excluded(faultless_log: Synthetic) -> None:
    log = faultless_log.log
    assert left_out(log.replace(load_cells=changed(log.load_cells, (4, 6), 15.0))) == {"SLACK": [4]}
    assert left_out(log.replace(load_cells=changed(log.load_cells, (4, 6), 15.01))) == {}
    biased = with_drums(load_cell_bias=20.0)
    _, _, others = screen(biased, log.replace(load_cells=changed(log.load_cells, (4, 6), 35.0)))
    assert others[sl.Omission.SLACK].tolist() == [4]


def test_a_row_is_counted_for_its_first_reason(faultless_log: Synthetic) -> None:
    log = faultless_log.log.rows(np.array([0, 1, 1, 1, 2]))
    cells = changed(log.load_cells, (slice(1, 4), 0), -3.0)
    log = log.replace(load_cells=cells, counts=changed(log.counts, (3, 0), np.nan))
    assert left_out(log) == {"NOT_A_NUMBER": [3], "REPEATED": [2], "SLACK": [1]}


def test_an_empty_log_keeps_no_rows(faultless_log: Synthetic) -> None:
    assert left_out(faultless_log.log.rows(slice(0, 0))) == {}


@pytest.mark.parametrize("rows", [slice(None), slice(3, 4)])
def test_counts_beyond_the_drum_are_reported_with_row_and_cable(faultless_log: Synthetic, rows: slice) -> None:
    robot = with_drums(cable_length=22.0)
    log = faultless_log.log.rows(rows)
    row = len(log) - 1
    off = log.replace(counts=changed(log.counts, (row, 5), 4e6))
    with refused(f"row {row}, cable 5: count", "4000000", "-inf to 1261589", kind=sl.InvalidValueError):
        screen(robot, off)


def test_a_log_of_other_sizes_is_refused(faultless_log: Synthetic) -> None:
    with refused("log", "of 8 cables", "7 cables, as many as falcon-7 has", kind=sl.InvalidValueError):
        screen(sl.load_robot("falcon-7"), faultless_log.log)
    with refused("the robot", kind=sl.InvalidValueError) as caught:
        screen(sl.load_robot("cogiro"), faultless_log.log)
    assert "winches" in caught.value.value
    with refused("speed_limit", "0 m/s", kind=sl.InvalidValueError):
        screen(ROBOT, faultless_log.log, 0.0)

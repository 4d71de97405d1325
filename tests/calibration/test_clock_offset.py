"""Lengths that are late, compared with measured positions: a twin at rest and in slow motion."""

from __future__ import annotations

from functools import cache

import numpy as np

import sagline as sl
from sagline.calibration.screening import moving_rows
from sagline.core.arrays import Array
from tests.calibration.four_cables import at_rest, drawn_robot, log_of_twin, twin_of
from tests.calibration.reference import counts_of
from tests.calibration.synthetic import true_robot, usual_sensors, with_drums
from tests.refusal import refused
from tests.tiers import extended

LATE = 0.06  # s
POINT = 1e-3  # m
STEP = 0.1  # s between rows in motion
ROWS = 60


def place_at(time: float) -> Array:
    """Position [m] and yaw [rad] during the motion; about 0.3 m/s."""
    x, y, z = np.sin([1.3 * time, 0.9 * time, 1.1 * time])
    return np.array([0.2 * x, 0.15 * y, 0.8 + 0.15 * z, 0.01 * x])


@cache
def log_in_motion(seed: int) -> sl.WinchLog:
    """Log with rests, then with a motion: lengths of an earlier time, and positions of the time of the row."""
    rng, twin = np.random.default_rng((seed, 7)), twin_of(seed)
    rests = log_of_twin(twin, seed, 15)
    assert rests.unstrained_length is not None
    assert rests.load_cells is not None
    assert rests.commanded is not None
    times = STEP * np.arange(ROWS)
    lengths: list[Array] = []
    for time in times:
        found = at_rest(twin, place_at(time - LATE))
        assert found is not None
        lengths.append(found[2:6] - twin.zeros)
    size = float(rests.sensors.length_deviation)
    moving = np.array(lengths) + size * rng.normal(size=(ROWS, 4))
    places = np.array([place_at(time)[:3] for time in times])
    commanded = np.vstack((rests.commanded.position, places + 0.02 * rng.normal(size=places.shape)))
    return sl.WinchLog(
        unstrained_length=np.vstack((rests.unstrained_length, moving)),
        load_cells=np.vstack((rests.load_cells, np.full((ROWS, 4), 30.0) + rng.normal(size=(ROWS, 4)))),
        position=np.vstack((np.full((len(rests), 3), np.nan), places + POINT * rng.normal(size=places.shape))),
        time=np.concatenate((30.0 * np.arange(len(rests)), 30.0 * len(rests) + times)),
        commanded=sl.Pose(commanded, np.eye(3)),
        sensors=rests.sensors.replace(position_deviation=POINT),
    )


UNKNOWNS = ("default", "clock_offset")


def test_the_clock_offset_of_a_moving_robot_is_found() -> None:
    log = log_in_motion(1)
    found = sl.calibrate(drawn_robot(), log, UNKNOWNS, folds=0)
    late, error = found.value_of("clock_offset")
    assert found.status is sl.CalibrationStatus.FOUND
    assert error < 0.01
    assert abs(late - LATE) < 2.5 * error
    assert np.isnan(found.residuals[found.rows >= 15, 4:8]).all()


@extended
def test_counts_of_a_robot_with_eight_cables() -> None:
    robot = with_drums()
    truth = true_robot(robot, {"length_zero": 0.002, "mass": 0.03}, 1, usual_sensors(position_deviation=POINT))
    times = STEP * np.arange(40)
    sines = [np.sin(np.multiply.outer(t, [0.5, 0.3, 0.7])) for t in (times, times - LATE)]
    now, before = (sl.Pose([0.0, 0.0, 2.0] + [1.5, 1.0, 0.3] * sine, np.eye(3)) for sine in sines)
    plan = sl.inverse(truth.robot, before)
    assert plan.feasible.all()
    rng = np.random.default_rng(5)
    lengths = plan.unstrained_length + 5e-4 * rng.normal(size=plan.unstrained_length.shape)
    log = sl.WinchLog(
        counts=counts_of(truth.robot, lengths),
        position=now.position + POINT * rng.normal(size=(40, 3)),
        time=times,
        commanded=now,
        sensors=sl.Sensors(position_deviation=POINT),
    )
    found = sl.calibrate(robot, log, ["length_zero", "clock_offset"], folds=0)
    late, error = found.value_of("clock_offset")
    assert error < 0.005
    assert abs(late - LATE) < 3.0 * error


def test_speed_and_acceleration_are_those_of_the_parabola_through_three_rows() -> None:
    time = np.array([0.0, 30.0, 30.04, 30.1, 30.25, 30.3, 90.0])
    length = np.array([2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 3.0])
    length[1:6] = 3.0 + 0.4 * (time[1:6] - 30.1) - 0.7 * (time[1:6] - 30.1) ** 2
    order = np.array([3, 0, 6, 1, 5, 2, 4])
    log = sl.WinchLog(
        unstrained_length=np.repeat(length[order, None], 4, axis=1),
        position=np.zeros((7, 3)),
        time=time[order],
        sensors=sl.Sensors(position_deviation=POINT),
    )
    moving, motion = moving_rows(drawn_robot(), log)
    assert sorted(order[moving]) == [3]  # 0.1 s to 1 s from rows on both sides
    np.testing.assert_allclose(motion[:, moving][:, 0], np.repeat([[0.4], [-1.4]], 4, axis=1), rtol=1e-9)
    assert not motion[:, ~moving].any()


def test_a_log_at_rest_has_no_clock_offset() -> None:
    log = log_in_motion(1)
    for wrong in (log.rows(slice(0, 15)), log.replace(position=None)):
        with refused("log", allowed="at least one for clock_offset", kind=sl.InvalidValueError):
            sl.calibrate(drawn_robot(), wrong, UNKNOWNS, folds=0)
    with refused("log: time", "not given", kind=sl.InvalidValueError):
        sl.calibrate(drawn_robot(), log.replace(time=None), UNKNOWNS, folds=0)
    found = sl.calibrate(drawn_robot(), log, folds=0)
    assert len(found.left_out[sl.Omission.MOVING]) == ROWS
    assert "clock_offset" not in str(found)

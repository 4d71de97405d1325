"""Rests in a log with motion: all stops are found, swings and slow motions are not, and the means are right."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array

STOPS = 12
RATE = 50.0  # Hz
MOVE, STAY = 3.0, 4.0  # s
SWING, DECAY, FADED = 40.0, 0.4, 2.0  # N, s, s
SENSORS = sl.Sensors(5e-4, 3.0, 1e-3, 2e-3)


def motion() -> tuple[Array, Array, Array]:
    """Times, number of passed stops (with fraction), and swing of the load cells [N]."""
    time = np.arange(0.0, STOPS * (MOVE + STAY), 1.0 / RATE)
    stop, within = np.divmod(time, MOVE + STAY)
    x = np.clip(within / MOVE, 0.0, 1.0)
    way = stop + x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    swing = np.where(within > MOVE, SWING * np.exp(-(within - MOVE) / DECAY) * np.cos(12.0 * within), 0.0)
    return time, way, swing


@pytest.mark.parametrize("counted", [False, True])
def test_every_stop_gives_one_row_with_the_mean_readings(counted: bool) -> None:
    rng = np.random.default_rng(4)
    time, way, swing = motion()
    knots = np.arange(STOPS + 1.0)
    places = rng.uniform(-1.0, 1.0, (STOPS + 1, 3))
    angles, lengths, cells = (
        0.2 * places,
        3.0 + 0.3 * rng.normal(size=(STOPS + 1, 4)),
        rng.uniform(50.0, 200.0, (STOPS + 1, 4)),
    )

    def read(values: Array, deviation: float) -> Array:
        whole = np.stack([np.interp(way, knots, column) for column in values.T], axis=-1)
        return whole + rng.normal(0.0, deviation, whole.shape)

    length_noise = 5e-6 if counted else 5e-4
    length = read(lengths, length_noise)
    position = read(places, 1e-3)
    position[::7] = np.nan  # the measuring system is slower
    log = sl.WinchLog(
        counts=np.round(1e5 * length) if counted else None,
        unstrained_length=None if counted else length,
        load_cells=read(cells, 3.0) + swing[:, None],
        position=position,
        rotation=Rotation.from_rotvec(read(angles, 2e-3)).as_quat(),
        time=time,
        sensors=SENSORS,
    )
    found = log.at_rest(1.0)
    assert len(found) == STOPS
    assert found.time is not None
    assert found.load_cells is not None
    assert found.position is not None
    assert found.rotation is not None
    assert (found.time % (MOVE + STAY) > MOVE + 0.5 * FADED).all()
    scale = 1e5 if counted else 1.0
    for mean, true, deviation in (
        (found.readings / scale, lengths, max(length_noise, 2e-5)),
        (found.load_cells, cells, 3.0),
        (found.position, places, 1e-3),
        (Rotation.from_quat(found.rotation).as_rotvec(), angles, 2e-3),
    ):
        assert np.abs(mean - true[1:]).max() < 0.6 * deviation  # five deviations of a mean of about 80 rows


@pytest.mark.parametrize("speed", [2e-3, 1e-2, 0.3])
def test_a_slow_motion_is_no_rest(speed: float) -> None:
    time = np.arange(0.0, 20.0, 0.02)
    noise = np.random.default_rng(0).normal(0.0, 5e-4, (len(time), 3))
    log = sl.WinchLog(unstrained_length=2.0 + speed * time[:, None] + noise, time=time)
    with pytest.raises(sl.InvalidValueError, match="without a rest"):
        log.at_rest(1.0)


def test_times_are_necessary() -> None:
    log = sl.WinchLog(unstrained_length=np.ones((4, 2)))
    for time in (None, [0.0, 1.0, 1.0, 2.0]):
        with pytest.raises(sl.InvalidValueError, match="time"):
            log.replace(time=time).at_rest()

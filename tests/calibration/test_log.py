"""A log of readings: what it takes, what it refuses, and parts of it."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.arrays import Array

N, M = 4, 3
SENSORS = sl.Sensors(tension_deviation=5.0, position_deviation=1e-3, rotation_deviation=1e-3)


def fields(**changes: Any) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    quaternion = np.full((N, 4), np.nan)
    quaternion[1] = [0.6, 0.0, 0.0, 0.8]
    whole = {
        "unstrained_length": rng.uniform(3.0, 5.0, (N, M)),
        "load_cells": rng.uniform(-5.0, 50.0, (N, M)),
        "position": [[1.0, np.nan, 2.0], [np.nan] * 3, [1.0, 2.0, 3.0], [0.0, 0.0, 0.0]],
        "rotation": quaternion,
        "time": [0.0, 1.0, 1.0, 7.5],
        "commanded": sl.Pose(rng.uniform(size=(N, 3)), np.eye(3)),
        "sensors": SENSORS,
        "source": "a test",
    }
    return {**whole, **changes}


def test_it_keeps_what_it_is_given() -> None:
    given = fields()
    log = sl.WinchLog(**given)
    assert len(log) == N
    assert log.counts is None
    for name in ("unstrained_length", "load_cells", "position", "rotation", "time"):
        np.testing.assert_array_equal(getattr(log, name), given[name])
        assert not getattr(log, name).flags.writeable
    assert log.commanded is given["commanded"]
    assert str(log) == (
        "4 rows of 3 cables: lengths, 12 readings of load cells, 8 measured coordinates, 1 measured rotation, times, "
        "commanded poses; a test"
    )
    assert str(sl.WinchLog([[1.0]])) == "1 row of 1 cable: counts"


def test_rotations_become_units_and_stay_missing() -> None:
    given: Array = np.array([[np.nan] * 4, [0.6000001, 0.0, 0.0, 0.8], [0.0, 1.0, 0.0, 0.0], [np.nan] * 4])
    found = sl.WinchLog(**fields(rotation=given)).rotation
    assert found is not None
    np.testing.assert_array_equal(np.isnan(found), np.isnan(given))
    np.testing.assert_allclose(np.linalg.norm(found[1:3], axis=1), 1.0, rtol=1e-15)


@pytest.mark.parametrize(
    ("which", "kept"),
    [
        (np.array([True, False, True, False]), [0, 2]),
        (slice(1, None), [1, 2, 3]),
        (np.array([3, 0]), [3, 0]),
        (2, [2]),
        (slice(0, 0), []),
    ],
)
def test_rows_takes_the_same_of_every_field(which: Any, kept: list[int]) -> None:
    log = sl.WinchLog(**fields(time=np.zeros(N)))
    part = log.rows(which)
    assert len(part) == len(kept)
    for name in ("unstrained_length", "load_cells", "position", "rotation", "time"):
        np.testing.assert_array_equal(getattr(part, name), getattr(log, name)[kept])
    assert part.commanded is not None
    assert log.commanded is not None
    np.testing.assert_array_equal(part.commanded.position, log.commanded.position[kept])
    assert part.sensors is log.sensors
    assert part.source == log.source


def test_it_is_pickled_and_copied_whole() -> None:
    log = sl.WinchLog(**fields())
    for again in (pickle.loads(pickle.dumps(log)), copy.deepcopy(log)):
        assert str(again) == str(log)
        np.testing.assert_array_equal(again.rotation, log.rotation)


QUARTER = np.array([0.0, 0.0, np.nan, 1.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"unstrained_length": None}, "counts or unstrained_length is neither given"),
        ({"counts": np.ones((N, M))}, "counts or unstrained_length is both given"),
        ({"unstrained_length": np.ones(M)}, r"unstrained_length is of shape \(3,\); allowed: shape \(N, m\)"),
        ({"unstrained_length": np.ones((N, 0))}, r"unstrained_length is of shape \(4, 0\)"),
        ({"unstrained_length": -np.ones((N, M))}, r"unstrained_length\[0, 0\] is -1 m; allowed: >= 0 m"),
        ({"unstrained_length": np.full((N, M), np.inf)}, r"unstrained_length\[0, 0\] is inf m"),
        ({"load_cells": np.ones((N, M + 1))}, r"load_cells is of shape \(4, 4\); allowed: shape \(4, 3\)"),
        ({"load_cells": np.full((N, M), -np.inf)}, r"load_cells\[0, 0\] is -inf N"),
        ({"position": np.ones((N, 2))}, r"position is of shape \(4, 2\); allowed: shape \(4, 3\)"),
        ({"rotation": np.ones((N + 1, 4))}, r"rotation is of shape \(5, 4\); allowed: shape \(4, 4\)"),
        ({"rotation": np.tile(QUARTER, (N, 1))}, r"rotation\[0\] is NaN in part"),
        ({"rotation": np.ones((N, 4))}, r"rotation\[0\]: length is 2; allowed: 1 to 1e-6"),
        ({"time": np.arange(N + 1)}, r"time is of shape \(5,\); allowed: shape \(4,\)"),
        ({"time": [0.0, np.nan, 1.5, 3.0]}, r"time\[1\] is nan s"),
        ({"commanded": sl.Pose([0, 0, 0], np.eye(3))}, "commanded is a single pose; allowed: a batch of 4"),
        ({"commanded": sl.Pose(np.zeros((2, 3)), np.eye(3))}, "commanded is a batch of 2; allowed: a batch of 4"),
        ({"sensors": sl.Sensors()}, "sensors: tension_deviation is None"),
        ({"sensors": SENSORS.replace(position_deviation=None)}, "sensors: position_deviation is None"),
        ({"sensors": SENSORS.replace(rotation_deviation=None)}, "sensors: rotation_deviation is None"),
        ({"sensors": SENSORS.replace(length_deviation=np.ones(8))}, r"length_deviation is of shape \(8,\); allowed"),
        ({"sensors": SENSORS.replace(tension_deviation=np.ones(2))}, r"tension_deviation is of shape \(2,\); allowed"),
        ({"source": "a\x00b"}, "source is"),
    ],
)
def test_it_refuses_what_does_not_fit(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(sl.InvalidValueError, match=message):
        sl.WinchLog(**fields(**changes))


def test_what_is_replaced_is_checked() -> None:
    log = sl.WinchLog(**fields())
    assert str(log.replace(load_cells=None, source="")) == (
        "4 rows of 3 cables: lengths, 8 measured coordinates, 1 measured rotation, times, commanded poses"
    )
    with pytest.raises(sl.InvalidValueError, match="field is 'loads'"):
        log.replace(loads=None)
    with pytest.raises(sl.InvalidValueError, match="position is of shape"):
        log.replace(position=np.ones((N, 2)))

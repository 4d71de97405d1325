"""A log of readings: valid and invalid data, and parts of it."""

from __future__ import annotations

import copy
import pickle
import re
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.refusal import refused

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


def counted(text: str) -> dict[str, int]:
    """Numbers in a text by the words that follow them."""
    return {words: int(number) for number, words in re.findall(r"(\d+) ((?:measured )?\w+)", text)}


def test_a_log_contains_the_given_data() -> None:
    given = fields()
    log = sl.WinchLog(**given)
    assert len(log) == N
    assert log.counts is None
    for name in ("unstrained_length", "load_cells", "position", "rotation", "time"):
        np.testing.assert_array_equal(getattr(log, name), given[name])
        assert not getattr(log, name).flags.writeable
    assert log.commanded is given["commanded"]
    counts = {"rows": 4, "cables": 3, "readings": 12, "measured coordinates": 8, "measured rotation": 1}
    assert counted(str(log)) == counts
    assert all(words in str(log) for words in ("lengths", "load cells", "times", "commanded poses"))
    assert str(log).endswith("; a test")
    assert counted(str(sl.WinchLog([[1.0]]))) == {"row": 1, "cable": 1}
    assert str(sl.WinchLog([[1.0]])).endswith(": counts")


def test_quaternions_are_normalized_and_missing_ones_stay_nan() -> None:
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
def test_rows_selects_the_same_rows_of_every_field(which: Any, kept: list[int]) -> None:
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


def test_a_log_is_pickled_and_copied_completely() -> None:
    log = sl.WinchLog(**fields())
    for again in (pickle.loads(pickle.dumps(log)), copy.deepcopy(log)):
        assert str(again) == str(log)
        np.testing.assert_array_equal(again.rotation, log.rotation)


QUARTER = np.array([0.0, 0.0, np.nan, 1.0])


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"unstrained_length": None}, ("counts or unstrained_length", "neither given")),
        ({"counts": np.ones((N, M))}, ("counts or unstrained_length", "both given")),
        ({"unstrained_length": np.ones(M)}, ("unstrained_length", "of shape (3,)", "shape (N, m)")),
        ({"unstrained_length": np.ones((N, 0))}, ("unstrained_length", "of shape (4, 0)")),
        ({"unstrained_length": np.full((N, M), np.inf)}, ("unstrained_length[0, 0]", "inf m")),
        ({"load_cells": np.ones((N, M + 1))}, ("load_cells", "of shape (4, 4)", "shape (4, 3)")),
        ({"load_cells": np.full((N, M), -np.inf)}, ("load_cells[0, 0]", "-inf N")),
        ({"position": np.ones((N, 2))}, ("position", "of shape (4, 2)", "shape (4, 3)")),
        ({"rotation": np.ones((N + 1, 4))}, ("rotation", "of shape (5, 4)", "shape (4, 4)")),
        ({"rotation": np.tile(QUARTER, (N, 1))}, ("rotation[0]", "NaN in part")),
        ({"rotation": np.ones((N, 4))}, ("rotation[0]: length", "2", "1 to 1e-6")),
        ({"time": np.arange(N + 1)}, ("time", "of shape (5,)", "shape (4,)")),
        ({"time": [0.0, np.nan, 1.5, 3.0]}, ("time[1]", "nan s")),
        ({"commanded": sl.Pose([0, 0, 0], np.eye(3))}, ("commanded", "a single pose", "a batch of 4")),
        ({"commanded": sl.Pose(np.zeros((2, 3)), np.eye(3))}, ("commanded", "a batch of 2", "a batch of 4")),
        ({"sensors": sl.Sensors()}, ("sensors: tension_deviation", "None")),
        ({"sensors": SENSORS.replace(position_deviation=None)}, ("sensors: position_deviation", "None")),
        ({"sensors": SENSORS.replace(rotation_deviation=None)}, ("sensors: rotation_deviation", "None")),
        ({"sensors": SENSORS.replace(length_deviation=np.ones(8))}, ("sensors: length_deviation", "of shape (8,)")),
        ({"sensors": SENSORS.replace(tension_deviation=np.ones(2))}, ("sensors: tension_deviation", "of shape (2,)")),
        ({"source": "a\x00b"}, ("source", r"'a\x00b'")),
    ],
)
def test_inconsistent_data_are_refused(changes: dict[str, Any], parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=sl.InvalidValueError):
        sl.WinchLog(**fields(**changes))


def test_replaced_fields_are_checked() -> None:
    log = sl.WinchLog(**fields())
    less = log.replace(load_cells=None, source="")
    assert (less.load_cells, less.source) == (None, "")
    assert counted(str(less)) == {"rows": 4, "cables": 3, "measured coordinates": 8, "measured rotation": 1}
    with refused("field", "'loads'", kind=sl.InvalidValueError):
        log.replace(loads=None)
    with refused("position", "of shape (4, 2)", kind=sl.InvalidValueError):
        log.replace(position=np.ones((N, 2)))

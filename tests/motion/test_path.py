import pickle

import numpy as np
import pytest

from sagline import InvalidValueError, Path, Pose


def still(samples: int) -> Pose:
    zero = np.zeros(samples)
    return Pose.from_euler(np.zeros((samples, 3)), zero, zero, zero)


def test_length_and_duration() -> None:
    path = Path([2.0, 2.5, 4.0], still(3), np.zeros((3, 6)), np.zeros((3, 6)))
    assert len(path) == 3
    assert path.duration == 2.0


def test_fields_are_read_only_copies() -> None:
    time, twist = np.array([0.0, 1.0]), np.ones((2, 6))
    path = Path(time, still(2), twist, np.zeros((2, 6)))
    time[0], twist[0, 0] = -5.0, 7.0
    assert path.time[0] == 0.0
    assert path.twist[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        path.twist_rate[0, 0] = 1.0


def test_pickling_keeps_every_field() -> None:
    twist = np.arange(12.0).reshape(2, 6)
    path = pickle.loads(pickle.dumps(Path([0.0, 1.0], still(2), twist, -twist)))
    assert path.duration == 1.0
    np.testing.assert_array_equal(path.twist, twist)
    np.testing.assert_array_equal(path.twist_rate, -twist)
    assert not path.twist.flags.writeable


def test_the_jerk_of_a_path_is_optional() -> None:
    twist = np.arange(12.0).reshape(2, 6)
    without = Path([0.0, 1.0], still(2), twist, -twist)
    assert without.jerk is None
    assert pickle.loads(pickle.dumps(without)).jerk is None
    path = pickle.loads(pickle.dumps(Path([0.0, 1.0], still(2), twist, -twist, jerk=2.0 * twist)))
    np.testing.assert_array_equal(path.jerk, 2.0 * twist)
    assert not path.jerk.flags.writeable
    for jerk, item in ((np.zeros((3, 6)), "jerk"), (np.full((2, 6), np.nan), "jerk[0, 0]")):
        with pytest.raises(InvalidValueError) as caught:
            Path([0.0, 1.0], still(2), twist, twist, jerk)
        assert caught.value.item == item


@pytest.mark.parametrize(
    ("time", "item"),
    [
        ([0.0, 1.0, 1.0], "time[2]"),
        ([0.0, -1.0, 1.0], "time[1]"),
        ([0.0, np.nan, 1.0], "time[1]"),
        ([[0.0], [1.0], [2.0]], "time"),
        (0.0, "time"),
        ([], "time"),
    ],
)
def test_invalid_times(time: object, item: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        Path(time, still(3), np.zeros((3, 6)), np.zeros((3, 6)))  # type: ignore[arg-type]
    assert caught.value.item == item


@pytest.mark.parametrize(
    ("pose", "twist", "twist_rate", "item"),
    [
        (still(2), np.zeros((3, 6)), np.zeros((3, 6)), "pose"),
        (Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0), np.zeros((3, 6)), np.zeros((3, 6)), "pose"),
        (still(3), np.zeros((2, 6)), np.zeros((3, 6)), "twist"),
        (still(3), np.zeros((3, 6)), np.zeros((3, 5)), "twist_rate"),
        (still(3), np.full((3, 6), np.nan), np.zeros((3, 6)), "twist[0, 0]"),
        (still(3), np.zeros((3, 6)), np.full((3, 6), np.inf), "twist_rate[0, 0]"),
    ],
)
def test_inconsistent_fields(pose: Pose, twist: np.ndarray, twist_rate: np.ndarray, item: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        Path([0.0, 1.0, 2.0], pose, twist, twist_rate)
    assert caught.value.item == item

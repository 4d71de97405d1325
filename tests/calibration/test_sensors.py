"""What a sensor may be: deviations of one shape each."""

from typing import Any

import numpy as np
import pytest

import sagline as sl


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"position_deviation": np.ones(4)}, r"position_deviation is of shape \(4,\); allowed: shape \(\) or \(3,\)"),
        ({"rotation_deviation": np.ones((1, 3))}, r"rotation_deviation is of shape \(1, 3\)"),
        (
            {"length_deviation": np.ones((2, 8))},
            r"length_deviation is of shape \(2, 8\); allowed: shape \(\) or \(m,\)",
        ),
        ({"length_deviation": None}, "length_deviation is None"),
        ({"tension_deviation": 0.0}, "tension_deviation is 0 N; allowed: > 0 N"),
        ({"frame": sl.Pose(np.zeros((2, 3)), np.eye(3))}, "frame is a batch of 2"),
    ],
)
def test_what_is_no_sensor_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(sl.InvalidValueError, match=message):
        sl.Sensors(**fields)


def test_changed_sensors_are_checked_too() -> None:
    sensors = sl.Sensors(tension_deviation=[1.0, 2.0])
    assert sensors.replace(tension_deviation=None).tension_deviation is None
    with pytest.raises(sl.InvalidValueError, match="field is 'tension'"):
        sensors.replace(tension=1.0)

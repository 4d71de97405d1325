"""Sensors have deviations of one shape."""

from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        ({"position_deviation": np.ones(4)}, ("position_deviation", "of shape (4,)", "shape () or (3,)")),
        ({"rotation_deviation": np.ones((1, 3))}, ("rotation_deviation", "of shape (1, 3)")),
        ({"length_deviation": np.ones((2, 8))}, ("length_deviation", "of shape (2, 8)", "shape () or (m,)")),
        ({"length_deviation": None}, ("length_deviation", "None")),
        ({"tension_deviation": 0.0}, ("tension_deviation", "0 N", "> 0 N, finite")),
        ({"frame": sl.Pose(np.zeros((2, 3)), np.eye(3))}, ("frame", "a batch of 2")),
    ],
)
def test_impossible_deviations_are_refused(fields: dict[str, Any], parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=sl.InvalidValueError):
        sl.Sensors(**fields)


def test_changed_sensors_are_checked_too() -> None:
    sensors = sl.Sensors(tension_deviation=[1.0, 2.0])
    assert sensors.replace(tension_deviation=None).tension_deviation is None
    with refused("field", "'tension'", kind=sl.InvalidValueError):
        sensors.replace(tension=1.0)

"""The prototype with all data of its drives and sensors."""

from __future__ import annotations

from typing import Any

import sagline as sl

DRIVE = {
    "drum_radius": 0.03,
    "gear": 20.0,
    "inertia": 2.77e-5 * 1.15,
    "torque_limit": 3.82 * 0.9,
    "speed_limit": 314.159,
    "friction": 15.0,
    "position_gain": 20.0,
    "speed_gain": 4000.0,
    "integral_gain": 80e3,
}
SENSORS = {
    "groove_pitch": 0.004,
    "counts_per_turn": 131072.0,
    "length_zero": 5.0,
    "load_cell_range": 2000.0,
    "load_cell_deviation": 1.0,
    "load_cell_bias": 2.0,
    "load_cell_gain": 1.01,
}


def prototype(**changes: Any) -> sl.Robot:
    """The preset with winches of the twin; changes are fields of `Winch`."""
    robot = sl.load_robot("article-prototype")
    rope = robot.cables.replace(diameter=0.003)
    return robot.replace(winches=sl.Winch(**{**DRIVE, **SENSORS, **changes}), cables=rope)

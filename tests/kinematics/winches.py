"""Robots with winches, for tests."""

from typing import Any

import numpy as np

import sagline as sl

FULL: dict[str, Any] = {
    "drum_radius": 0.048,
    "drum_width": 0.08,
    "groove_pitch": 0.004,
    "layers": 4,
    "drum_distance": 0.8,
    "drum_offset": -0.04,
    "gear": np.array([12.0, -12.0] * 4),
    "counts_per_turn": 4096.0,
    "count_zero": 1e5,
    "length_zero": 10.0,
    "cable_length": 28.0,
    "winding_tension": 160.0,
}


def wound(name: str = "cogiro", **changes: Any) -> sl.Robot:
    """A robot with four layers of 4 mm rope on its drums."""
    robot = sl.load_robot(name)
    rope = robot.cables.replace(diameter=0.004, expansion=1.2e-5)
    fields = {field: value for field, value in {**FULL, **changes}.items() if value is not None}
    return robot.replace(cables=rope, winches=sl.Winch(**fields))

"""Equilibria of robots for vibrations."""

from __future__ import annotations

from functools import cache

import numpy as np

import sagline as sl


@cache
def middle(name: str) -> sl.Equilibrium:
    """A robot of the catalogue in the middle of its test box."""
    robot = sl.load_robot(name)
    assert robot.test_box is not None
    return at(name, tuple(0.5 * (robot.test_box.low + robot.test_box.high)))


@cache
def at(name: str, position: tuple[float, float, float]) -> sl.Equilibrium:
    """A robot of the catalogue at a position, with tensions of minimum norm."""
    return sl.inverse(sl.load_robot(name), sl.Pose(position, np.eye(3)), tension=sl.MinimumNorm()).state

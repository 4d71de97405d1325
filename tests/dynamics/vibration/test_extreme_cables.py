"""Cables with very low to very high tension, of rope and steel: count, component modes and status agree."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.dynamics.vibration.component_modes import CableComponents
from sagline.dynamics.vibration.robot_modes import VibrationModel
from sagline.statics.strings import Strings, strings_below, taut_of
from tests.kernels.dynamics.strings import string
from tests.tiers import wide


@pytest.mark.parametrize("count", [150, pytest.param(5000, marks=pytest.mark.soak)])
def test_the_count_agrees_with_component_modes(count: int) -> None:
    """Two independent computations: collocation with pivots, spectral elements with eigenvalues."""
    random = np.random.default_rng(4)
    compared = 0
    for _ in range(count):
        length, weight = 10.0 ** random.uniform(-0.3, 1.5), 10.0 ** random.uniform(-2, 2)
        whole = weight * length
        horizontal, vertical = whole * 10.0 ** random.uniform(-5, 3), whole * random.uniform(-1.5, 2.5)
        table = string(horizontal, vertical, length, weight / 9.81, whole * 10.0 ** random.uniform(0.5, 7))
        strings = Strings(table[None], np.eye(3)[None, None], taut_of(table[None]))
        if not strings.taut.all():
            continue
        ringing = np.sqrt(max(horizontal, 0.1 * whole) / table[0, 5]) / (2.0 * length)
        up_to = ringing * random.uniform(1.0, 12.0)
        frequency = np.sqrt(np.maximum(CableComponents(strings, 0, 1.3 * up_to).square, 0.0)) / (2.0 * np.pi)
        if np.abs(frequency / up_to - 1.0).min() > 1e-5:
            found = int(strings_below(strings, np.array([[up_to]])).sum())
            assert found == (frequency < up_to).sum(), (table, up_to)
            compared += 1
    assert compared > 0.8 * count


@pytest.mark.parametrize("count", [3, pytest.param(100, marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", wide(["cogiro", "falcon-7", "ipanema-2-pulleys"], first=2))
def test_robots_with_slightly_wrong_lengths_have_results(name: str, count: int) -> None:
    """Some cables are almost without tension: all modes are found, or the slack cable is named, without an error."""
    random = np.random.default_rng(9)
    robot = sl.load_robot(name)
    assert robot.test_box is not None
    for _ in range(count):
        pose = sl.Pose(random.uniform(robot.test_box.low, robot.test_box.high), np.eye(3))
        plan = sl.inverse(robot, pose)
        lengths = plan.unstrained_length * (1.0 + random.normal(0.0, 0.003, robot.cable_count))
        state = sl.forward(robot, lengths, start=pose).state
        lowest = sl.modes(state).frequency[0]
        if not np.isfinite(lowest):
            continue
        found = sl.vibration(state, up_to=4.0 * float(lowest))
        slack = np.flatnonzero(~VibrationModel(state).strings.taut[0])
        assert found.complete or list(found.slack_cables) == slack.tolist() != []
        assert found.count == found.frequency.size

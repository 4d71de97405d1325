"""Artificial vibrations and simulations with known numbers, for comparison with figures."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import sagline as sl
from sagline import Damping, EnergyBalance, Occurrence, Simulation, Vibration, VibrationStatus
from sagline.core.arrays import Array

ROBOT = sl.load_robot("article-suspended")


@cache
def plan() -> sl.Plan:
    """The plan of the article's path, 301 poses."""
    return sl.inverse(ROBOT, sl.article_path(rate=5.0))


def state_at(x: float = 0.0, y: float = 0.0) -> sl.Equilibrium:
    return sl.inverse(ROBOT, sl.Pose([x, y, 1.5], np.eye(3)), tension=sl.MinimumNorm()).state


def vibration(
    state: sl.Equilibrium,
    frequency: Array,
    share: Array,
    damping: Damping | None = None,
    up_to: float = 20.0,
    status: VibrationStatus = VibrationStatus.SOLVED,
    **changed: Any,
) -> Vibration:
    """Modes with given frequencies and shares; the platform moves as in the massless modes."""
    found = sl.modes(state)
    damping = damping or Damping(modal_damping=0.01)
    m, count = state.one_robot.cable_count, len(frequency)
    which = np.arange(count) % found.frequency.size
    values: dict[str, Any] = {
        "state": state,
        "up_to": up_to,
        "damping": damping,
        "status": status,
        "frequency": np.asarray(frequency, dtype=np.float64),
        "shape": found.shape[:, which] * np.sqrt(share),
        "platform_share": np.asarray(share, dtype=np.float64),
        "cable_share": np.tile((1.0 - np.asarray(share)) / m, (m, 1)),
        "cable_shape": np.zeros((count, m, 21, 3)),
        "loss": np.full(count, damping.modal_damping),
        "massless_frequency": found.frequency,
        "count": count,
        "negative_directions": np.zeros((6, 0)),
        "slack_cables": (),
    }
    return Vibration(**values | changed)


def simulation(count: int = 200) -> Simulation:
    """A platform that swings vertically with artificial damping, and a cable that breaks after 1 s."""
    state = state_at()
    time = np.linspace(0.0, 2.0, count)
    swing = np.sin(2.0 * np.pi * time)
    position = state.pose.position + np.outer(0.1 * swing, (0.0, 0.0, 1.0))
    pose = sl.Pose(position, np.eye(3))
    kinetic, lost = 5.0 * np.cos(2.0 * np.pi * time) ** 2, 2.0 * time
    supplied, potential = 1.5 * time, 700.0 + 5.0 * swing**2
    removed = np.where(time > 1.0, -3.0, 0.0)
    error = kinetic + potential - supplied + lost + removed - 705.0
    twist = np.zeros((count, 6))
    tensions = state.cables.frame_end_tension * (1.0 + 0.3 * swing[:, None])
    tensions[time > 1.0, 3] = 0.0
    length = np.tile(state.unstrained_length, (count, 1))
    events = (Occurrence(1.0, "break", 3, 104.5, 240.25),)
    balance = EnergyBalance(kinetic, potential, supplied, lost, removed, error)
    return Simulation(ROBOT, time, pose, twist, tensions, length, balance, events, "none", 0.001)

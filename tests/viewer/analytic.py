"""A known workspace: a ball around the origin, cut by a wall, with one cable for each half."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.workspaces.levels import Details

RADIUS, WALL, PER_METER = 1.5, 1.0, 100.0  # m, m, N/m


def ball(positions: Array) -> Details:
    """So many newtons for each meter to the ball's surface; beyond the wall the robot is singular."""
    margin = PER_METER * (RADIUS - np.linalg.norm(positions, axis=1))
    margin = np.where(positions[:, 0] > WALL, -np.inf, margin)
    return Details(
        np.clip(margin, -100.0, 100.0), margin, np.zeros(len(positions), dtype=np.int64),
        np.where(positions[:, 2] > 0.0, 3, 5), np.zeros(len(positions), dtype=np.int64), np.zeros(len(positions)),
    )  # fmt: skip

"""A workspace that is known: a ball about the origin, cut off by a wall, with a cable for each half."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices

RADIUS, WALL, PER_METER = 1.5, 1.0, 100.0  # m, m, N/m


class Told(NamedTuple):
    level: Array
    margin: Array
    criterion: Indices
    cable: Indices


def ball(positions: Array) -> Told:
    """So many newtons for each meter to the ball's surface; beyond the wall the robot is singular."""
    margin = PER_METER * (RADIUS - np.linalg.norm(positions, axis=1))
    margin = np.where(positions[:, 0] > WALL, -np.inf, margin)
    return Told(
        np.clip(margin, -100.0, 100.0), margin, np.zeros(len(positions), dtype=np.int64),
        np.where(positions[:, 2] > 0.0, 3, 5),
    )  # fmt: skip

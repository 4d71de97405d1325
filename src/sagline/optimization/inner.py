"""Anchors that move: at each pose where the margin is largest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.optimization.candidates import Candidates
from sagline.optimization.sample import latin_hypercube

Margins: TypeAlias = Callable[[Array, Array], Array]  # of tables (R, m, CABLE_COLUMNS) and pose rows (R, POSE_COLUMNS)

SPREAD: Final = 4  # points a number that are tried first
STEP: Final = 0.25  # of the bounds' distance, at first
ROUNDS: Final = 14  # each halves the step


def best_moved(inner: Candidates, margins: Margins, cables: Array, poses: Array) -> tuple[Array, Array]:
    """Move the anchors of each robot at its pose to where the margin is largest.

    A sample, the same for all, then steps along one number after another, halved from round to round: from the best of
    the sample it climbs to a maximum of its own surroundings.

    Args:
        inner: What may move.
        margins: Gives margins [N], shape (R,).
        cables: Tables of cables, one a pose, (R, m, CABLE_COLUMNS); they stay as they are.
        poses: Pose rows (R, POSE_COLUMNS).

    Returns:
        The numbers that are best, shape (R, q), and their margins, shape (R,).
    """
    count, q = len(poses), len(inner.parts)

    def at(points: Array) -> Array:
        moved = cables.copy()
        inner.write(moved, inner.values(points))
        return margins(moved, poses)

    best = np.repeat(inner.units(inner.start[None]), count, axis=0)
    found = at(best)

    def keep(points: Array) -> None:
        nonlocal best, found
        there = at(points)
        better = there > found
        best = np.where(better[:, None], points, best)
        found = np.where(better, there, found)

    for point in latin_hypercube(SPREAD * q, q, 0):
        keep(np.repeat(point[None], count, axis=0))
    step = STEP
    for _ in range(ROUNDS):
        for k in range(q):
            for way in (-step, step):
                points = best.copy()
                points[:, k] = np.clip(points[:, k] + way, 0.0, 1.0)
                keep(points)
        step *= 0.5
    return inner.values(best), found

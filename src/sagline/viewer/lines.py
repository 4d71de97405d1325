"""Cables as lines in the world: where they hang, where their chords are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array, locked
from sagline.cables.model import CableState
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

POINTS = 41  # along a cable: an odd number, so that dashes end as they begin


def chords(robot: Robot, pose: Pose) -> Array:
    """Frame end and platform end of every cable in the world [m], shape (m, 2, 3)."""
    platform_ends = pose.transform(robot.platform_anchors)
    return locked(np.stack((robot.frame_anchors, platform_ends), axis=1))


def straight(ends: Array) -> Array:
    """Points along chords (m, 2, 3), shape (m, POINTS, 3)."""
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    return np.asarray(ends[:, :1] * (1.0 - share) + ends[:, 1:] * share)


def hanging(ends: Array, cables: CableState, sag_scale: float) -> Array:
    """Points along the cables as they hang (m, POINTS, 3), their sag below the chord drawn some times as large."""
    run = ends[:, 1] - ends[:, 0]
    span = np.hypot(run[:, 0], run[:, 1])
    level = np.divide(run[:, :2], span[:, None], out=np.zeros((len(run), 2)), where=span[:, None] > 0.0)
    along, up = np.moveaxis(cables.points(POINTS), -1, 0)
    slope = np.divide(run[:, 2], span, out=np.zeros(len(run)), where=span > 0.0)[:, None]
    drop = np.where(span[:, None] > 0.0, up - slope * along, 0.0)  # a vertical cable stays on its chord
    height = up + (sag_scale - 1.0) * drop
    return np.asarray(ends[:, :1] + np.concatenate((level[:, None] * along[..., None], height[..., None]), axis=-1))


def segments(points: Array, *, dashed: bool, shown: NDArray[np.bool_] | None = None) -> Array:
    """Consecutive points (m, P, 3) as segments (m (P - 1), 2, 3).

    Args:
        points: Points along lines.
        dashed: Whether every other segment has no length.
        shown: Which points are shown, shape (m, P); a segment without both ends has no length.
    """
    pairs = np.stack((points[:, :-1], points[:, 1:]), axis=2)
    if dashed:
        pairs[:, 1::2, 1] = pairs[:, 1::2, 0]
    if shown is not None:
        hidden = ~(shown[:, :-1] & shown[:, 1:])
        pairs[hidden, 1] = pairs[hidden, 0]
    return np.asarray(pairs.reshape(-1, 2, 3))

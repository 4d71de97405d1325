"""The part of the region's wall that the platform is near: it lights up, and says how much more it would bear."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.viewer.cable_colors import cable_color
from sagline.viewer.hull import Hull
from sagline.viewer.patches import Patch
from sagline.viewer.wording import ForceUnit

BESIDE: Final = 0.01  # of the reach: so far from the wall its light is drawn, or the wall would hide it here and there
REACH: Final = 0.16  # of the robot's size: from here on a wall is lit
_RINGS: Final = (0.0, 0.4, 0.7, 1.0)  # of the reach
_LIGHT: Final = (0.6, 0.35, 0.15)  # opacity in each ring, of which two lie behind each other


def lit(hull: Hull, position: Array, reach: float) -> list[Patch]:
    """What of a wall is lit: the nearer, the more.

    Args:
        hull: The wall.
        position: Where the platform is [m], shape (3,).
        reach: From how far on [m].

    Returns:
        Patches in the colors of the cables that limit there; none where the wall is farther away. The faces of the
        robot's box are no wall.
    """
    near = np.linalg.norm(hull.vertices - position, axis=1) < reach + hull.longest
    own = np.flatnonzero(near[hull.faces].any(axis=1) & ~hull.on_box)
    corners, owner = _quartered(hull.vertices[hull.faces[own]]), np.repeat(hull.owner[own], 4)
    away = np.linalg.norm(corners.mean(axis=1) - position, axis=1) / reach
    patches = []
    for (least, most), opacity in zip(pairwise(_RINGS), _LIGHT, strict=True):
        ring = (away >= least) & (away < most)
        for cable in np.unique(owner[ring]).tolist():
            chosen = _on_both_sides(corners[ring & (owner == cable)], BESIDE * reach)
            faces = np.arange(3 * len(chosen)).reshape(-1, 3)
            patches.append(Patch(chosen.reshape(-1, 3), faces, cable_color(cable), opacity))
    return patches


def left(margin: float, cable: int, unit: ForceUnit) -> str:
    """How much is left at the platform, and which cable limits it, in words.

    Args:
        margin: Of the loads [N].
        cable: That limits it, -1 for none.
        unit: Of forces.
    """
    by = f", cable {cable}" if cable >= 0 else ""
    if not np.isfinite(margin):
        return "nothing limits it" if margin > 0.0 else "nothing holds it"
    return f"{unit.written(margin)} left{by}" if margin >= 0.0 else f"{unit.written(-margin)} too much{by}"


def _on_both_sides(corners: Array, distance: float) -> Array:
    """Triangles (F, 3, 3) twice, so far [m] before and behind where they are."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    away = distance * (normal / np.maximum(length, np.finfo(np.float64).tiny))[:, None]
    return np.concatenate((corners + away, corners - away))


def _quartered(corners: Array) -> Array:
    """Each triangle (F, 3, 3) in four, one after the other."""
    first, second, third = (corners[:, k] for k in range(3))
    one, two, three = 0.5 * (first + second), 0.5 * (second + third), 0.5 * (third + first)
    parts = ((first, one, three), (one, second, two), (three, two, third), (one, two, three))
    return np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3, 3)

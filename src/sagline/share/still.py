"""A robot as a small drawing: what a page shows without JavaScript."""

from __future__ import annotations

from html import escape
from typing import Final

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import Array
from sagline.robot.bounds import bounds
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import lines, solids
from sagline.viewer.tension_scale import TensionScale

WIDE: Final = 640.0  # px
EDGE: Final = 12.0  # px around it
_RIGHT: Final = np.array([0.9, 0.436, 0.0])
_UP: Final = np.array([-0.154, 0.318, 0.936])
_EDGES: Final = [(a, b) for a in range(8) for b in range(a) if (a ^ b) in (1, 2, 4)]


def still(robot: Robot, pose: Pose, tension: Array) -> str:
    """The cables of a robot as they hang at chord tensions, between frame and platform, as SVG.

    Args:
        robot: The robot.
        pose: One pose.
        tension: Chord tensions [N], shape (m,); NaN draws a straight line.
    """
    ends = lines.chords(robot, pose)
    run = ends[:, 1] - ends[:, 0]
    known = np.isfinite(tension) & (np.linalg.norm(run, axis=1) > 0.0)
    courses = lines.straight(ends)
    if known.all():
        cables = Catenary().from_tension(robot.cables, np.hypot(*run[:, :2].T), run[:, 2], tension, robot.gravity)
        courses = lines.hanging(ends, cables, 1.0)
    low, high = bounds(robot)
    frame = np.array(np.meshgrid(*zip(low, high, strict=True), indexing="ij")).reshape(3, -1).T
    body = solids.platform(robot)
    box = np.array(np.meshgrid(*zip(body.vertices.min(axis=0), body.vertices.max(axis=0), strict=True), indexing="ij"))
    platform = pose.transform(box.reshape(3, -1).T)
    groups = [_seen(each) for each in (frame, platform, *courses)]
    every = np.concatenate(groups)
    least, size = every.min(axis=0), np.ptp(every, axis=0)
    scale = (WIDE - 2.0 * EDGE) / size[0]
    frame, platform, *drawn_courses = (EDGE + scale * (each - least) for each in groups)
    colors = TensionScale.of(robot).colors(tension)
    drawn = [_line(frame[[a, b]], "#7f878f", 1.5) for a, b in _EDGES]
    drawn += [_line(each, f"rgb({r} {g} {b})", 2.0) for each, (r, g, b) in zip(drawn_courses, colors, strict=True)]
    drawn += [_line(platform[[a, b]], "#3a86c9", 2.5) for a, b in _EDGES]
    tall = scale * size[1] + 2.0 * EDGE
    label = escape(f"{robot.name}: its platform on cables")
    head = f'<svg viewBox="0 0 {WIDE:g} {tall:.0f}" width="{WIDE:g}" role="img" aria-label="{label}">'
    return f"{head}{''.join(drawn)}</svg>"


def _seen(points: Array) -> Array:
    """Right and down, shape (..., 2)."""
    return np.stack((points @ _RIGHT, -(points @ _UP)), axis=-1)


def _line(points: Array, color: str, width: float) -> str:
    way = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{way}" fill="none" stroke="{color}" stroke-width="{width:g}"/>'

"""A robot in space, its cables hanging as they hang."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib import patheffects
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from sagline.core.arguments import instance, optional
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.plot.scene import EDGES, frame_box, ground, hung, platform_box, pose_of, taut, wheels
from sagline.plot.sheet import VERMILLION, sheet
from sagline.plot.style import current
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.tension_scale import TensionScale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sagline.core.arrays import Array
    from sagline.kinematics.plan import Plan

FRAME_COLOR, FLOOR_COLOR, SHADOW_COLOR, WHEEL_COLOR = "0.6", "0.955", "0.82", "0.35"
NEAR = 0.04  # of the robot's size: anchors that are closer share a label
HALO = [patheffects.withStroke(linewidth=2.0, foreground="white")]
AWAY = 0.045  # of the robot's size: how far outside its anchor a label stands


def robot(robot: Robot, pose: Pose | None = None, ax: Axes3D | None = None) -> Axes3D:
    """The robot in space at rest: frame, platform, and its cables as exact catenaries that carry it.

    Cables have the color of their chord tension, on the scale of the robot's limits as in `sagline view`, and their
    numbers at the frame. Pulleys stand as the platform has turned them, cables lie on them; of dead cable behind them
    its rise is drawn, dotted where its length does not say that it is upright. The platform stands over its shadow on
    the ground, which is at z = 0 or lower.

    Args:
        robot: The robot.
        pose: Where the platform is; None for the middle of the robot's test box. Where no tensions carry the platform
            the cables are straight, dashed and without color.
        ax: Axes to draw on, made with `projection="3d"`; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If no pose is given and the robot has no test box, or the pose is a batch.
    """
    where = pose_of(instance(robot, Robot, "robot"), optional(pose, Pose, "pose"))
    optional(ax, Axes3D, "ax")
    if ax is None:
        ax = sheet(height=4.0, width=5.6).add_subplot(projection="3d")
    plan, points = draw_robot(ax, robot, where)
    dress_space(
        ax, points, robot.name if plan.feasible else f"{robot.name}: no tensions within the limits carry it here"
    )
    if plan.feasible:
        tension_bar(ax, TensionScale.of(robot), plan.chord_tension, "left")
    return ax


def draw_robot(ax: Axes3D, robot: Robot, where: Pose, color: str | None = None) -> tuple[Plan, Array]:
    """Frame, platform, cables and ground, without labels of the axes.

    Args:
        ax: Axes to draw on.
        robot: The robot.
        where: Where the platform is.
        color: Of all cables; None for that of their tensions.

    Returns:
        What carries the platform, and points that stand for what is drawn [m], shape (n, 3).
    """
    ax.computed_zorder = False  # by the middles of things, which puts the ground over what stands on it
    plan = inverse(robot, where)
    courses = hung(robot, where, plan) if plan.feasible else taut(robot, where)
    colors = TensionScale.of(robot).colors(plan.chord_tension) / 255.0  # gray where there is no tension
    for line, own in zip(courses, colors, strict=True):
        style = "-" if plan.feasible else (0, (3.0, 2.0))
        ax.plot(*line.T, color=own if color is None else color, linewidth=1.4, linestyle=style, zorder=2.0)
    machinery = _draw_wheels(ax, robot, where)
    frame = frame_box(robot)
    if frame is not None:
        _draw_box(ax, frame, FRAME_COLOR, 0.7)
    ax.scatter(*robot.frame_anchors.T, color="black", s=8.0, depthshade=False, zorder=4.0)
    platform = platform_box(robot, where)
    _draw_box(ax, platform, VERMILLION, 1.3)
    points = np.concatenate((courses.reshape(-1, 3), machinery, platform, *([] if frame is None else [frame])))
    _draw_ground(ax, points, platform)
    _number(ax, robot.frame_anchors, points)
    return plan, points


def _draw_wheels(ax: Axes3D, robot: Robot, pose: Pose) -> Array:
    """The pulleys, the runs behind them and the drums that are known; returns their points (n, 3)."""
    circles, runs = wheels(robot, pose)
    for circle in circles:
        ax.plot(*circle.T, color=WHEEL_COLOR, linewidth=0.9, zorder=1.9)
    for run, upright in runs:
        ax.plot(*run.T, color=WHEEL_COLOR, linewidth=0.7, linestyle="-" if upright else ":", zorder=1.8)
    return np.concatenate([*circles, *(run for run, _ in runs), np.empty((0, 3))])


def _draw_box(ax: Axes3D, corners: Array, color: str, width: float) -> None:
    for edge in EDGES:
        ax.plot(*corners[list(edge)].T, color=color, linewidth=width, zorder=1.0 + width)


def _draw_ground(ax: Axes3D, points: Array, platform: Array) -> None:
    """The ground under everything, and the platform's shadow on it."""
    for flat, color in zip(ground(points, platform), (FLOOR_COLOR, SHADOW_COLOR), strict=True):
        ax.add_collection3d(Poly3DCollection([flat], facecolor=color, edgecolor="none", zorder=0.5))


def _number(ax: Axes3D, anchors: Array, points: Array) -> None:
    """The number of each cable above and outside its anchor; anchors close to each other share a place."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    left = list(range(len(anchors)))
    while left:
        together = [k for k in left if np.linalg.norm(anchors[k] - anchors[left[0]]) <= NEAR * size]
        left = [k for k in left if k not in together]
        place = anchors[together].mean(axis=0)
        out = (place - points.mean(axis=0)) * (1.0, 1.0, 0.0)
        out = 0.5 * out / (np.linalg.norm(out) or 1.0) + (0.0, 0.0, 0.85)  # upward: the axes have their numbers below
        place = place + AWAY * size * out
        text = ", ".join(map(str, together))
        ax.text(*place, text, fontsize=current().tick, ha="center", va="center", path_effects=HALO, zorder=5.0)


def tension_bar(ax: Axes, scale: TensionScale, tension: Array, place: Literal["left", "right"]) -> None:
    """A bar that says what the colors of cables mean.

    Args:
        ax: Axes beside which it stands.
        scale: What the colors mean.
        tension: Of the cables [N], shape (m,); a bar has an arrow where one of them is beyond its end.
        place: "left" or "right".
    """
    steps = np.geomspace(scale.low, scale.high, 128)
    shown = ScalarMappable(LogNorm(scale.low, scale.high), ListedColormap(scale.colors(steps) / 255.0))
    below, above = tension.min() < scale.low * (1.0 - 1e-6), tension.max() > scale.high * (1.0 + 1e-6)
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    bar = ax.figure.colorbar(
        shown, ax=ax, location=place, shrink=0.6, pad=0.0, aspect=24, extend=extend[bool(below), bool(above)]
    )
    if bar.solids is not None:
        bar.solids.set_rasterized(False)
        bar.solids.set_edgecolor("face")  # no white seams
    bar.set_label(r"chord tension $\tau$ [N]", fontsize=current().label)
    bar.set_ticks(list(scale.ticks()), labels=[n(tick, ",.4g") for tick in scale.ticks()])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=current().tick)


def dress_space(ax: Axes3D, points: Array, title: str) -> None:
    """Labels, and ticks as far apart as their numbers are wide, none where two axes meet."""
    ax.set_title(title, fontsize=current().label, y=0.97)
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = min(0.0, low[2])
    size = np.maximum(high - low, 0.1 * np.max(high - low))
    middle = 0.5 * (low + high)
    ax.set(**{f"{name}lim": (m - 0.5 * s, m + 0.5 * s) for name, m, s in zip("xyz", middle, size, strict=True)})
    for name, axis, share in zip("xyz", (ax.xaxis, ax.yaxis, ax.zaxis), size / size.max(), strict=True):
        axis.set_label_text(f"${name}$ [m]", fontsize=current().label)
        axis.labelpad = 7.0
        axis.set_tick_params(labelsize=current().tick, pad=0.0)
        axis.set_major_locator(MaxNLocator(max(1, round(4.5 * share)), steps=[1, 2, 5, 10], prune="both"))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    ax.grid(visible=False)
    ax.set_box_aspect(size, zoom=0.84 - 0.1 * float(size[2] / size.max()))  # what is tall needs room for its labels

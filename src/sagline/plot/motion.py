"""Where a path leads and how fast: the article's figures 18 and 19."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arguments import instance
from sagline.motion.path import Path
from sagline.plot.names import name_lines
from sagline.plot.sheet import BLUE, COLORS, VERMILLION, axes_or_new, dressed
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.axes import Axes

START_COLOR = "#A84300"  # vermillion, dark enough for text
MARKS = 100  # arrows along a path: more are a blur, and each takes its time
LEVEL = 1e-9  # m: a path that rises less lies in a plane


def path(path: Path, ax: Axes | None = None) -> Axes:
    """The way of the platform's origin seen from above, with its start and direction.

    Args:
        path: The path.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax, height=3.6, width=4.6)
    x, y, z = instance(path, Path, "path").pose.position.T
    ax.plot(x, y, color=BLUE, linewidth=1.3)
    ax.plot(x[0], y[0], "o", color=VERMILLION, markersize=5.0, zorder=3.0)
    ax.set_title("\N{BLACK CIRCLE} start", color=START_COLOR, fontsize=current().tick, loc="left")
    for k in _marks(path):
        base = path.pose.position[k, :2]
        tip = base + 1e-3 * path.twist[k, :2]  # s: short enough to show the direction only
        arrow = {"arrowstyle": "-|>", "color": BLUE, "mutation_scale": 11.0}
        ax.annotate("", (tip[0], tip[1]), (base[0], base[1]), arrowprops=arrow)
    low, high = float(z.min()), float(z.max())
    height = f"$z$ = {low:g} m" if high - low < LEVEL else f"$z$ from {low:g} m to {high:g} m"
    ax.set_title(height, fontsize=current().tick, loc="right")
    dressed(ax, "$x$ [m]", "$y$ [m]")
    ax.set_aspect("equal")
    ax.margins(0.06)
    return ax


def velocity(path: Path, ax: Axes | None = None) -> Axes:
    """Velocity of the platform's origin over time, along x, y and z.

    Args:
        path: The path.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax, height=2.6)
    for name, course, color, style in zip(
        "xyz", instance(path, Path, "path").twist.T[:3], COLORS[:3], ("-", "--", ":"), strict=True
    ):
        ax.plot(path.time, course, color=color, linestyle=style, linewidth=1.3, label=f"$v_{name}$")
    dressed(ax, "time [s]", "velocity [m/s]")
    if len(path) > 1:
        ax.set_xlim(path.time[0], path.time[-1])
    name_lines(ax)
    return ax


def _marks(path: Path) -> list[int]:
    """Samples before the middle of each stretch between two rests, so that arrows there and back do not meet.

    Of more stretches than anybody can tell apart, evenly chosen ones.
    """
    speed = np.linalg.norm(path.twist[:, :2], axis=1)
    moving = np.concatenate(([False], speed > 1e-3 * speed.max(initial=0.0), [False]))
    edges = np.flatnonzero(np.diff(moving.astype(np.int8))).reshape(-1, 2)
    chosen = edges[np.unique(np.linspace(0, len(edges) - 1, min(len(edges), MARKS)).astype(np.intp))]
    return [int(first + 0.42 * (end - first)) for first, end in chosen]

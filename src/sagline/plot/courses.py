"""What the cables do along a plan: lengths, tensions, and all of it on one page."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np
from matplotlib.ticker import MaxNLocator

from sagline.core.arguments import choice, instance
from sagline.core.errors import InvalidValueError
from sagline.kinematics.plan import Plan
from sagline.plot.names import name_all, name_lines
from sagline.plot.sheet import COLORS, axes_or_new, draw_course, dressed, shade, sheet
from sagline.plot.style import current

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sagline.core.arrays import Array

TENSIONS = {
    "chord_tension": r"chord tension $\tau$ [N]",
    "horizontal_tension": r"horizontal tension $T_x$ [N]",
    "vertical_force": r"vertical force $T_z$ [N]",
    "frame_end_tension": r"tension at the frame end $T_A$ [N]",
    "platform_end_tension": r"tension at the platform end $T_B$ [N]",
}
LENGTHS = {
    "unstrained_length": (r"unstrained length $L$ [m]", 1.0),
    "adjusting_length": (r"adjusting length $d = L - D$ [mm]", 1e3),
}
OVERVIEW = ("unstrained_length", "adjusting_length", "horizontal_tension", "vertical_force")
INFEASIBLE = "infeasible"

Entry = TypeVar("Entry")


def tensions(plan: Plan, quantity: str = "chord_tension", ax: Axes | None = None) -> Axes:
    """Tensions of all cables over time.

    Args:
        plan: The plan; over the number of the pose where it follows no path.
        quantity: One of "chord_tension", "horizontal_tension", "vertical_force", "frame_end_tension" and
            "platform_end_tension", as `CableState` has them [N].
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If there is no such quantity.
    """
    ax = axes_or_new(ax)
    _tensions(ax, plan, quantity)
    name_lines(ax)
    return ax


def lengths(plan: Plan, quantity: str = "unstrained_length", ax: Axes | None = None) -> Axes:
    """Lengths of all cables over time.

    Args:
        plan: The plan; over the number of the pose where it follows no path.
        quantity: "unstrained_length", L [m], or "adjusting_length", d = L - D [mm].
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If there is no such quantity.
    """
    ax = axes_or_new(ax)
    _lengths(ax, plan, quantity)
    name_lines(ax)
    return ax


def overview(plan: Plan) -> Figure:
    """Lengths, adjusting lengths, horizontal tensions and vertical forces of all cables: the article's figure 20.

    Args:
        plan: The plan; over the number of the pose where it follows no path.

    Returns:
        A figure of four panels.
    """
    rows, columns, height = (4, 1, 9.0) if current().narrow else (2, 2, 5.0)
    figure = sheet(height)
    panels = figure.subplots(rows, columns, sharex=True).flat
    for draw, ax, quantity in zip((_lengths, _lengths, _tensions, _tensions), panels, OVERVIEW, strict=True):
        draw(ax, plan, quantity)
        ax.label_outer()
    handles, labels = panels[0].get_legend_handles_labels()
    name_all(figure, handles, labels, "outside right center")
    return figure


def clock_of(plan: Plan) -> Array:
    """What a plan runs along.

    Args:
        plan: The plan.

    Returns:
        Times of its path [s], or the numbers of its poses, shape (N,).

    Raises:
        InvalidValueError: If it has no pose.
    """
    if not plan.status.size:
        raise InvalidValueError("plan", "one of no pose", "one pose at least", "Plan some poses first.")
    return np.arange(plan.status.size, dtype=np.float64) if plan.path is None else plan.path.time


def dress_over(ax: Axes, plan: Plan, label: str) -> None:
    """Dress axes of what a plan does over time, or over the numbers of its poses.

    Args:
        ax: The axes.
        plan: The plan.
        label: Of the vertical axis, with its unit.
    """
    dressed(ax, "pose" if plan.path is None else "time [s]", label)
    if plan.path is None:
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    clock = clock_of(plan)
    if clock.size > 1:
        ax.set_xlim(clock[0], clock[-1])


def _lengths(ax: Axes, plan: Plan, quantity: str) -> None:
    label, scale = _known(quantity, LENGTHS)
    _cables(ax, plan, scale * getattr(instance(plan, Plan, "plan").state.cables, quantity), label)


def _tensions(ax: Axes, plan: Plan, quantity: str) -> None:
    label = _known(quantity, TENSIONS)
    _cables(ax, plan, getattr(instance(plan, Plan, "plan").state.cables, quantity), label)


def _known(quantity: str, table: Mapping[str, Entry]) -> Entry:
    return table[choice(quantity, "quantity", table)]


def _cables(ax: Axes, plan: Plan, values: Array, label: str) -> None:
    """One line a cable; neighbors, which most robots pair at a winch post, share a color."""
    courses = np.atleast_2d(values)
    clock = clock_of(plan)
    for i, course in enumerate(courses.T):
        color = COLORS[i // 2 % len(COLORS)]
        style = "-" if i % 2 == 0 else (0, (4.0, 1.6))
        draw_course(ax, clock, course, color=color, linestyle=style, linewidth=1.1, label=f"cable {i}")
    shade(ax, clock, [(gap.first, gap.last) for gap in plan.gaps], INFEASIBLE)
    dress_over(ax, plan, label)

"""How far the platform ends up from where it was planned: the article's figure 22."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arguments import HOW_TO_GET, instance
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.confirm import Confirmation
from sagline.plot.courses import INFEASIBLE, clock_of, dress_over
from sagline.plot.names import name_all, name_lines
from sagline.plot.sheet import COLORS, ORANGE, axes_or_new, draw_course, runs, shade, sheet
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST = 1e-3  # mm: rounding errors are drawn as the flat line that they are, and told
FLAT = 0.01  # of the axis: below it a course is a flat line to the eye
UNCONFIRMED = "not confirmed"  # planned, but the lengths lead to no stable equilibrium that is found
STYLES = ("-", (0, (4.0, 1.6)), (0, (1.0, 1.2)))


def error(confirmation: Confirmation, ax: Axes | None = None) -> Axes:
    """Position error along x, y and z over time: where the platform really is, less where it was planned.

    Poses without a plan, and poses whose lengths lead to no stable equilibrium that was found, are shaded. Errors too
    small for the axis are told in numbers.

    Args:
        confirmation: A plan and what its lengths lead to.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax, height=2.6)
    _draw(ax, confirmation)
    _tell_flat(ax, confirmation)
    name_lines(ax)
    return ax


def errors(*confirmations: Confirmation) -> Figure:
    """Position errors of several plans side by side, on one scale: the article's figure 22.

    Args:
        confirmations: Plans and what their lengths lead to.

    Returns:
        A figure of one panel each, titled with the robot.

    Raises:
        InvalidValueError: If there is none, or one is no confirmation.
    """
    if not confirmations:
        raise InvalidValueError("confirmations", "none", "one at least", HOW_TO_GET["Confirmation"])
    figure = sheet(height=2.8)
    panels = figure.subplots(1, len(confirmations), sharey=True, squeeze=False)[0]
    for ax, confirmation in zip(panels, confirmations, strict=True):
        _draw(ax, confirmation)
        ax.set_title(confirmation.plan.state.one_robot.name, fontsize=current().tick)
        ax.label_outer()
    for ax, confirmation in zip(panels, confirmations, strict=True):
        _tell_flat(ax, confirmation)  # on the scale that they have found together
    handles = {label: line for ax in panels for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    name_all(figure, [*handles.values()], [*handles], "outside right upper")
    return figure


def _draw(ax: Axes, confirmation: Confirmation) -> None:
    plan = instance(confirmation, Confirmation, "confirmation").plan
    clock = clock_of(plan)
    courses = 1e3 * np.atleast_2d(confirmation.position_error)
    for name, course, color, style in zip("xyz", courses.T, COLORS[:3], STYLES, strict=True):
        draw_course(ax, clock, course, color=color, linestyle=style, linewidth=1.2, label=f"${name}$")
    shade(ax, clock, [(gap.first, gap.last) for gap in plan.gaps], INFEASIBLE)
    lost = np.atleast_1d(plan.feasible & ~confirmation.held)
    shade(ax, clock, runs(lost), UNCONFIRMED, ORANGE, 0.25)
    dress_over(ax, plan, "position error [mm]")
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -LEAST), max(high, LEAST))


def _tell_flat(ax: Axes, confirmation: Confirmation) -> None:
    """Say how large errors are that the scale of the axis makes a flat line."""
    errors = np.abs(1e3 * confirmation.position_error)
    known = errors[np.isfinite(errors)]
    if known.size and known.max() < FLAT * max(map(abs, ax.get_ylim())):
        size = 1e3 * float(np.nanmax(confirmation.plan.unstrained_length))
        text = f"largest: {n(known.max(), '.2g', 'mm', size=size)}"
        ax.text(0.03, 0.95, text, transform=ax.transAxes, fontsize=current().tick, va="top")

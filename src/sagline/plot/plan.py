"""Plots over time of paths, plans and confirmations: lengths, tensions, position errors, velocity."""

from __future__ import annotations

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagline.core.arguments import HOW_TO_GET, choice, evenly_spaced, instance, true_runs
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.confirm import Confirmation
from sagline.kinematics.plan import Plan
from sagline.motion.path import Path
from sagline.plot import sheet
from sagline.plot.labels import LENGTHS, PLACE, TENSIONS, TIME, figure_legend, name_lines
from sagline.plot.style import current

OVERVIEW = ("unstrained_length", "adjusting_length", "horizontal_tension", "vertical_force")
INFEASIBLE = "infeasible"
LEAST_ERROR = 1e-3  # smallest range of the axis [mm], so that rounding errors appear as a flat line
FLAT = 0.01  # errors below this share of the axis appear as a flat line, and are also written as a number
UNCONFIRMED = "not confirmed"  # color of planned lengths without a stable equilibrium
OTHER_CABLES = "0.82"  # color of the other cables, which are in the background of a panel
ROW_HEIGHT = 1.45  # height of a row of panels [in]
LIMITED = {"chord_tension": "chord", "frame_end_tension": "frame_end"}
START_COLOR = "#A84300"  # a vermilion that is dark enough for text
WIDTH, SIDE = 4.4, 1.5  # width of the axes of a top view, and height of the panel of z [in]
MOST_ARROWS = 100  # number of arrows along a path
LEVEL = 1e-9  # a path with a smaller change of height [m] counts as level


def tensions(plan: Plan, quantity: str = "chord_tension", ax: Axes | None = None) -> Axes:
    """Tensions of all cables over time.

    Args:
        plan: The plan. Without a path, the abscissa is the index of the pose.
        quantity: One of "chord_tension", "horizontal_tension", "vertical_force", "frame_end_tension" and
            "platform_end_tension", as in `CableState` [N].
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If the quantity is unknown.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> axes = sl.plot.tensions(sl.inverse(sl.load_robot("cogiro"), path))
    """
    ax = sheet.axes_or_new(ax)
    _draw_cables(ax, plan, quantity, TENSIONS)
    name_lines(ax)
    return ax


def lengths(plan: Plan, quantity: str = "unstrained_length", ax: Axes | None = None) -> Axes:
    """Lengths of all cables over time.

    Args:
        plan: The plan; without a path, the abscissa is the index of the pose.
        quantity: "unstrained_length", L [m], or "adjusting_length", d = L - D [mm].
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If the quantity is unknown.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> axes = sl.plot.lengths(sl.inverse(sl.load_robot("cogiro"), path))
    """
    ax = sheet.axes_or_new(ax)
    _draw_cables(ax, plan, quantity, LENGTHS)
    name_lines(ax)
    return ax


def overview(plan: Plan) -> Figure:
    """Lengths, adjusting lengths, horizontal tensions and vertical forces of all cables: the article's figure 20.

    Args:
        plan: The plan; without a path, the abscissa is the index of the pose.

    Returns:
        A figure of four panels.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> figure = sl.plot.overview(sl.inverse(sl.load_robot("cogiro"), path))
    """
    rows, columns, height = (4, 1, 9.0) if current().narrow else (2, 2, 5.0)
    figure = sheet.sheet(height)
    panels = figure.subplots(rows, columns, sharex=True).flat
    for ax, quantity in zip(panels, OVERVIEW, strict=True):
        _draw_cables(ax, plan, quantity, LENGTHS | TENSIONS)
        sheet.hide_shared_labels(ax)
    figure_legend(figure, panels[:1])
    return figure


def abscissa(plan: Plan) -> tuple[Array, str]:
    """Times of a plan's path, or numbers of its poses, (N,), and the axis label. InvalidValueError without poses."""
    if not plan.status.size:
        raise InvalidValueError("plan", "a plan without poses", "at least one pose", "Plan some poses first.")
    return (np.arange(plan.status.size, dtype=np.float64), "pose") if plan.path is None else (plan.path.time, TIME)


def _values(plan: Plan, quantity: str, table: dict[str, tuple[str, float]]) -> tuple[Array, str]:
    """Values (N, m) of `quantity` in the unit of its axis label, and this label."""
    label, scale = table[choice(quantity, "quantity", table)]
    return scale * np.atleast_2d(getattr(instance(plan, Plan, "plan").state.cables, quantity)), label


def _format(ax: Axes, plan: Plan, label: str) -> None:
    """Shade the infeasible poses. Set labels and limits of axes over time, or over the numbers of poses."""
    clock, axis = abscissa(plan)
    sheet.shade_spans(ax, clock, [(gap.first, gap.last + 1) for gap in plan.gaps], INFEASIBLE)
    sheet.format_clock(ax, clock, label, axis)


def _draw_cables(ax: Axes, plan: Plan, quantity: str, table: dict[str, tuple[str, float]]) -> None:
    """Draw one line per cable, and shade the infeasible poses."""
    values, label = _values(plan, quantity, table)
    clock, _ = abscissa(plan)
    sheet.draw_cables(ax, clock, values)
    _format(ax, plan, label)


def error(confirmation: Confirmation, ax: Axes | None = None) -> Axes:
    """Position error along x, y and z over time: confirmed position minus planned position.

    Infeasible poses, and poses for which no stable equilibrium was found, are shaded. If the errors are too small to
    see, the largest error is written as a number.

    Args:
        confirmation: A confirmed plan.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> plan = sl.inverse(sl.load_robot("cogiro"), path)
        >>> axes = sl.plot.error(sl.confirm(plan))
    """
    ax = sheet.axes_or_new(ax, height=2.6)
    _draw_errors(ax, confirmation)
    _write_flat_error(ax, confirmation)
    name_lines(ax)
    return ax


def errors(*confirmations: Confirmation) -> Figure:
    """Position errors of several plans, side by side with the same scale, as in the article's figure 22.

    Args:
        confirmations: Confirmed plans.

    Returns:
        A figure with one panel per confirmation, with the robot as its title.

    Raises:
        InvalidValueError: If no confirmation is given.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> plans = [
        ...     sl.inverse(robot, path, model=model)
        ...     for model in (sl.Straight(), sl.Elastic())
        ... ]
        >>> figure = sl.plot.errors(*map(sl.confirm, plans))
    """
    if not confirmations:
        raise InvalidValueError("confirmations", "none", "at least one", HOW_TO_GET["Confirmation"])
    figure = sheet.sheet(height=2.8)
    panels = figure.subplots(1, len(confirmations), sharey=True, squeeze=False)[0]
    for ax, confirmation in zip(panels, confirmations, strict=True):
        _draw_errors(ax, confirmation)
        ax.set_title(confirmation.plan.robot.name, fontsize=current().tick)
        sheet.hide_shared_labels(ax)
    for ax, confirmation in zip(panels, confirmations, strict=True):
        _write_flat_error(ax, confirmation)  # all panels have this scale
    figure_legend(figure, panels)
    return figure


def _draw_errors(ax: Axes, confirmation: Confirmation) -> None:
    plan = instance(confirmation, Confirmation, "confirmation").plan
    clock, _ = abscissa(plan)
    sheet.draw_components(ax, clock, 1e3 * np.atleast_2d(confirmation.position_error))
    _format(ax, plan, "position error [mm]")
    lost = np.atleast_1d(plan.feasible & ~confirmation.held)
    sheet.shade_spans(ax, clock, true_runs(lost), UNCONFIRMED, sheet.ORANGE, 0.25)
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -LEAST_ERROR), max(high, LEAST_ERROR))


def _write_flat_error(ax: Axes, confirmation: Confirmation) -> None:
    """Write the largest error as a number if it is too small to see."""
    errors = np.abs(1e3 * confirmation.position_error)
    known = errors[np.isfinite(errors)]
    if known.size and known.max() < FLAT * max(map(abs, ax.get_ylim())):
        size = 1e3 * float(np.nanmax(confirmation.plan.unstrained_length))
        text = f"largest: {n(known.max(), '.2g', 'mm', size=size)}"
        ax.text(0.03, 0.95, text, transform=ax.transAxes, fontsize=current().tick, va="top")


def small_multiples(plan: Plan, quantity: str = "chord_tension") -> Figure:
    """One quantity over time in one panel per cable, with equal scales. In the background, all other cables are gray.

    Several panels are easier to read than a single panel with many crossing lines, also in print without color. Dotted
    lines are the robot's limits of the quantity; a limit outside the range of the axis is not drawn.

    Args:
        plan: The plan; without a path, the abscissa is the index of the pose.
        quantity: A quantity of `sl.plot.tensions` or `sl.plot.lengths`: "chord_tension", "horizontal_tension",
            "vertical_force", "frame_end_tension" and "platform_end_tension" [N], "unstrained_length" [m] and
            "adjusting_length" [mm].

    Returns:
        A figure with one panel per cable.

    Raises:
        InvalidValueError: If the quantity is unknown.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> figure = sl.plot.small_multiples(sl.inverse(sl.load_robot("cogiro"), path))
    """
    values, label = _values(plan, quantity, TENSIONS | LENGTHS)
    (clock, axis), robot, count = abscissa(plan), plan.robot, values.shape[1]
    columns = min(count, 2 if current().narrow else 4)
    rows = ceil(count / columns)
    figure = sheet.sheet(0.4 + rows * ROW_HEIGHT)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).flat
    for i, ax in enumerate(panels):
        if i >= count:
            ax.set_axis_off()
            continue
        for other in np.delete(values, i, axis=1).T:
            sheet.draw_series(ax, clock, other, color=OTHER_CABLES, linewidth=0.6, zorder=1.5)
        sheet.draw_series(ax, clock, values[:, i], color=sheet.BLUE, linewidth=1.3, zorder=2.0, label=f"cable {i}")
        _format(ax, plan, "")
        ax.set_xlabel("")
        ax.set_title(f"cable {i}", fontsize=current().tick, loc="left", pad=2.0)
        sheet.hide_shared_labels(ax)
    low, high = panels[0].get_ylim()
    for i, ax in enumerate(panels[:count]):
        for limit in (robot.tension_min[i], robot.tension_max[i]):
            if LIMITED.get(quantity) == robot.tension_limits_of and low <= limit <= high:
                ax.axhline(limit, color=sheet.VERMILLION, linewidth=0.8, linestyle=":", zorder=1.8)
    figure.supxlabel(axis, fontsize=current().label)
    figure.supylabel(label, fontsize=current().label)
    return figure


def path(path: Path, ax: Axes | None = None) -> Axes:
    """Top view of a path with start and direction. In a new figure, a second panel shows the height over time.

    Args:
        path: The path.
        ax: Axes to draw on; None for a new figure. The heading states the height of a level path.

    Returns:
        The axes of the top view.

    Examples:
        >>> import sagline as sl
        >>> axes = sl.plot.path(sl.article_path())
    """
    x, y, z = instance(path, Path, "path").pose.position.T
    low, high = float(z.min()), float(z.max())
    if ax is None:
        top = 0.7 + WIDTH * float(np.clip(np.ptp(y) / max(float(np.ptp(x)), LEVEL), 0.2, 0.9))
        heights = (top,) if high - low < LEVEL else (top, SIDE)
        ax, *below = sheet.sheet(sum(heights)).subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
        for side in below:
            sheet.draw_series(side, path.time, z, color=sheet.BLUE, linewidth=1.3)
            sheet.format_clock(side, path.time, PLACE[2])
    ax = sheet.axes_or_new(ax)
    ax.plot(x, y, color=sheet.BLUE, linewidth=1.3)
    ax.plot(x[0], y[0], "o", color=sheet.VERMILLION, markersize=5.0, zorder=3.0)
    ax.set_title("\N{BLACK CIRCLE} start", color=START_COLOR, fontsize=current().tick, loc="left")
    for k in _arrow_samples(path):
        base = path.pose.position[k, :2]
        tip = base + 1e-3 * path.twist[k, :2]  # step [s], so short that the arrow shows only the direction
        arrow = {"arrowstyle": "-|>", "color": sheet.BLUE, "mutation_scale": 11.0}
        ax.annotate("", (tip[0], tip[1]), (base[0], base[1]), arrowprops=arrow)
    height = f"$z$ = {low:g} m" if high - low < LEVEL else f"$z$ from {low:g} m to {high:g} m"
    ax.set_title(height, fontsize=current().tick, loc="right")
    sheet.format_axes(ax, *PLACE[:2])
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

    Examples:
        >>> import sagline as sl
        >>> axes = sl.plot.velocity(sl.article_path())
    """
    ax = sheet.axes_or_new(ax, height=2.6)
    sheet.draw_components(ax, instance(path, Path, "path").time, path.twist[:, :3], "v_{}")
    sheet.format_clock(ax, path.time, "velocity [m/s]")
    name_lines(ax)
    return ax


def _arrow_samples(path: Path) -> list[int]:
    """Samples for arrows, before the middle of each motion between two rests. Of many motions, an even selection."""
    speed = np.linalg.norm(path.twist[:, :2], axis=1)
    moves = true_runs(speed > 1e-3 * speed.max(initial=0.0))
    return [int(first + 0.42 * (end - first)) for first, end in moves[evenly_spaced(len(moves), MOST_ARROWS)]]

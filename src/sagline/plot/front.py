"""Figure of the candidates of an optimization, with the best candidates marked."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagline.core.arguments import instance
from sagline.core.arrays import Array
from sagline.optimization.design import Front
from sagline.optimization.request import Goal
from sagline.plot.labels import name_lines, set_heading
from sagline.plot.sheet import BLUE, GAP_COLOR, VERMILLION, format_axes, sheet

EACH = 3.2  # height of a panel [in]


def front(front: Front) -> Figure:
    """The best robots found by `design`, and all candidates.

    With one goal, the figure shows the progress: each candidate, and the best candidate so far. With several goals, it
    shows the first goal against each other goal. A line connects the best robots.

    Args:
        front: Result of `design`.

    Returns:
        The figure.

    Examples:
        >>> import sagline as sl
        >>> figure = sl.plot.front(sl.load_front("front"))  # doctest: +SKIP
    """
    goals = instance(front, Front, "front").goals
    count = max(1, len(goals) - 1)
    figure = sheet(height=0.4 + EACH * count)
    panels = figure.subplots(count, 1, squeeze=False)[:, 0]
    if len(goals) == 1:
        _draw_course(panels[0], front)
    else:
        for k, ax in enumerate(panels, start=1):
            _draw_pair(ax, front, k)
    name_lines(panels[0])
    set_heading(figure, f"{front.start.name}, {len(front.evaluated):,} robots by {front.optimizer}")
    return figure


def _draw_course(ax: Axes, front: Front) -> None:
    values = front.evaluated_values[:, 0]
    number = np.arange(len(values))
    ax.plot(number, values, ".", color=GAP_COLOR, markersize=3.0, label="candidates", linestyle="none")
    best = _best_until(values, highest=front.goals[0].maximize)
    ax.plot(number, best, color=BLUE, linewidth=1.4, label="best so far")
    ax.axhline(front.start_values[0], color=VERMILLION, linewidth=1.0, linestyle="--", label="start")
    format_axes(ax, "candidate", _label_of(front.goals[0]))
    known = values[np.isfinite(values)]
    if known.size:
        low, high = np.quantile(known, [0.02, 0.98]).tolist()
        ends = [low, high, float(front.values[0, 0]), float(front.start_values[0])]
        spare = 0.08 * (max(ends) - min(ends)) or 1.0
        ax.set_ylim(min(ends) - spare, max(ends) + spare)


def _draw_pair(ax: Axes, front: Front, k: int) -> None:
    every, better = front.evaluated_values[:, [0, k]], front.values[:, [0, k]]
    order = np.argsort(better[:, 0])
    ax.plot(*every.T, ".", color=GAP_COLOR, markersize=3.0, label="candidates", linestyle="none")
    if front.better:
        ax.plot(*better[order].T, "o-", color=BLUE, markersize=4.0, linewidth=1.0, label="no robot is better")
    ax.plot(*front.start_values[[0, k]], "D", color=VERMILLION, markersize=6.0, label="start", linestyle="none")
    format_axes(ax, _label_of(front.goals[0]), _label_of(front.goals[k]))


def _label_of(goal: Goal) -> str:
    """Axis label of a goal: name, unit and direction of improvement."""
    unit = f" [{goal.unit}]" if goal.unit else ""
    return f"{goal.kind.replace('_', ' ')}{unit}, {'higher' if goal.maximize else 'lower'} is better"


def _best_until(values: Array, *, highest: bool) -> Array:
    """Best value of all candidates up to each index; NaN before the first finite value."""
    sign = 1.0 if highest else -1.0
    found = np.maximum.accumulate(np.where(np.isfinite(values), sign * values, -np.inf))
    return np.asarray(np.where(np.isfinite(found), sign * found, np.nan))

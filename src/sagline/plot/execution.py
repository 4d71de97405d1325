"""An execution over time: states, tensions, tension errors, position errors and faults."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.control.execution import Execution, null_space_error, position_error
from sagline.control.recording import EventKind
from sagline.control.states import State
from sagline.core.arguments import instance
from sagline.plot.labels import figure_legend, legend_above, name_lines
from sagline.plot.sheet import (
    BLUE,
    DASHED,
    GAP_COLOR,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    axes_or_new,
    cable_look,
    draw_components,
    draw_series,
    format_clock,
    mark_event,
    sheet,
    true_runs,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sagline.core.arrays import Array

PER_METER: Final = 1e3  # [mm]
STATES: Final = {  # states that have a color of their own
    State.HOMING: ORANGE, State.MOVING: BLUE, State.JOGGING: SKY, State.PAUSING: GREEN, State.STOPPING: PURPLE,
    State.FAULT: VERMILLION, State.EMERGENCY: "#8B0000",
}  # fmt: skip


def execution(done: Execution) -> Figure:
    """Overview of an execution: states, tensions, their error, and the estimated position of the platform.

    The panels are, from top to bottom: the states, with a line at each fault; the measured and the planned tensions
    (dashed); the part of the tension error that lengths can correct while the platform stays at rest, filtered as in
    the tension loop; and the estimated minus the planned position.

    Args:
        done: The execution.

    Returns:
        A figure of four panels.

    Raises:
        InvalidValueError: If `done` is not an execution.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> figure = sl.plot.execution(done)  # doctest: +SKIP
    """
    instance(done, Execution, "execution")
    figure = sheet(height=7.6)
    parts = figure.subplots(4, 1, sharex=True, height_ratios=(0.25, 1.6, 1.0, 1.0))
    draw: tuple[Callable[[Execution, Axes], Axes], ...] = (states, measured_tensions, mendable_tensions, place_errors)
    for part, panel in zip(draw, parts, strict=True):
        part(done, panel)
        if panel is not parts[-1]:
            panel.set_xlabel("")
            panel.tick_params(labelbottom=False)
        _mark_faults(panel, done)
    own: Any = parts[0].get_legend()
    own.remove()  # the names of the faults are written at the place of the label
    figure_legend(figure, parts[:1])
    return figure


def states(done: Execution, ax: Axes | None = None) -> Axes:
    """The states of the controller over time, as a band.

    Args:
        done: The execution.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> axes = sl.plot.states(done)  # doctest: +SKIP
    """
    ax = axes_or_new(ax, height=0.9)
    clock = _clock(done)
    looks: dict[State | None, tuple[str, str]] = {code: (color, code.name) for code, color in STATES.items()}
    looks[None] = GAP_COLOR, "standing"
    for code, (color, name) in looks.items():
        there = ~np.isin(done.state, list(STATES)) if code is None else done.state == code
        spans = [(clock[first], clock[last] + done.period - clock[first]) for first, last in true_runs(there)]
        if spans:
            ax.broken_barh(spans, (0.0, 1.0), facecolors=color, label=name, linewidth=0.0)
    format_clock(ax, clock, "")
    ax.set_yticks([])
    ax.grid(visible=False)
    ax.spines["left"].set_visible(False)
    handles, labels = ax.get_legend_handles_labels()
    place = legend_above(ax, labels)
    ax.legend(handles, labels, **{**place, "handlelength": 1.0, "columnspacing": 1.0})
    return ax


def measured_tensions(done: Execution, ax: Axes | None = None) -> Axes:
    """Tensions at the frame ends: measured by the load cells, and planned (dashed).

    Args:
        done: The execution.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> axes = sl.plot.measured_tensions(done)  # doctest: +SKIP
    """
    ax = axes_or_new(ax)
    clock = _clock(done)
    for i, read in enumerate(done.tension.T):
        draw_series(ax, clock, read, color=cable_look(i)["color"], linewidth=0.8, alpha=0.8, label=f"cable {i}")
    for i, planned in enumerate(done.planned_tension.T):
        draw_series(
            ax, clock, planned, color="black", linewidth=0.7, linestyle=DASHED, label="planned" if i == 0 else "_"
        )
    return _finished(ax, clock, "tension at the frame end [N]")


def mendable_tensions(done: Execution, ax: Axes | None = None) -> Axes:
    """Part of the tension errors that lengths can correct with the platform at rest, filtered as in the tension loop.

    Args:
        done: The execution.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes; empty for a robot without redundancy.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> axes = sl.plot.mendable_tensions(done)  # doctest: +SKIP
    """
    ax = axes_or_new(ax, height=2.6)
    clock = _clock(done)
    for i, course in enumerate(null_space_error(done).T):
        draw_series(ax, clock, course, **cable_look(i), linewidth=1.0, label=f"cable {i}")
    return _finished(ax, clock, "correctable tension\nerror [N]")


def place_errors(done: Execution, ax: Axes | None = None) -> Axes:
    """Estimated minus planned position of the platform's origin, along x, y and z, over time.

    Args:
        done: The execution.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> axes = sl.plot.place_errors(done)  # doctest: +SKIP
    """
    ax = axes_or_new(ax, height=2.6)
    clock = _clock(done)
    draw_components(ax, clock, PER_METER * position_error(done))
    return _finished(ax, clock, "estimated minus\nplanned [mm]")


def _clock(done: Execution) -> Array:
    """Time since the first cycle [s]."""
    time = instance(done, Execution, "execution").time
    return np.asarray(time - time[0]) if time.size else time


def _finished(ax: Axes, clock: Array, label: str) -> Axes:
    """Set the labels and limits of the axes, and write the names of the lines."""
    format_clock(ax, clock, label)
    name_lines(ax)
    return ax


def _mark_faults(ax: Axes, done: Execution) -> None:
    """Draw a line at each fault; the fault's name is above the panel of the states."""
    for event in done.events:
        if event.kind is EventKind.FAULT and len(done):
            name = "" if ax.get_yticks().size else event.name
            mark_event(ax, float(event.time - done.time[0]), name, VERMILLION, 4.0)

"""Simulations and executions over time: tensions, motion, energy, states, errors and faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagline.control.execution import Execution, null_space_error, position_error
from sagline.control.recording import EventKind
from sagline.control.states import State
from sagline.core.arguments import instance, true_runs
from sagline.core.arrays import Array
from sagline.core.numbers import ROUNDING, n, prefixed_unit
from sagline.dynamics.simulation.results import Simulation
from sagline.plot import sheet
from sagline.plot.labels import figure_legend, legend_above, name_lines, set_heading, write_beside
from sagline.plot.style import current

PER_METER: Final = 1e3  # [mm]
SHOWN: Final = 0.5  # the tension limit is drawn if the largest tension exceeds this share of the limit
AT_REST = 1e-7  # smallest range of the energy axis, as a share of the potential energy
STATES: Final = {  # states that have a color of their own
    State.HOMING: sheet.ORANGE, State.MOVING: sheet.BLUE, State.JOGGING: sheet.SKY, State.PAUSING: sheet.GREEN,
    State.STOPPING: sheet.PURPLE, State.FAULT: sheet.VERMILLION, State.EMERGENCY: "#8B0000",
}  # fmt: skip


def simulation(simulation: Simulation) -> Figure:
    """Tensions at the frame ends over time, and displacement and rotation of the platform relative to its first pose.

    Args:
        simulation: The simulation.

    Returns:
        A figure of three panels.

    Examples:
        >>> import sagline as sl
        >>> robot, broken = sl.load_robot("cogiro"), sl.Break(cable=3, time=0.1)
        >>> motion = sl.simulate(robot, (1.0, 0.5, 2.0), duration=0.5, events=broken)
        >>> figure = sl.plot.simulation(motion)
    """
    time, pose = instance(simulation, Simulation, "simulation").time, simulation.pose
    figure = sheet.sheet(height=6.5)
    above, middle, below = figure.subplots(3, 1, sharex=True, height_ratios=(1.8, 1.0, 1.0))
    sheet.draw_cables(above, time, simulation.tensions)
    limit = float(simulation.robot.tension_max.min())
    if float(np.nanmax(simulation.tensions)) > SHOWN * limit:
        above.axhline(limit, color=sheet.VERMILLION, linewidth=0.8, linestyle=":", label="tension_max")
    sheet.draw_components(middle, time, pose.position - pose.position[0])
    sheet.draw_components(below, time, np.degrees((pose.rotation * pose.rotation[0].inv()).as_rotvec()))
    labels = "tension [N]", "displacement [m]", "rotation [°]"
    for ax, label in zip((above, middle, below), labels, strict=True):
        sheet.format_clock(ax, time, label)
        sheet.hide_shared_labels(ax)
        _mark_events(ax, simulation, named=ax is above)
        if ax is not above:
            name_lines(ax)
    figure_legend(figure, [above])  # the title is above the names of the events
    return figure


def energy(simulation: Simulation) -> Figure:
    """Energies over time: kinetic, potential, supplied and lost. A lower panel shows the error of the energy balance.

    Args:
        simulation: The simulation.

    Returns:
        A figure of two panels. The curve of the potential energy is the change from the initial value.

    Examples:
        >>> import sagline as sl
        >>> motion = sl.simulate(sl.load_robot("cogiro"), (1.0, 0.5, 2.0), duration=0.5)
        >>> figure = sl.plot.energy(motion)
    """
    balance, time = instance(simulation, Simulation, "simulation").energy, simulation.time
    figure = sheet.sheet(height=4.2)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    rise = balance.potential - balance.potential[0]
    courses = {"kinetic": balance.kinetic, "potential, minus its initial value": rise}
    courses |= {"supplied": balance.supplied, "lost": balance.lost}
    if balance.removed.any():
        courses["removed"] = balance.removed
    for (name, course), color, style in zip(courses.items(), sheet.COLORS, sheet.LINE_STYLES, strict=False):
        above.plot(time, course, color=color, linestyle=style, linewidth=1.2, label=name)
    sheet.format_clock(above, time, "energy [J]")
    above.set_xlabel("")
    _mark_events(above, simulation, named=True)
    figure_legend(figure, [above])
    widest = _largest(*courses.values(), balance.potential)
    power, unit = prefixed_unit(max(_largest(balance.error), ROUNDING * widest), ".2g", "J")
    below.plot(time, balance.error * 10.0**power, color="black", linewidth=1.0, label="error of the balance")
    sheet.format_clock(below, time, f"error [{unit}]")
    _mark_events(below, simulation, named=False)
    for ax, share in ((above, AT_REST), (below, ROUNDING * 10.0**power)):
        low, high = ax.get_ylim()
        ax.set_ylim(min(low, -share * widest), max(high, share * widest))
    worst = n(_largest(balance.error), ".2g", "J", size=_largest(balance.potential))
    text = f"kinetic + potential + lost - supplied, minus initial value: at most {worst}"
    set_heading(below, text, current().tick, loc="left")
    return figure


def _mark_event(ax: Axes, time: float, name: str, color: str, zorder: float) -> None:
    """Draw a vertical line at `time`, with `name` (if not "") above the axes."""
    ax.axvline(time, color=color, linewidth=1.0, zorder=zorder)
    if name:
        write_beside(ax, name, (time, 1.0), (0.0, 2.0), va="bottom", xycoords=("data", "axes fraction"))


def _mark_events(ax: Axes, simulation: Simulation, *, named: bool) -> None:
    for event in simulation.events:
        _mark_event(ax, event.time, event.text if named else "", sheet.GAP_COLOR, 1.0)


def _largest(*courses: Array) -> float:
    return max(float(np.nanmax(np.abs(course), initial=0.0)) for course in courses)


def execution(done: Execution) -> Figure:
    """Overview of an execution: states, tensions, tension errors, and position error of the platform.

    The panels show, from top to bottom: the states, with a line at each fault; the measured tensions and the planned
    tensions (dashed); the part of the tension errors that changes of length can correct without moving the platform,
    filtered as in the tension loop; and the estimated minus the planned position.

    Args:
        done: The execution.

    Returns:
        A figure of four panels.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> figure = sl.plot.execution(done)  # doctest: +SKIP
    """
    instance(done, Execution, "execution")
    figure = sheet.sheet(height=7.6)
    parts = figure.subplots(4, 1, sharex=True, height_ratios=(0.25, 1.6, 1.0, 1.0))
    draw: tuple[Callable[[Execution, Axes], Axes], ...] = (states, measured_tensions, mendable_tensions, place_errors)
    for part, panel in zip(draw, parts, strict=True):
        part(done, panel)
        if panel is not parts[-1]:
            panel.set_xlabel("")
            panel.tick_params(labelbottom=False)
        _mark_faults(panel, done)
    own: Any = parts[0].get_legend()
    own.remove()  # the names of the faults are at the place of the label
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
    ax = sheet.axes_or_new(ax, height=0.9)
    clock = _clock(done)
    looks: dict[State | None, tuple[str, str]] = {code: (color, code.name) for code, color in STATES.items()}
    looks[None] = sheet.GAP_COLOR, "standing"
    for code, (color, name) in looks.items():
        there = ~np.isin(done.state, list(STATES)) if code is None else done.state == code
        spans = [(clock[first], clock[end - 1] + done.period - clock[first]) for first, end in true_runs(there)]
        if spans:
            ax.broken_barh(spans, (0.0, 1.0), facecolors=color, label=name, linewidth=0.0)
    sheet.format_clock(ax, clock, "")
    ax.set_yticks([])
    ax.grid(visible=False)
    ax.spines["left"].set_visible(False)
    handles, labels = ax.get_legend_handles_labels()
    ax.legend(handles, labels, **legend_above(ax, labels) | {"handlelength": 1.0, "columnspacing": 1.0})
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
    ax = sheet.axes_or_new(ax)
    clock = _clock(done)
    for i, read in enumerate(done.tension.T):
        look = sheet.cable_look(i) | {"linestyle": "-", "label": f"cable {i}"}
        sheet.draw_series(ax, clock, read, **look, linewidth=0.8, alpha=0.8)
    for i, planned in enumerate(done.planned_tension.T):
        look = {"color": "black", "linestyle": sheet.DASHED, "label": "planned" if i == 0 else "_"}
        sheet.draw_series(ax, clock, planned, **look, linewidth=0.7)
    return _finished(ax, clock, "tension at the frame end [N]")


def mendable_tensions(done: Execution, ax: Axes | None = None) -> Axes:
    """Part of the tension errors that changes of length can correct without moving the platform, filtered.

    Args:
        done: The execution.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes, empty for a robot without redundancy.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> axes = sl.plot.mendable_tensions(done)  # doctest: +SKIP
    """
    ax = sheet.axes_or_new(ax, height=2.6)
    clock = _clock(done)
    sheet.draw_cables(ax, clock, null_space_error(done), linewidth=1.0)
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
    ax = sheet.axes_or_new(ax, height=2.6)
    clock = _clock(done)
    sheet.draw_components(ax, clock, PER_METER * position_error(done))
    return _finished(ax, clock, "estimated minus\nplanned [mm]")


def _clock(done: Execution) -> Array:
    """Time since the first cycle [s]."""
    time = instance(done, Execution, "execution").time
    return np.asarray(time - time[0]) if time.size else time


def _finished(ax: Axes, clock: Array, label: str) -> Axes:
    sheet.format_clock(ax, clock, label)
    name_lines(ax)
    return ax


def _mark_faults(ax: Axes, done: Execution) -> None:
    """Draw a line at each fault. The name of the fault is above the panel of the states."""
    for event in done.events:
        if event.kind is EventKind.FAULT and len(done):
            name = "" if ax.get_yticks().size else event.name
            _mark_event(ax, float(event.time - done.time[0]), name, sheet.VERMILLION, 4.0)

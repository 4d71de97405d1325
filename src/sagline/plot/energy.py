"""Where the energy of a simulation is, and what the integrator has invented."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arguments import instance
from sagline.core.numbers import n
from sagline.dynamics.simulation.results import Simulation
from sagline.plot.names import name_lines, wrapped
from sagline.plot.sheet import COLORS, GAP_COLOR, dressed, sheet
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sagline.core.arrays import Array

STYLES = ("-", (0, (4.0, 1.6)), (0, (1.0, 1.2)), (0, (5.0, 1.5, 1.0, 1.5)), (0, (7.0, 2.0)))
ROUNDING = 1e-12  # of the energy that there is: an error below it is the arithmetic's


def energy(simulation: Simulation) -> Figure:
    """Kinetic and potential energy, work supplied and energy lost over time, and the error of the balance below.

    The potential energy is drawn less its value at the start.

    Args:
        simulation: The simulation.

    Returns:
        A figure of two panels.
    """
    balance, time = instance(simulation, Simulation, "simulation").energy, simulation.time
    figure = sheet(height=4.2)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    rise = balance.potential - balance.potential[0]
    courses = {"kinetic": balance.kinetic, "potential, less its start": rise}
    courses |= {"supplied": balance.supplied, "lost": balance.lost}
    if balance.removed.any():
        courses["left with cables and loads"] = balance.removed
    for (name, course), color, style in zip(courses.items(), COLORS, STYLES, strict=False):
        above.plot(time, course, color=color, linestyle=style, linewidth=1.2, label=name)
    dressed(above, "", "energy [J]")
    _mark(above, simulation, named=True)
    if time.size > 1:
        above.set_xlim(time[0], time[-1])
    name_lines(above)
    below.plot(time, balance.error, color="black", linewidth=1.0, label="error of the balance")
    dressed(below, "time [s]", "error [J]")
    _mark(below, simulation, named=False)
    least = ROUNDING * _largest(*courses.values(), balance.potential)
    low, high = below.get_ylim()
    below.set_ylim(min(low, -least), max(high, least))
    worst = n(_largest(balance.error), ".2g", "J", size=_largest(balance.potential))
    told = wrapped(f"the sum, supplied counted negative, less its start: at most {worst}", current().tick)
    below.set_title(told, fontsize=current().tick, loc="left")
    return figure


def _largest(*courses: Array) -> float:
    return max(float(np.nanmax(np.abs(course), initial=0.0)) for course in courses)


def _mark(ax: Axes, simulation: Simulation, *, named: bool) -> None:
    """A line at each event, with its name on top."""
    for event in simulation.events:
        ax.axvline(event.time, color=GAP_COLOR, linewidth=1.0, zorder=1.0)
        if named:
            what = event.kind if event.cable is None else f"{event.kind}, cable {event.cable}"
            ax.annotate(
                what, (event.time, 1.0), xycoords=("data", "axes fraction"), xytext=(0.0, 2.0),
                textcoords="offset points", fontsize=current().tick, ha="center", va="bottom", annotation_clip=False,
            )  # fmt: skip

"""Tensions and motion of a simulation over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sagline.core.arguments import instance
from sagline.dynamics.simulation.results import Simulation
from sagline.plot.labels import figure_legend, name_lines
from sagline.plot.sheet import (
    GAP_COLOR,
    VERMILLION,
    cable_look,
    draw_components,
    draw_series,
    format_clock,
    hide_shared_labels,
    mark_event,
    sheet,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN: Final = 0.5  # the limit is drawn if the largest tension exceeds this share of it


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
    figure = sheet(height=6.5)
    above, middle, below = figure.subplots(3, 1, sharex=True, height_ratios=(1.8, 1.0, 1.0))
    for cable, tension in enumerate(simulation.tensions.T):
        draw_series(above, time, tension, **cable_look(cable), linewidth=1.1, label=f"cable {cable}")
    limit = float(simulation.robot.tension_max.min())
    if float(np.nanmax(simulation.tensions)) > SHOWN * limit:
        above.axhline(limit, color=VERMILLION, linewidth=0.8, linestyle=":", label="tension_max")
    draw_components(middle, time, pose.position - pose.position[0])
    draw_components(below, time, np.degrees((pose.rotation * pose.rotation[0].inv()).as_rotvec()))
    labels = "tension [N]", "displacement [m]", "rotation [°]"
    for ax, label in zip((above, middle, below), labels, strict=True):
        format_clock(ax, time, label)
        hide_shared_labels(ax)
        for event in simulation.events:
            name = event.kind if event.cable is None else f"{event.kind}, cable {event.cable}"
            mark_event(ax, event.time, name if ax is above else "", GAP_COLOR, 1.0)
        if ax is not above:
            name_lines(ax)
    figure_legend(figure, [above])  # above the names of the events
    return figure

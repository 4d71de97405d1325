"""What is said of a cable that is to be cut, and of what follows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.numbers import n
from sagline.dynamics.simulation import Simulation
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.readout import box
from sagline.viewer.tension_scale import force_unit


class Peak(NamedTuple):
    """The highest tension after a cut.

    Attributes:
        cable: Whose.
        tension: How high, at the frame end [N].
        time: When, to a sample [s] after the cut.
        limit: Its highest allowed tension [N]; infinite where there is none.
    """

    cable: int
    tension: float
    time: float
    limit: float


def peak_of(simulation: Simulation, cut: int) -> Peak:
    """The highest tension of the cables that are left, at any step.

    Args:
        simulation: From the cut on.
        cut: Which is no more there.
    """
    highest = simulation.tensions.max(axis=0) if simulation.largest_tension is None else simulation.largest_tension
    left = np.where(np.arange(len(highest)) == cut, -np.inf, highest)
    cable = int(np.argmax(left))
    when = float(simulation.time[np.argmax(simulation.tensions[:, cable])] - simulation.time[0])
    return Peak(cable, float(highest[cable]), when, float(simulation.robot.tension_max[cable]))


def chosen(state: Equilibrium, cable: int) -> str:
    """What stands at a cable that is chosen."""
    unit = force_unit(state.one_robot)
    return f"cable {cable}: {unit.written(float(state.chord_tension[cable]))}"


def told(simulation: Simulation, cut: int, *, whole: bool) -> str:
    """What follows, as HTML: how far the platform swings, and which tension peaks.

    Args:
        simulation: From the cut on, as far as it is known.
        cut: Which cable is no more there.
        whole: Whether there is no more to come.
    """
    unit, peak = force_unit(simulation.robot), peak_of(simulation, cut)
    away = np.linalg.norm(simulation.pose.position - simulation.pose.position[0], axis=1)
    far = int(np.argmax(away))
    highest = f"{unit.written(peak.tension)} in cable {peak.cable} at {peak.time:.2f} s"
    rows = [("Farthest", f"{n(away[far], '.3g', 'm')} away at {simulation.time[far] - simulation.time[0]:.2f} s")]
    over = False
    if np.isfinite(peak.limit):
        over = peak.tension > peak.limit
        highest += f", {peak.tension / peak.limit:.2f} times its limit"
    rows.append(("Highest tension", highest))
    slack = sorted({event.cable for event in simulation.events if event.kind == "slack" and event.cable is not None})
    if slack:
        rows.append(("Slack", f"cable{'s' * (len(slack) > 1)} {', '.join(map(str, slack))}"))
    rows.append(("Losses", f"{n(simulation.damping.loss_time, '.2g', 's')} of the cables' stretch, assumed"))
    if not whole:
        rows.append(("So far", f"{simulation.time[-1] - simulation.time[0]:.2f} s; the rest is being simulated"))
    text = "".join(f"<dt>{name}</dt><dd>{what}</dd>" for name, what in rows)
    return box("bad" if over else "quiet", f"Cable {cut} is cut", f"<dl>{text}</dl>")

"""What the panel says of a moment of a simulation, as HTML."""

from __future__ import annotations

import numpy as np

from sagline.core.numbers import n
from sagline.dynamics.simulation import Occurrence
from sagline.viewer.moment import Moment
from sagline.viewer.readout import block, box, css_color, pose_line, sentence
from sagline.viewer.tension_scale import TensionScale, force_unit
from sagline.viewer.wording import ForceUnit, number

CABLES = {
    "none": "massless cables",
    "lumped": "cables with mass, as chains of nodes",
    "modal": "cables with mass, as their linear modes",
}


def verdict(moment: Moment) -> str:
    """What kind of simulation it is, the numbers of the moment, and what has happened."""
    simulation, unit = moment.simulation, force_unit(moment.robot)
    speed = float(np.linalg.norm(simulation.twist[moment.index, :3]))
    rows = [
        ("Cables", CABLES.get(simulation.cable_mass, simulation.cable_mass)),
        ("Time", f"{moment.time:.3f} s"),
        ("Speed", n(speed, ".3g", "m/s")),
        ("Tensions", f"{unit.bare(np.nanmin(moment.tension))} to {unit.written(np.nanmax(moment.tension))}"),
        ("Energy error", n(simulation.energy.error[moment.index], ".2g", "J", size=_size(moment))),
    ]
    rows += [("Event", happened(event, unit)) for event in moment.past]
    text = "".join(f"<dt>{name}</dt><dd>{what}</dd>" for name, what in rows)
    return box("quiet", "Simulated", f"<dl>{text}</dl>")


def numbers(moment: Moment, scale: TensionScale) -> str:
    """The pose, and tension and length of every cable."""
    unit, colors = force_unit(moment.robot), scale.colors(moment.tension)
    length = moment.simulation.length[moment.index]
    rows = "".join(
        f'<tr><td><span class="swatch" style="background:{css_color(colors[i])}"></span> {i}</td>'
        f"<td>{unit.bare(moment.tension[i])}</td><td>{number(length[i], '.4f')}</td></tr>"
        for i in range(moment.robot.cable_count)
    )
    head = f"<tr><th>cable</th><th>at the winch<br>[{unit.name}]</th><th>length<br>[m]</th></tr>"
    return block(f"{pose_line(moment.pose)}<table>{head}{rows}</table>")


def polygon() -> str:
    """Why there are no tensions to choose from."""
    return sentence("In motion nothing is chosen: tensions follow from lengths and from where the platform is.")


def happened(event: Occurrence, unit: ForceUnit) -> str:
    """An event in words."""
    what = event.kind if event.cable is None else f"{event.kind} of cable {event.cable}"
    before, after = unit.bare(event.tension_before), unit.written(event.tension_after)
    return f"{what} at {event.time:.3f} s: {before} before, then at most {after}"


def _size(moment: Moment) -> float:
    energy = moment.simulation.energy
    return float(np.nanmax(np.abs(energy.kinetic) + np.abs(energy.potential)))

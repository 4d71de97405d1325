"""What the panel says of a cycle of a log, as HTML."""

from __future__ import annotations

from html import escape

import numpy as np

from sagline.control.events import Event
from sagline.core.numbers import n
from sagline.viewer.readout import block, box, css_color, pose_line, sentence
from sagline.viewer.session import PER_METER, SessionMoment
from sagline.viewer.tension_scale import TensionScale, force_unit
from sagline.viewer.wording import number

MOST_EVENTS = 8  # that are told, the newest


def verdict(moment: SessionMoment) -> str:
    """The state, what the platform and the tensions are off, and what has happened."""
    session, k, unit = moment.session, moment.index, force_unit(moment.robot)
    rows = [("Time", f"{moment.time:.2f} s"), ("Cycle late", n(session.late[k], ".2g", "s"))]
    distances = {"Estimated": moment.rest, "True": moment.truth}
    if np.isfinite(session.planned[k]).all():
        for name, pose in distances.items():
            if pose is not None:
                away = PER_METER * float(np.linalg.norm(pose.position - session.planned[k]))
                rows.append((f"{name} less planned", n(away, ".3g", "mm")))
    if moment.rest is not None and moment.truth is not None:
        away = PER_METER * float(np.linalg.norm(moment.truth.position - moment.rest.position))
        rows.append(("True less estimated", n(away, ".3g", "mm")))
    tension = moment.tension
    if np.isfinite(tension).any():
        rows.append(("Tensions", f"{unit.bare(np.nanmin(tension))} to {unit.written(np.nanmax(tension))}"))
    rows += [(f"{event.time - session.began:.2f} s", f"{event.name}: {event.text}") for event in _told(moment)]
    text = "".join(f"<dt>{name}</dt><dd>{escape(what)}</dd>" for name, what in rows)
    return box("quiet" if moment.feasible else "bad", moment.state.name, f"<dl>{text}</dl>")


def numbers(moment: SessionMoment, scale: TensionScale) -> str:
    """The pose; tension, what it is off, and what the length is off, of every cable."""
    session, k, unit = moment.session, moment.index, force_unit(moment.robot)
    colors = scale.colors(moment.tension)
    off = moment.tension - session.planned_tension[k]
    lag = PER_METER * (session.set_length[k] - session.length[k])
    rows = "".join(
        f'<tr><td><span class="swatch" style="background:{css_color(colors[i])}"></span> {i}</td>'
        f"<td>{unit.bare(moment.tension[i])}</td><td>{number(off[i], '.1f')}</td><td>{number(lag[i], '.2f')}</td></tr>"
        for i in range(moment.robot.cable_count)
    )
    names = ("cable", f"tension<br>[{unit.name}]", "less planned<br>[N]", "set less read<br>[mm]")
    head = f"<tr>{''.join(f'<th>{name}</th>' for name in names)}</tr>"
    return block(f"{pose_line(moment.pose)}<table>{head}{rows}</table>")


def polygon() -> str:
    """Why there are no tensions to choose from."""
    return sentence("What a machine did is not chosen any more: its tensions are those that its load cells read.")


def _told(moment: SessionMoment) -> tuple[Event, ...]:
    return moment.past[-MOST_EVENTS:]

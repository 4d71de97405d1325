"""HTML of the panel: verdict, numbers, legend; its colors are in page.css."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from math import log
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.dynamics.vibration.vibration import MASSLESS
from sagline.kinematics.slanted import with_eyelets
from sagline.kinematics.status import PoseStatus
from sagline.robot.batch import pulley_radius
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.tension.margin import cable_margins, capacity_margin
from sagline.viewer.shapes import dead_runs
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import Color, Colors, ForceUnit, TensionScale, cables_text, number_text

EXACT: Final = 1e-9  # [m], smaller distances count as zero
COMPROMISE: Final = "<div><b>Closest compromise</b>: tensions within the limits; the missing force is unbalanced</div>"
_ALONE = 1e-9  # smaller distances from a limit, relative to the robot's highest tension, count as at the limit


def html_block(content: str) -> str:
    """HTML with the font and the colors of page.css."""
    return f'<div class="sagline">{content}</div>'


def sentence(text: str) -> str:
    """HTML of a sentence."""
    return f'<div class="sagline quiet">{text}</div>'


def chosen_by(topic: str, value: str | int) -> str:
    """Attributes of an HTML element that sends a value under a topic when it is clicked; see browser/choices.js."""
    return f'data-send="{topic}" data-value="{escape(str(value))}"'


def verdict(snapshot: Snapshot) -> str:
    """HTML of the verdict on feasibility in a colored box, with the reason if infeasible."""
    if snapshot.solved and snapshot.plan is not None:
        return verdict_box("good", "Feasible", _summary(snapshot.plan.state, snapshot.error))
    return verdict_box("bad", headline(snapshot), escape(snapshot.reason))


def headline(snapshot: Snapshot) -> str:
    """The verdict in one or two words; the status, if the pose is neither feasible nor proved infeasible."""
    if snapshot.solved:
        return "Feasible"
    if snapshot.status is PoseStatus.INFEASIBLE:
        return "Not feasible"
    return snapshot.status.name.replace("_", " ").capitalize()


def refused(message: str) -> str:
    """Box for an invalid setting."""
    return verdict_box("bad", "Not possible", escape(message))


def numbers_html(
    snapshot: Snapshot, scale: TensionScale, frequencies: Array | None, compromise: Equilibrium | None = None
) -> str:
    """The pose, the numbers of every cable, and the platform's natural frequencies."""
    # at an infeasible pose, `compromise` contains the tensions within the limits that are nearest to force balance
    state = compromise if compromise is not None else None if snapshot.plan is None else snapshot.plan.state
    parts = (
        pose_line(snapshot.pose),
        COMPROMISE if compromise is not None else "",
        _cable_numbers(snapshot.robot, state, scale),
        _listed(frequencies),
        _material_line(snapshot),
        _pulley_line(snapshot.robot),
    )
    return html_block("".join(parts))


def legend(scale: TensionScale, robot: Robot, ends: str = "") -> str:
    """Colors of the tensions, as a bar with round numbers below. `ends` names the bar's ends, by default the limits."""
    colors = ",".join(f"{css_color(color)} {100 * k / 11:.0f}%" for k, color in enumerate(scale.bar(12)))
    unit = ForceUnit.of(robot)
    marks = "".join(
        f'<span style="position:absolute;left:{100 * place:.1f}%;transform:translateX(-{100 * place:.0f}%)">'
        f"{float(f'{tick / unit.newtons:.4g}'):g}</span>"
        for tick, place in spaced_ticks(scale)
    )
    return html_block(
        f"<b>Chord tension [{unit.name}]</b>"
        f'<div style="height:12px;background:linear-gradient(to right,{colors});margin-top:3px"></div>'
        f'<div style="position:relative;height:17px">{marks}</div>'
        f'<div class="quiet">{ends or _ends(robot)}</div>'
    )


def verdict_box(kind: str, head: str, text: str) -> str:
    """A verdict in a box of the class `kind`: "good", "bad" or "quiet"."""
    return (
        f'<div class="sagline sagline-verdict {kind}"><h2>{head}</h2>'
        f'<div style="color:var(--sagline-text)">{text}</div></div>'
    )


def definitions(rows: Iterable[tuple[str, str]], kind: str = "") -> str:
    """HTML of a list of names and descriptions, optionally with a class of page.css."""
    start = f'<dl class="{kind}">' if kind else "<dl>"
    return start + "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in rows) + "</dl>"


def factor_slider(label: str, low: float, high: float, least: float, hint: str) -> str:
    """HTML of a logarithmic slider for a factor, and of a field for the factor's value; see browser/factors.js."""
    names = {least if mark == low else mark: log(mark / low) / log(high / low) for mark in sorted({low, 1.0, high})}
    marks = "".join(f'<span style="--at:{100.0 * place:.4g}%">{mark:g}</span>' for mark, place in names.items())
    return html_block(
        f'<div class="factor" data-factor="{label}" data-low="{low:g}" title="{hint}">'
        f"<span>{label.replace(' ×', '&nbsp;×')}</span><div>"
        f'<input type="range" min="0" max="1" step="0.01" value="{names[1.0]:.2f}" aria-label="{label}">'
        f'<div class="marks" aria-hidden="true">{marks}</div></div>'
        f'<input type="number" min="{least:g}" max="{high:g}" step="any" value="1" aria-label="{label}"></div>'
    )


def swatch(color: Array | Color) -> str:
    """HTML of a square of a color, before a name."""
    return f'<span class="swatch" style="background:{css_color(color)}"></span> '


def color_key(entries: Iterable[tuple[Array | Color, str]]) -> str:
    """HTML of a legend: colors and their meanings."""
    return "".join(f'<span class="key">{swatch(color)}{text}</span>' for color, text in entries)


def table_html(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """HTML of a table with a row of heads."""
    lines = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><tr>{''.join(f'<th>{head}</th>' for head in heads)}</tr>{lines}</table>"


def cable_table_html(heads: Iterable[str], columns: Sequence[Sequence[str]], colors: Array | Colors) -> str:
    """HTML of a table with one row per cable: its number with its color, and its text in each column."""
    texts = enumerate(zip(*columns, strict=True))
    return table_html(heads, ((f"{swatch(colors[i])}{i}", *row) for i, row in texts))


def spaced_ticks(scale: TensionScale) -> list[tuple[float, float]]:
    """Ticks and their positions, without ticks that would overlap the previous tick."""
    kept: list[tuple[float, float]] = []
    ticks = scale.ticks()
    for tick in ticks if len(ticks) > 1 else (scale.low, scale.high):
        place = float(scale.fraction(np.array(tick)))
        if not kept or place - kept[-1][1] > 0.11:
            kept.append((tick, place))
    return kept


def _summary(state: Equilibrium, error: Array | None) -> str:
    """Names and texts of the quantities of a feasible pose, whose confirmed pose has a position `error` (3,) [m]."""
    unit = ForceUnit.of(state.one_robot)
    rows = [("Tensions", unit.span(state.chord_tension)), ("Nearest limit", _nearest_limit(state, unit))]
    if is_underconstrained(state.one_robot):
        text = f"from the balance of {state.one_robot.cable_count} cables; only the position is given"
        rows.append(("Rotation", text))
    else:
        extra = unit.written(float(capacity_margin(with_eyelets(state))))
        rows.append(("Spare force", f"{extra} more in any direction, no moment; redistributed tensions"))
    if error is not None:
        away = float(np.linalg.norm(error))
        text = f"{n(away, unit='m')} from the planned pose" if away > EXACT else "at the planned pose"
        rows.append(("Equilibrium", text))
    return definitions(rows)


def _ends(robot: Robot) -> str:
    """Meaning of the two ends of the scale: limits, if the robot has limits."""
    low = "lowest allowed" if robot.tension_min.min() > 0.0 else "no lower limit"
    high = "highest allowed" if np.isfinite(robot.tension_max).all() else "no upper limit"
    return f"ends: {low}, {high}"


def _nearest_limit(state: Equilibrium, unit: ForceUnit) -> str:
    """Text of the tension nearest to its limit, with limit and distance, or text of all tensions at their limits."""
    margin, robot = cable_margins(state), state.one_robot
    reach = _ALONE * float(np.nanmax(np.where(np.isfinite(robot.tension_max), robot.tension_max, margin.max())))
    at = np.flatnonzero(margin <= reach)
    if len(at) > 1:
        return f"reached by {cables_text(at)}"
    nearest = int(np.argmin(margin))
    lower = margin[nearest] == state.limited_tension[nearest] - robot.tension_min[nearest]
    which = "lower limit" if lower else "upper limit"
    if len(at):
        return f"reached by cable {nearest} ({which})"
    return f"{unit.written(margin[nearest])} away (cable {nearest}, {which})"


def pose_line(pose: Pose) -> str:
    """Text of position and angles."""
    position = ", ".join(number_text(value, ".3f") for value in pose.position)
    turned = ", ".join(f"{number_text(value, '.1f')}°" for value in pose.rotation.as_euler("ZYX", degrees=True))
    return f"<b>Position</b> {position} m<br><b>α, β, γ</b> {turned}"


def _cable_numbers(robot: Robot, state: Equilibrium | None, scale: TensionScale) -> str:
    unit, unknown = ForceUnit.of(robot), np.full(robot.cable_count, np.nan)
    tension, winch, length, sag, margin = (
        (unknown,) * 5
        if state is None
        else (
            state.chord_tension, state.cables.frame_end_tension, state.unstrained_length, 1e3 * state.cables.sag,
            cable_margins(state),
        )
    )  # fmt: skip
    columns = {
        f"tension<br>[{unit.name}]": (tension / unit.newtons, unit.form),
        f"winch<br>[{unit.name}]": (winch / unit.newtons, unit.form),
        "length<br>[m]": (length, ".4f"),
        "sag<br>[mm]": (sag, ".1f"),
        f"to limit<br>[{unit.name}]": (margin / unit.newtons, unit.form),
    }
    radius, contact = pulley_radius(robot), None if state is None else state.contact
    if radius.any():
        angle = unknown if contact is None else np.degrees(contact.wrap_angle)
        columns["wrap<br>[°]"] = np.where(radius > 0.0, angle, np.nan), ".1f"
    texts = [[number_text(value, form) for value in values] for values, form in columns.values()]
    return cable_table_html(("cable", *columns), texts, scale.colors(tension))


def _pulley_line(robot: Robot) -> str:
    """Pulleys and dead lengths, with a remark if the path of a dead length is unknown."""
    winches = robot.winches
    if winches is None or not winches.anything_behind:
        return ""
    text = f'<div style="margin-top:2px"><b>Pulleys</b> radius {_span(winches.pulley_radius, "m")}'
    if winches.dead_cable.any():
        text += f", dead cable {_span(winches.dead_cable, 'm')}"
    if not dead_runs(robot)[1].all():
        text += ", drawn along the swivel axis; its path is not known"
    return text + "</div>"


def _listed(frequencies: Array | None) -> str:
    """Text of the natural frequencies [Hz]; a frequency with a mode is a button that animates this mode."""
    if frequencies is None or not np.isfinite(frequencies).any():
        return ""
    words = [number_text(frequency, ".2f") for frequency in frequencies]
    for k in np.flatnonzero(frequencies > 0.0):  # not NaN
        name, label = f"{MASSLESS} {k + 1}", f'aria-label="{words[k]} Hz: move mode {MASSLESS} {k + 1}"'
        words[k] = f'<button class="shake" {chosen_by("mode", name)} {label}>{words[k]}</button>'
    ends = [*[","] * (len(words) - 1), " Hz"]  # these characters stay on the line of the number
    text = " ".join(f'<span class="whole">{word}{end}</span>' for word, end in zip(words, ends, strict=True))
    return f'<div style="margin-top:4px"><b>Natural frequencies</b> {text}</div>'


def _material_line(snapshot: Snapshot) -> str:
    cables = snapshot.robot.cables
    density = _span(1e3 * cables.linear_density, "g/m")
    solved = f"<br><b>Solved with</b> {escape(snapshot.origin)}" if snapshot.origin else ""
    return f'<div style="margin-top:2px"><b>Cables</b> {density}, EA {_span(cables.axial_stiffness, "N")}{solved}</div>'


def _span(values: Array, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    return n(low, unit=unit) if low == high else f"{n(low, unit=unit)} to {n(high, unit=unit)}"


def css_color(color: Array | Color) -> str:
    """A color (3,) of 0 to 255 in CSS notation."""
    return "#{:02x}{:02x}{:02x}".format(*(int(part) for part in color))

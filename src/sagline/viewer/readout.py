"""What the panel says, as HTML: verdict, numbers, legend. Pure text, tested as such."""

from __future__ import annotations

from html import escape

import numpy as np

from sagline.arrays import Array
from sagline.tension.margin import capacity_margin
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale

GOOD, BAD = "#0b7a4b", "#c92a2a"  # green and red that hold their contrast on white
QUIET = "#555555"  # of what is neither good nor bad
FONT = "font-family:system-ui,sans-serif;font-size:12px;line-height:1.45;color:#222"
_CELL = "padding:1px 0 1px 10px;text-align:right;font-variant-numeric:tabular-nums"


def verdict(snapshot: Snapshot, *, capacity: bool = True) -> str:
    """Feasible or not, in one colored box; where not, why.

    Args:
        snapshot: What is shown.
        capacity: Whether the margin to any load can be computed already.
    """
    color = GOOD if snapshot.feasible else BAD
    head = "Feasible" if snapshot.feasible else "Not feasible"
    text = _summary(snapshot, capacity=capacity) if snapshot.feasible else escape(snapshot.reason)
    return (
        f'<div style="{FONT};border-left:5px solid {color};background:{color}14;padding:6px 10px;margin:2px 8px">'
        f'<b style="color:{color};font-size:14px">{head}</b><br>{text}</div>'
    )


def refused(message: str) -> str:
    """What a setting asked for and cannot have."""
    return (
        f'<div style="{FONT};border-left:5px solid {BAD};background:{BAD}14;padding:6px 10px;margin:2px 8px">'
        f'<b style="color:{BAD};font-size:14px">Not possible</b><br>{escape(message)}</div>'
    )


def waiting(what: str = "The first run on a machine compiles the numerical core; later ones start at once.") -> str:
    """What stands there until the numbers do: at the first run the numerical core is compiled before them."""
    return (
        f'<div style="{FONT};border-left:5px solid {QUIET};background:{QUIET}14;padding:6px 10px;margin:2px 8px">'
        f'<b style="color:{QUIET};font-size:14px">Getting ready</b><br>'
        f"{escape(what)}</div>"
    )


def numbers(
    snapshot: Snapshot, scale: TensionScale, frequencies: Array | None, *, frequencies_later: bool = False
) -> str:
    """The pose, the numbers of every cable, and the platform's natural frequencies, or that they come later."""
    parts = (
        _pose_line(snapshot),
        _cable_table(snapshot, scale),
        _frequencies_later() if frequencies_later else _frequency_line(frequencies),
        _material_line(snapshot),
    )
    return f'<div style="{FONT};padding:2px 14px">{"".join(parts)}</div>'


def legend(scale: TensionScale) -> str:
    """The colors of the tensions, as a bar with round numbers below."""
    stops = np.linspace(0.0, 1.0, 12)
    values = scale.low * (scale.high / scale.low) ** stops
    colors = ",".join(
        f"{_hex(color)} {100 * stop:.0f}%" for stop, color in zip(stops, scale.colors(values), strict=True)
    )
    marks = "".join(
        f'<span style="position:absolute;left:{100 * place:.1f}%;transform:translateX(-50%)">{_short(tick)}</span>'
        for tick, place in _spaced(scale)
    )
    return (
        f'<div style="{FONT};padding:2px 14px 4px 14px"><b>Chord tension [N]</b>'
        f'<div style="height:12px;background:linear-gradient(to right,{colors});margin-top:3px"></div>'
        f'<div style="position:relative;height:17px">{marks}</div>'
        f'<div style="color:#666">ends: the lowest and highest allowed</div></div>'
    )


def _spaced(scale: TensionScale) -> list[tuple[float, float]]:
    """The ticks and their places, without those that would run into the one before."""
    kept: list[tuple[float, float]] = []
    for tick in scale.ticks():
        place = float(scale.share(np.array(tick)))
        if not kept or place - kept[-1][1] > 0.11:
            kept.append((tick, place))
    return kept


def _summary(snapshot: Snapshot, *, capacity: bool) -> str:
    tension, margin = snapshot.tension, snapshot.margin
    nearest = int(np.argmin(margin))
    parts = [
        f"tensions {tension.min():.4g} to {tension.max():.4g} N",
        f"margin {_number(margin[nearest], '.1f')} N (cable {nearest})",
    ]
    if snapshot.plan is not None and not capacity:
        parts.append("margin in any direction: compiling …")
    elif snapshot.plan is not None:
        extra = float(capacity_margin(snapshot.plan.state))
        parts.append(f"takes {_number(extra, '.1f')} N more in any direction")
    if (error := snapshot.error) is not None:
        parts.append(f"really rests {1e3 * float(np.linalg.norm(error)):.3g} mm off")
    return " · ".join(parts)


def _pose_line(snapshot: Snapshot) -> str:
    position = ", ".join(f"{value:.3f}" for value in snapshot.pose.position)
    turned = ", ".join(f"{value:.1f}°" for value in snapshot.pose.rotation.as_euler("ZYX", degrees=True))
    return f"<b>Position</b> {position} m<br><b>α, β, γ</b> {turned}"


def _cable_table(snapshot: Snapshot, scale: TensionScale) -> str:
    heads = ("cable", "tension<br>[N]", "winch<br>[N]", "length<br>[m]", "sag<br>[mm]", "margin<br>[N]")
    head = "".join(f'<th style="{_CELL};font-weight:600;color:#555">{text}</th>' for text in heads)
    cables = None if snapshot.plan is None else snapshot.plan.state.cables
    count = snapshot.robot.cable_count
    unknown = np.full(count, np.nan)
    columns = (
        (snapshot.tension, ".1f"),
        (unknown if cables is None else cables.frame_end_tension, ".1f"),
        (unknown if cables is None else cables.unstrained_length, ".4f"),
        (unknown if cables is None else 1e3 * cables.sag, ".1f"),
        (snapshot.margin, ".1f"),
    )
    colors = scale.colors(snapshot.tension)
    rows = "".join(
        f'<tr><td style="{_CELL}"><span style="color:{_hex(colors[i])}">■</span> {i}</td>'
        + "".join(f'<td style="{_CELL}">{_number(values[i], form)}</td>' for values, form in columns)
        + "</tr>"
        for i in range(count)
    )
    return f'<table style="border-collapse:collapse;width:100%;margin-top:4px"><tr>{head}</tr>{rows}</table>'


def _frequency_line(frequencies: Array | None) -> str:
    if frequencies is None or not np.isfinite(frequencies).any():
        return ""
    listed = ", ".join(_number(value, ".2f") for value in frequencies)
    return f'<div style="margin-top:4px"><b>Natural frequencies</b> {listed} Hz</div>'


def _frequencies_later() -> str:
    return '<div style="margin-top:4px"><b>Natural frequencies</b> compiling …</div>'


def _material_line(snapshot: Snapshot) -> str:
    cables = snapshot.robot.cables
    density = _span(1e3 * cables.linear_density, "g/m")
    stiffness = _span(1e-3 * cables.axial_stiffness, "kN")
    solved = f"<br><b>Solved with</b> {snapshot.origin}" if snapshot.origin else ""
    return f'<div style="margin-top:2px"><b>Cables</b> {density}, EA {stiffness}{solved}</div>'


def _span(values: Array, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g} {unit}" if low == high else f"{low:.4g} to {high:.4g} {unit}"


def _number(value: float, form: str) -> str:
    """A number, or a dash for none; what rounds to zero has no sign."""
    if not np.isfinite(value):
        return "–"
    text = f"{value:{form}}"
    return text if float(text) != 0.0 else text.removeprefix("-")


def _short(value: float) -> str:
    return f"{value / 1000:g}k" if value >= 1000.0 else f"{value:g}"


def _hex(color: Array) -> str:
    return "#{:02x}{:02x}{:02x}".format(*(int(part) for part in color))

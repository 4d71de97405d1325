"""Colors and text of a calibration."""

from __future__ import annotations

from html import escape
from typing import Final

import numpy as np

from sagline.calibration.findings import CalibrationStatus, Direction
from sagline.calibration.least_squares import exceeded_with
from sagline.calibration.log import reading_deviations
from sagline.calibration.result import Calibration
from sagline.calibration.summary import chi_squared_text, outlier_text
from sagline.core.arrays import Array, Indices
from sagline.core.numbers import counted, n
from sagline.viewer.channel import chosen_by
from sagline.viewer.readout import block, box, css_color, sentence
from sagline.viewer.stage import INFEASIBLE, PLATFORM, REST
from sagline.viewer.tension_scale import Colors

QUANTILES: Final = (0.95, 0.999)  # of chi squared, between the colors
COLORS: Final = np.array([PLATFORM, REST, INFEASIBLE], dtype=np.uint8)
NAMES: Final = ("as expected", "one in 20", "one in 1,000")


def freedoms(found: Calibration) -> Indices:
    """Readings of each pose beyond those that its lengths take, shape (N,), >= 1."""
    read = np.isfinite(found.residuals).sum(axis=1) - found.robot.cable_count
    return np.asarray(np.maximum(read, 1)).astype(np.int64)


def bands(found: Calibration) -> Indices:
    """The color of each pose, 0 for what is expected, shape (N,)."""
    limits = exceeded_with(1.0 - np.array(QUANTILES)[:, None], freedoms(found))
    return np.asarray((found.chi_squared_of_pose > limits).sum(axis=0)).astype(np.int64)


def colors(found: Calibration) -> Colors:
    """Red, green and blue of each pose, shape (N, 3)."""
    return np.asarray(COLORS[bands(found)])


def key(counts: Indices) -> str:
    """HTML that says which color is which, and how many poses have it."""
    marks = "".join(
        f'<span class="key"><span class="swatch" style="background:{css_color(color)}"></span> {name}: {count}</span>'
        for color, name, count in zip(COLORS, NAMES, counts, strict=True)
    )
    return block(f"<b>Chi squared of the poses</b><br>{marks}")


MOST_LISTED = 12  # outliers


def verdict(found: Calibration) -> str:
    """How it ended, in a box."""
    kind = "good" if found.status is CalibrationStatus.FOUND else "bad"
    head = {CalibrationStatus.FOUND: "Calibrated", CalibrationStatus.DOUBTFUL: "Doubtful"}.get(
        found.status, "Not converged"
    )
    text = "" if kind == "good" else f"{escape(found.status.text)}<br>"
    of = f"{len(found.values)} numbers from {counted(len(found.rows), 'pose')}"
    out = (f"<br>{counted(len(rows), 'row')} left out: {escape(why.text)}" for why, rows in found.left_out.items())
    return box(kind, head, f"{text}{of}; {escape(chi_squared_text(found))}{''.join(out)}")


def kinds(found: Calibration) -> str:
    """Each kind of number: how far it has moved, and how well it is known, as root mean squares."""
    numbers, rows = found.parameters, ""
    for name, unit in dict.fromkeys(zip(numbers.names, numbers.units, strict=True)):
        mine = (np.array(numbers.names) == name) & (np.array(numbers.units) == unit)
        moved, error = found.values[mine] - numbers.prior[mine], found.standard_error[mine]
        cells = (n(_mean(each), ".2g", unit) for each in (moved, error, numbers.prior_deviation[mine]))
        title = name.replace("_", " ")
        rows += f"<tr><td>{title}</td>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
    head = "<tr><th></th><th>moved</th><th>error now</th><th>before</th></tr>"
    open_ways = "".join(f"<li>{_way(one)}</li>" for one in (*found.gauge, *found.cannot_tell_apart))
    told = f"<b>Left open, or hardly told</b><ul>{open_ways}</ul>" if open_ways else ""
    return block(f"<table>{head}{rows}</table>{told}")


def magnified(factor: float, *, relative: bool) -> str:
    """What the ellipsoids are."""
    but = ", but for what moves all anchors together" if relative else ""
    return sentence(f"Ellipsoids: one standard error{but}, drawn {factor:g} times as large; lines: from where it was.")


def outliers(found: Calibration, chosen: int | None) -> str:
    """What does not fit, each to be clicked."""
    if not found.outliers:
        return sentence("No outliers.")
    rows = "".join(
        f'<tr {chosen_by("row", one.row)} class="{"chosen" if one.row == chosen else ""}"><td>'
        f"<button {chosen_by('row', one.row)}>{escape(outlier_text(one))}</button></td></tr>"
        for one in found.outliers[:MOST_LISTED]
    )
    rest = len(found.outliers) - MOST_LISTED
    more = f'<div class="quiet">and {rest:,} more</div>' if rest > 0 else ""
    return block(f'<b>What does not fit</b><div class="rows"><table>{rows}</table></div>{more}')


def pose(found: Calibration, number: int) -> str:
    """The residuals at a pose, beside their sensors' standard deviations."""
    m, row = found.robot.cable_count, found.residuals[number]
    spread = reading_deviations(found.sensors, found.robot.cable_count)
    lines = "".join(
        f"<tr><td>{k}</td>{_cell(row[k], spread[k], 'm')}{_cell(row[m + k], spread[m + k], 'N')}</tr>" for k in range(m)
    )
    cables = f"<table><tr><th>cable</th><th>length</th><th></th><th>load cell</th><th></th></tr>{lines}</table>"
    places = "".join(
        f"<tr><td>{name}</td>{_cell(row[2 * m + axis], spread[2 * m + axis], unit)}</tr>"
        for axis, (name, unit) in enumerate([(x, "m") for x in "xyz"] + [(f"about {x}", "rad") for x in "xyz"])
        if np.isfinite(row[2 * m + axis])
    )
    measured = f"<table><tr><th>position</th><th>residual</th><th></th></tr>{places}</table>" if places else ""
    weight = f", counts {n(found.weights[number], '.2g')}" if found.weights[number] < 1.0 else ""
    fit = f"chi squared {n(found.chi_squared_of_pose[number], '.3g')}, expected {freedoms(found)[number]}{weight}"
    return block(f"<b>Row {found.rows[number]}</b>: {fit}{cables}{measured}")


def _cell(residual: float, deviation: float, unit: str) -> str:
    """A residual, and what it is in standard deviations."""
    if not np.isfinite(residual):
        return "<td>–</td><td></td>"
    times = residual / deviation
    wrong = ' style="color:var(--sagline-bad)"' if abs(times) > 3.0 else ""
    return f"<td>{n(residual, '.2g', unit)}</td><td{wrong}>{n(times, '.1f')} σ</td>"


def _way(one: Direction) -> str:
    """A direction, and what is left of its prior where something is told."""
    left = f", {100.0 * one.known:.0f} % of the error before" if one.known < 0.995 else ""
    return f"{escape(one.name.replace('_', ' '))}{left}"


def _mean(values: Array) -> float:
    """Root of the mean square; NaN for what is infinite."""
    return float(np.sqrt(np.mean(values**2))) if np.isfinite(values).all() else float("nan")

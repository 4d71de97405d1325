"""The platform's answer to a force over frequency as a drawing (SVG), with cable mass and massless."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor, log10

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.mode_list import ListedMode
from sagline.dynamics.response_curves import ResponseCurves
from sagline.viewer.channel import chosen_by
from sagline.viewer.readout import block

Place = Callable[[Array], Array]

WIDTH, HEIGHT = 340, 210  # px
LEFT, RIGHT, TOP, BOTTOM = 36, 10, 28, 36  # px around the axes
HIGHEST, LOWEST = 2e2, 1e-3  # over the answer at rest: undamped peaks have no top, and zeros no bottom
MARK = 12  # px, of a mode's mark


def response_figure(curves: ResponseCurves, modes: list[ListedMode], words: str, chosen: str) -> str:
    """HTML: both curves on logarithmic axes, a mark for every mode with cable mass, which can be clicked.

    Args:
        curves: What to draw.
        modes: As they are listed.
        words: What the curves are of, with their unit.
        chosen: Name of the mode that moves, "" for none.
    """
    low = max(min(curves.with_mass.min(), curves.massless.min()), LOWEST * curves.static)
    high = min(max(curves.with_mass.max(), curves.massless.max()), HIGHEST * curves.static)
    decades = 10.0 ** floor(log10(low)), 10.0 ** ceil(log10(high))
    first, last = float(curves.frequency[0]), float(curves.frequency[-1])

    def across(frequency: Array) -> Array:
        return np.asarray(LEFT + (WIDTH - LEFT - RIGHT) * np.log(frequency / first) / np.log(last / first))

    def up(value: Array) -> Array:
        share = np.log(np.clip(value, *decades) / decades[0]) / np.log(decades[1] / decades[0])
        return np.asarray(HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share)

    lines = "".join(
        f'<polyline class="{name}" points="{_points(across(curves.frequency), up(values))}"/>'
        for name, values in (("massless", curves.massless), ("massive", curves.with_mass))
    )
    foot = HEIGHT - BOTTOM
    marks = "".join(
        f'<g class="mark{" chosen" if mode.name == chosen else ""}" {chosen_by("mode", mode.name)}>'
        f'<rect x="{x - 3.0:.1f}" y="{foot - MARK}" width="6" height="{MARK + 2}"/>'
        f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{foot}" y2="{foot - 2 - (MARK - 2) * mode.platform_share:.1f}"/></g>'
        for mode, x in zip(modes, across(np.array([each.frequency for each in modes])), strict=True)
    )
    axes = _axes(words, across, up, decades, first, last)
    key = (
        '<span class="key"><span class="stroke massive"></span> with cable mass</span>'
        '<span class="key"><span class="stroke massless"></span> massless</span>'
    )
    return block(f'<svg class="response" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">{axes}{lines}{marks}</svg>{key}')


def _points(x: Array, y: Array) -> str:
    """Points of a line, those that a screen shows as one left out."""
    cells = np.round(np.stack((2.0 * x, 2.0 * y)))
    kept = np.concatenate(([True], np.any(np.diff(cells, axis=1) != 0.0, axis=0)))
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[kept], y[kept], strict=True))


def _axes(words: str, across: Place, up: Place, decades: tuple[float, float], first: float, last: float) -> str:
    marks = [f'<text x="4" y="12" font-weight="600">{words}</text>']
    for power in range(round(log10(decades[0])), round(log10(decades[1])) + 1):
        y = float(up(np.array(10.0**power)))
        marks.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        marks.append(
            f'<text class="quiet" x="{LEFT - 4}" y="{y + 3.5:.1f}" text-anchor="end">10'
            f'<tspan dy="-4" font-size="8">{str(power).replace("-", "−")}</tspan></text>'
        )
    ticks = [k * 10.0**p for p in range(floor(log10(first)), ceil(log10(last)) + 1) for k in (1, 2, 5)]
    ticks = [tick for tick in ticks if first <= tick <= last * (1.0 + 1e-9)]
    for tick in ticks:
        x = float(across(np.array(tick)))
        marks.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
        marks.append(f'<text class="quiet" x="{x:.1f}" y="{HEIGHT - BOTTOM + 13}" text-anchor="middle">{tick:g}</text>')
    middle = 0.5 * (LEFT + WIDTH - RIGHT)
    marks.append(f'<text class="quiet" x="{middle}" y="{HEIGHT - 8}" text-anchor="middle">frequency [Hz]</text>')
    return "".join(marks)

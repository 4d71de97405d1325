"""Tensions or lengths of a run over time as a drawing (SVG), with a cursor at the sample that is shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.arrays import Array
from sagline.viewer.readout import FONT

WIDTH, HEIGHT = 340, 150  # px
LEFT, RIGHT, TOP, BOTTOM = 44, 8, 18, 24  # px around the axes
SAMPLES = 240  # of each line: more would not show
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#666666", "#8B5A2B")
_DASHES = ("", "4 2")  # lines beyond the colors are dashed


@dataclass(frozen=True, slots=True, eq=False)
class CourseFigure:
    """The drawing, ready but for its cursor.

    Attributes:
        background: Everything that stays.
        duration: Time of the last sample [s].
    """

    background: str
    duration: float

    @classmethod
    def of(cls, title: str, time: Array, values: Array) -> CourseFigure:
        """Draw the lines of values (N, m) over time (N,) [s]; gaps where they are NaN."""
        rows = np.unique(np.linspace(0, len(time) - 1, SAMPLES).astype(np.intp))
        time, values = time[rows], values[rows]
        low, high = _range(values)
        x = LEFT + (WIDTH - LEFT - RIGHT) * time / max(float(time[-1]), 1e-12)
        y = HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (values - low) / (high - low)
        lines = "".join(_line(x, y[:, i], i) for i in range(values.shape[1]))
        axes = _axes(title, low, high, float(time[-1]))
        return cls(axes + lines, float(time[-1]))

    @staticmethod
    def key(count: int) -> str:
        """HTML that says which line is which cable."""
        marks = " ".join(
            f'<span style="color:{COLORS[i % len(COLORS)]}">{"━" if i < len(COLORS) else "┅"}</span>{i}'
            for i in range(count)
        )
        return f'<div style="{FONT};padding:0 8px">cable &nbsp;{marks}</div>'

    def at(self, time: float) -> str:
        """HTML with the cursor at a time [s]."""
        x = LEFT + (WIDTH - LEFT - RIGHT) * time / max(self.duration, 1e-12)
        cursor = f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="#111" stroke-width="1.2"/>'
        return (
            f'<svg width="100%" viewBox="0 0 {WIDTH} {HEIGHT}" style="{FONT};font-size:10px">'
            f"{self.background}{cursor}</svg>"
        )


def _range(values: Array) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if not known.size:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    spread = max(high - low, 1e-6 * max(abs(high), 1.0))
    return low - 0.04 * spread, high + 0.04 * spread


def _line(x: Array, y: Array, which: int) -> str:
    style = f'fill="none" stroke="{COLORS[which % len(COLORS)]}" stroke-width="1.3"'
    style += f' stroke-dasharray="{_DASHES[which // len(COLORS) % 2]}"'
    known = np.isfinite(y)
    pieces = np.split(np.arange(len(x)), np.flatnonzero(np.diff(known)) + 1)
    return "".join(
        f'<polyline points="{" ".join(f"{x[i]:.0f},{y[i]:.1f}" for i in piece)}" {style}/>'
        for piece in pieces
        if known[piece[0]]
    )


def _axes(title: str, low: float, high: float, duration: float) -> str:
    marks = [f'<text x="4" y="12" font-weight="600" fill="#333">{title}</text>']
    for share in (0.0, 0.5, 1.0):
        y = HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)
        x = LEFT + share * (WIDTH - LEFT - RIGHT)
        marks.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y}" y2="{y}" stroke="#ddd"/>')
        label = f"{low + share * (high - low):.4g}"
        marks.append(f'<text x="{LEFT - 4}" y="{y + 3.5}" text-anchor="end" fill="#555">{label}</text>')
        anchor = ("start", "middle", "end")[round(2 * share)]
        marks.append(
            f'<text x="{x}" y="{HEIGHT - 8}" text-anchor="{anchor}" fill="#555">{share * duration:.3g} s</text>'
        )
    return "".join(marks)

"""Tensions or lengths of a run over time as a drawing (SVG), with a cursor at the sample that is shown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np

from sagline.arrays import Array
from sagline.viewer.readout import block
from sagline.viewer.wording import number

WIDTH, HEIGHT = 340, 160  # px
LEFT, RIGHT, TOP, BOTTOM = 44, 10, 20, 24  # px around the axes
SAMPLES = 240  # of each line: more would not show
MOST_TICKS = 6
# Cables by number, here and nowhere else: no color of the platform, of its path, of a tension or of a verdict.
# Each holds 3 : 1 on the panels of both themes.
COLORS = ("#0e9384", "#8a8a12", "#9a6f52", "#1897b8", "#5e9a3c", "#7d8794")
_DASHES = ("", "4 2")  # lines beyond the colors are dashed
_NEAR = 0.6  # of the values' spread: a limit within this of them is drawn, one farther away is told


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit to draw beside the values.

    Attributes:
        value: Where it is.
        name: What it is.
    """

    value: float
    name: str


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
    def of(cls, title: str, time: Array, values: Array, limits: tuple[Limit, ...] = ()) -> CourseFigure:
        """Draw the lines of values (N, m) over time (N,) [s], which begins at 0; gaps where they are NaN."""
        rows = np.unique(np.linspace(0, len(time) - 1, SAMPLES).astype(np.intp))
        time, values = time[rows], values[rows]
        low, high, drawn = _range(values, limits)
        x = _across(time, float(time[-1]))
        y = _up(values, low, high)
        lines = "".join(_line(x, y[:, i], i) for i in range(values.shape[1]))
        told = _told([limit for limit in limits if limit not in drawn])
        marks = "".join(_limit(limit, float(_up(np.array(limit.value), low, high))) for limit in drawn)
        return cls(_axes(title, low, high, float(time[-1])) + told + lines + marks, float(time[-1]))

    @staticmethod
    def key(names: Iterable[object], what: str = "cable") -> str:
        """HTML that says which line is which."""
        marks = "".join(
            f'<span class="key"><span class="stroke" style="border-color:{COLORS[i % len(COLORS)]};'
            f'border-top-style:{"solid" if i < len(COLORS) else "dashed"}"></span> {name}</span>'
            for i, name in enumerate(names)
        )
        return block(f"{what} &nbsp;{marks}")

    def at(self, time: float) -> str:
        """HTML with the cursor at a time [s]."""
        x = float(_across(np.array(time), self.duration))
        cursor = f'<line class="cursor" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>'
        return block(f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img">{self.background}{cursor}</svg>')


def round_ticks(low: float, high: float, most: int = MOST_TICKS) -> list[float]:
    """One, two or five times a power of ten apart, at most so many, all that there are from low to high."""
    coarse = (high - low) / most
    power = 10.0 ** floor(log10(coarse))
    step = next(times * power for times in (1.0, 2.0, 5.0, 10.0) if times * power >= coarse * (1.0 - 1e-9))
    return [step * k for k in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]


def _across(time: Array, duration: float) -> Array:
    return np.asarray(LEFT + (WIDTH - LEFT - RIGHT) * time / max(duration, 1e-12))


def _up(values: Array, low: float, high: float) -> Array:
    return np.asarray(HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (values - low) / (high - low))


def _range(values: Array, limits: tuple[Limit, ...]) -> tuple[float, float, list[Limit]]:
    """Lowest and highest value of the axis, and the limits that lie on it."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    spread = max(high - low, 1e-6 * max(abs(high), 1.0))
    near = [limit for limit in limits if low - _NEAR * spread <= limit.value <= high + _NEAR * spread]
    low, high = min([low, *(limit.value for limit in near)]), max([high, *(limit.value for limit in near)])
    return low - 0.04 * spread, high + 0.04 * spread, near


def _line(x: Array, y: Array, which: int) -> str:
    style = f'fill="none" stroke="{COLORS[which % len(COLORS)]}" stroke-width="1.5"'
    style += f' stroke-dasharray="{_DASHES[which // len(COLORS) % 2]}"'
    known = np.isfinite(y)
    pieces = np.split(np.arange(len(x)), np.flatnonzero(np.diff(known)) + 1)
    return "".join(
        f'<polyline points="{" ".join(f"{x[i]:.0f},{y[i]:.1f}" for i in piece)}" {style}/>'
        for piece in pieces
        if known[piece[0]]
    )


def _limit(limit: Limit, y: float) -> str:
    return (
        f'<line class="limit" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>'
        f'<text class="limit" x="{WIDTH - RIGHT}" y="{y - 3.0:.1f}" text-anchor="end">{limit.name}</text>'
    )


def _told(limits: list[Limit]) -> str:
    """The limits that lie beyond the axis, in words."""
    text = ", ".join(f"{limit.name} {limit.value:g}" for limit in limits)
    return f'<text class="quiet" x="{WIDTH - RIGHT}" y="12" text-anchor="end">{text}</text>' if text else ""


def _axes(title: str, low: float, high: float, duration: float) -> str:
    marks = [f'<text x="4" y="12" font-weight="600">{title}</text>']
    ticks = round_ticks(low, high)
    form = f".{max(0, -floor(log10(ticks[1] - ticks[0]) + 1e-9))}f"
    for value in ticks:
        y = float(_up(np.array(value), low, high))
        marks.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        marks.append(
            f'<text class="quiet" x="{LEFT - 4}" y="{y + 3.5:.1f}" text-anchor="end">{number(value, form)}</text>'
        )
    seconds = round_ticks(0.0, max(duration, 1e-12))
    for moment in seconds:
        x = float(_across(np.array(moment), duration))
        unit = " s" if moment == seconds[-1] else ""
        marks.append(f'<text class="quiet" x="{x:.1f}" y="{HEIGHT - 8}" text-anchor="middle">{moment:.6g}{unit}</text>')
    return "".join(marks)

"""Charts, marks and spans of the timeline, and the message with their columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final, TypeAlias

import numpy as np

from sagline.core.arguments import true_runs
from sagline.core.arrays import Array, Flags
from sagline.robot.robot import Robot
from sagline.viewer.tension_scale import ForceUnit, cables_text

# Colors of cables by number in charts, different from those of the platform, its path, tensions and verdicts. Their
# contrast is 3 : 1 on the panels of both themes.
COLORS: Final = ("#0e9384", "#8a8a12", "#9a6f52", "#1897b8", "#5e9a3c", "#7d8794")  # further lines are dashed
_ENDS: Final = {"chord": "the chord", "frame_end": "the frame end"}


# in the form of the message to browser/timeline.js
ChartLimit: TypeAlias = tuple[float, str, bool]  # value in the unit of the chart, name, True for an upper limit
Span: TypeAlias = tuple[float, float, str]  # start and end [s] and reason: infeasible, a violated limit, a fault
TimelineMark: TypeAlias = tuple[float, str, bool]  # time of an event [s], text, True for a fault or a failure
# columns of a chart: starts [s] (C,), smallest and largest value of each line (C, k), NaN for missing values
Columns: TypeAlias = tuple[Array, Array, Array]


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """A quantity of each cable or along each axis over time."""

    title: str
    unit: str
    decimals: int  # number of decimals
    names: tuple[str, ...]  # names of the lines: numbers of cables, or axes
    # function that returns the values of given samples, shape (n, k); NaN for missing values
    values: Callable[[slice], Array]
    limits: tuple[ChartLimit, ...] = ()  # limits of the values

    @classmethod
    def of_tensions(cls, title: str, robot: Robot, tension: Array, at: str = "frame_end") -> Chart:
        """Chart of tensions (N, m) [N] of the part `at` of the cables, with the tightest limits of all cables."""
        unit, low, high = ForceUnit.of(robot), float(robot.tension_min.max()), float(robot.tension_max.min())
        other = "" if at == robot.tension_limits_of else f", of {_ENDS[robot.tension_limits_of]}"
        lower = ((low / unit.newtons, f"lowest allowed{other}", False),) if low > 0.0 else ()
        upper = ((high / unit.newtons, f"highest allowed{other}", True),) if isfinite(high) else ()
        names = tuple(map(str, range(robot.cable_count)))
        return cls(title, unit.name, unit.decimals, names, lambda rows: tension[rows] / unit.newtons, lower + upper)

    @property
    def of_cables(self) -> bool:
        """True if the lines of the chart are cables."""
        return self.names[0] == "0"


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Charts, spans and marks of a played motion."""

    time: Array  # times of the samples [s], starting at 0, shape (N,)
    charts: tuple[Chart, ...]  # charts, tensions first
    spans: tuple[Span, ...] = ()  # spans, in order
    marks: tuple[TimelineMark, ...] = ()  # marks, in order
    # names and colors of the drawn paths in the scene
    paths: tuple[tuple[str, tuple[int, int, int]], ...] = ()

    def within(self, start: float, end: float) -> slice:
        """The samples between two times [s], and one sample before and after them."""
        first, stop = np.searchsorted(self.time, [start, end])
        return slice(max(int(first) - 1, 0), int(stop) + 1)

    def step_from(self, time: float, steps: int) -> float:
        """Time of a sample [s]: `steps` samples after the sample at `time`."""
        now = int(np.searchsorted(self.time, time, side="right")) - 1
        return float(self.time[min(max(now + steps, 0), self.time.size - 1)])


MOST_SPANS: Final = 400  # largest number of spans on a timeline; close ones are joined


def spans_of(time: Array, wrong: Flags, why: Callable[[slice], str]) -> tuple[Span, ...]:
    """Spans of consecutive samples with the flag `wrong`. A sample lasts until the next sample."""
    edges = true_runs(wrong)
    if not edges.size:
        return ()
    until = np.minimum(edges[:, 1], time.size - 1)
    apart = time[edges[1:, 0]] - time[until[:-1]] > (time[-1] - time[0]) / MOST_SPANS
    first = edges[np.concatenate(([True], apart)), 0]
    end = edges[np.concatenate((apart, [True])), 1]
    return tuple(
        (float(time[a]), float(time[min(b, time.size - 1)]), why(slice(int(a), int(b))))
        for a, b in zip(first, end, strict=True)
    )


def limit_violations(robot: Robot, time: Array, tension: Array) -> tuple[Span, ...]:
    """Spans in which a tension at the winch, shape (N, m) [N], is not within its limits."""
    unit, below = ForceUnit.of(robot), np.asarray(tension < robot.tension_min)  # NaN is neither above nor below a limit
    above = np.asarray(tension > robot.tension_max)

    def why(rows: slice) -> str:
        parts = []
        for which, word, limits, worst in (
            (below[rows], "below", robot.tension_min, np.fmin),
            (above[rows], "above", robot.tension_max, np.fmax),
        ):
            cables = np.flatnonzero(which.any(axis=0))
            if cables.size:
                reached = float(worst.reduce(tension[rows][:, cables], axis=None))
                limit = unit.written(float(limits[cables[0]]))
                parts.append(f"{cables_text(cables)} {word} {limit}: {unit.written(reached)} at the winch")
        return "; ".join(parts)

    return spans_of(time, np.asarray((below | above).any(axis=1)), why)


MOST_COLUMNS: Final = 1500  # largest number of columns
MOST_MARKS: Final = 300
_NEAR: Final = 0.6  # limits within this distance, relative to the spread of values, are drawn; others are written
_BORDER: Final = 0.05  # margins above and below, relative to the spread


def columns(time: Array, values: Array, most: int = MOST_COLUMNS) -> Columns:
    """At most `most` columns with equal numbers of samples; the samples have `time` (N,) and `values` (N, k)."""
    if time.size <= most:
        return time, values, values
    starts = (np.arange(most) * time.size) // most
    # extreme values of the samples from each start to the next one
    lines = [np.ascontiguousarray(line) for line in values.T]
    low, high = (np.stack([which.reduceat(line, starts) for line in lines], axis=1) for which in (np.fmin, np.fmax))
    return time[starts], low, high


def timeline_message(
    tracks: Sequence[tuple[str, Track]], chart: int, duration: float, window: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Message to browser/timeline.js: tracks with their names."""
    start, end = (0.0, duration) if window is None else window
    charts = [_matching(track, tracks[0][1].charts[chart], chart) for _, track in tracks]
    rows = [track.within(start, end) for _, track in tracks]
    parts = [columns(track.time[k], shown.values(k)) for (_, track), shown, k in zip(tracks, charts, rows, strict=True)]
    low, high, near = _range(parts, charts)
    return {
        "duration": duration,
        "window": [start, end],
        "charts": [f"{each.title} [{each.unit}]" for each in tracks[0][1].charts],
        "chart": chart,
        "range": [low, high],
        "tracks": [
            _track_message(name, track, shown, part, near, first=k == 0)
            for k, ((name, track), shown, part) in enumerate(zip(tracks, charts, parts, strict=True))
        ],
    }


def _matching(track: Track, first: Chart, chart: int) -> Chart:
    """The chart of a track for display beside another chart, by its title or its number."""
    same = [each for each in track.charts if each.title == first.title]
    return same[0] if same else track.charts[chart if chart < len(track.charts) else 0]


def _track_message(
    name: str, track: Track, chart: Chart, part: Columns, near: Sequence[ChartLimit], *, first: bool
) -> dict[str, Any]:
    digits, (times, low, high) = chart.decimals + 1, part
    far = [limit for limit in chart.limits if limit not in near]
    return {
        "name": name,
        "title": chart.title,
        "unit": chart.unit,
        "decimals": chart.decimals,
        "cables": chart.of_cables,
        "lines": [[line, COLORS[i % len(COLORS)], i >= len(COLORS)] for i, line in enumerate(chart.names)],
        "end": float(track.time[-1]),
        "times": np.round(times, 9).tolist(),
        "low": [_finite(line, digits) for line in low.T],
        "high": None if high is low else [_finite(line, digits) for line in high.T],
        "limits": [limit for limit in chart.limits if limit in near],
        "far": ", ".join(f"{title} {value:g} {chart.unit}" for value, title, _ in far) if first else "",
        "spans": track.spans,
        "marks": _most_important(track),
        "paths": [[path, f"rgb{color}"] for path, color in track.paths],
    }


def _most_important(track: Track) -> list[TimelineMark]:
    """Marks of a track. If there are too many marks, the faults and the last of the other marks."""
    if len(track.marks) <= MOST_MARKS:
        return sorted(track.marks)
    bad = [mark for mark in track.marks if mark[2]][-MOST_MARKS:]
    rest = [mark for mark in track.marks if not mark[2]]
    return sorted(bad + rest[len(rest) - (MOST_MARKS - len(bad)) :])


def _range(parts: Sequence[Columns], charts: Sequence[Chart]) -> tuple[float, float, list[ChartLimit]]:
    """Lowest and highest value of the axis, and the limits within this range."""
    lows, highs = (np.concatenate([part[k].ravel() for part in parts]) for k in (1, 2))
    lows, highs = lows[np.isfinite(lows)], highs[np.isfinite(highs)]
    low, high = (float(lows.min()), float(highs.max())) if lows.size and highs.size else (0.0, 1.0)
    spread = max(high - low, 1e-6 * max(abs(high), 1.0))
    limits = [limit for chart in charts for limit in chart.limits]
    least, most = low - _NEAR * spread, high + _NEAR * spread
    near = [(value, title, upper) for value, title, upper in limits if least <= value <= most]
    values = [value for value, _, _ in near]
    low, high = min([low, *values]), max([high, *values])
    return low - _BORDER * spread, high + _BORDER * spread, near


def _finite(line: Array, digits: int) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in np.round(line, digits).tolist()]

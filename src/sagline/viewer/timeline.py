"""Charts, marks and spans of the timeline, and the message with their columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.robot import Robot
from sagline.viewer.tension_scale import ForceUnit

# Colors of cables by number in charts, different from those of the platform, its path, tensions and verdicts. Their
# contrast is 3 : 1 on the panels of both themes.
COLORS: Final = ("#0e9384", "#8a8a12", "#9a6f52", "#1897b8", "#5e9a3c", "#7d8794")  # further lines are dashed
_ENDS: Final = {"chord": "the chord", "frame_end": "the frame end"}


class ChartLimit(NamedTuple):
    """A limit of a chart."""

    value: float  # value in the unit of the chart
    name: str
    upper: bool  # True for an upper limit


class Span(NamedTuple):
    """A range of time with an infeasible pose, a violated limit or a fault."""

    start: float  # start [s]
    end: float  # end [s]
    why: str  # reason


class TimelineMark(NamedTuple):
    """An event."""

    time: float  # time [s]
    text: str
    bad: bool  # True for a fault or a failure


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


def cable_names(robot: Robot) -> tuple[str, ...]:
    """The names of the lines of a chart of cables."""
    return tuple(map(str, range(robot.cable_count)))


def chart_limits(robot: Robot, newtons: float, *, at: str) -> tuple[ChartLimit, ...]:
    """The tension limits. If cables have different limits, the tightest limits."""
    low, high = float(robot.tension_min.max()), float(robot.tension_max.min())
    other = "" if at == robot.tension_limits_of else f", of {_ENDS[robot.tension_limits_of]}"
    lower = (ChartLimit(low / newtons, f"lowest allowed{other}", upper=False),) if low > 0.0 else ()
    upper = (ChartLimit(high / newtons, f"highest allowed{other}", upper=True),) if isfinite(high) else ()
    return lower + upper


MOST_SPANS: Final = 400  # largest number of spans on a timeline; close ones are joined


def spans_of(time: Array, wrong: NDArray[np.bool_], why: Callable[[slice], str]) -> tuple[Span, ...]:
    """Spans of consecutive samples with the flag `wrong`. A sample lasts until the next sample."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], wrong, [False])).astype(np.int8))).reshape(-1, 2)
    if not edges.size:
        return ()
    until = np.minimum(edges[:, 1], time.size - 1)
    apart = time[edges[1:, 0]] - time[until[:-1]] > (time[-1] - time[0]) / MOST_SPANS
    first = edges[np.concatenate(([True], apart)), 0]
    end = edges[np.concatenate((apart, [True])), 1]
    return tuple(
        Span(float(time[a]), float(time[min(b, time.size - 1)]), why(slice(int(a), int(b))))
        for a, b in zip(first, end, strict=True)
    )


def infeasible_spans(plan: Plan, time: Array, unit: ForceUnit) -> tuple[Span, ...]:
    """Spans of a plan of N poses in which it is not feasible or not stable."""

    def why(rows: slice) -> str:
        lost = plan.status[rows] == PoseStatus.INFEASIBLE
        if not lost.any():  # poses before and after infeasible ones are often unstable
            status = PoseStatus(int(plan.status[rows][~plan.solved[rows]][0]))
            return status.name.replace("_", " ").lower()
        short = plan.shortfall[rows][lost]
        known = short[np.isfinite(short)]
        parts = ["not feasible"]
        if np.isinf(short).any():
            parts.append("no force alone is sufficient")
        elif known.size:
            parts.append(f"short of up to {unit.written(float(known.max()))}")
        blocking = np.flatnonzero(plan.blocking[rows][lost].any(axis=0))
        return ": ".join(parts) + (f"; at their limits: {_cables(blocking)}" if blocking.size else "")

    return spans_of(time, ~plan.solved, why)


def limit_violations(robot: Robot, time: Array, tension: Array, unit: ForceUnit) -> tuple[Span, ...]:
    """Spans in which a tension at the winch, shape (N, m) [N], is not within its limits."""
    below = np.asarray(tension < robot.tension_min)  # NaN is neither above nor below a limit
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
                parts.append(f"{_cables(cables)} {word} {limit}: {unit.written(reached)} at the winch")
        return "; ".join(parts)

    return spans_of(time, np.asarray((below | above).any(axis=1)), why)


def _cables(which: NDArray[np.intp]) -> str:
    return f"cable{'s' if which.size > 1 else ''} {', '.join(map(str, which))}"


MOST_COLUMNS: Final = 1500  # largest number of columns
MOST_MARKS: Final = 300
_NEAR: Final = 0.6  # limits within this distance, relative to the spread of values, are drawn; others are written
_BORDER: Final = 0.05  # margins above and below, relative to the spread


class _Columns(NamedTuple):
    """Columns of a chart: samples or groups of samples."""

    time: Array  # start of each column [s], shape (C,)
    low: Array  # smallest value of each line in a column, shape (C, k); NaN for missing values
    high: Array  # largest value of each line in a column


def columns(time: Array, values: Array, most: int = MOST_COLUMNS) -> _Columns:
    """At most `most` columns with equal numbers of samples; the samples have `time` (N,) and `values` (N, k)."""
    if time.size <= most:
        return _Columns(time, values, values)
    starts = (np.arange(most) * time.size) // most
    return _Columns(time[starts], _extremes(np.fmin, values, starts), _extremes(np.fmax, values, starts))


def timeline_message(
    tracks: Sequence[tuple[str, Track]], chart: int, duration: float, window: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Message to browser/timeline.js: tracks with their names."""
    start, end = (0.0, duration) if window is None else window
    charts = [_matching(track, tracks[0][1].charts[chart], chart) for _, track in tracks]
    parts = [_columns(track, shown, start, end) for (_, track), shown in zip(tracks, charts, strict=True)]
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


def _columns(track: Track, chart: Chart, start: float, end: float) -> _Columns:
    rows = track.within(start, end)
    return columns(track.time[rows], chart.values(rows))


def _matching(track: Track, first: Chart, chart: int) -> Chart:
    """The chart of a track for display beside another chart, by its title or its number."""
    same = [each for each in track.charts if each.title == first.title]
    return same[0] if same else track.charts[chart if chart < len(track.charts) else 0]


def _track_message(
    name: str, track: Track, chart: Chart, part: _Columns, near: Sequence[ChartLimit], *, first: bool
) -> dict[str, Any]:
    digits = chart.decimals + 1
    far = [f"{limit.name} {limit.value:g} {chart.unit}" for limit in chart.limits if limit not in near]
    return {
        "name": name,
        "title": chart.title,
        "unit": chart.unit,
        "decimals": chart.decimals,
        "cables": chart.of_cables,
        "lines": [[line, COLORS[i % len(COLORS)], i >= len(COLORS)] for i, line in enumerate(chart.names)],
        "end": float(track.time[-1]),
        "times": np.round(part.time, 9).tolist(),
        "low": [_finite(line, digits) for line in part.low.T],
        "high": None if part.high is part.low else [_finite(line, digits) for line in part.high.T],
        "limits": [[limit.value, limit.name, limit.upper] for limit in chart.limits if limit in near],
        "far": ", ".join(far) if first else "",
        "spans": [[span.start, span.end, span.why] for span in track.spans],
        "marks": [[mark.time, mark.text, mark.bad] for mark in _most_important(track)],
        "paths": [[path, f"rgb{color}"] for path, color in track.paths],
    }


def _most_important(track: Track) -> list[Any]:
    """Marks of a track. If there are too many marks, the faults and the last of the other marks."""
    bad = [mark for mark in track.marks if mark.bad][-MOST_MARKS:]
    rest = [mark for mark in track.marks if not mark.bad]
    return sorted(bad + rest[len(rest) - (MOST_MARKS - len(bad)) :] if len(track.marks) > MOST_MARKS else track.marks)


def _range(parts: Sequence[_Columns], charts: Sequence[Chart]) -> tuple[float, float, list[ChartLimit]]:
    """Lowest and highest value of the axis, and the limits within this range."""
    ends = [_extent(part) for part in parts]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    if low > high:
        low, high = 0.0, 1.0
    spread = max(high - low, 1e-6 * max(abs(high), 1.0))
    limits = [limit for chart in charts for limit in chart.limits]
    near = [limit for limit in limits if low - _NEAR * spread <= limit.value <= high + _NEAR * spread]
    low, high = min([low, *(limit.value for limit in near)]), max([high, *(limit.value for limit in near)])
    return low - _BORDER * spread, high + _BORDER * spread, near


def _extent(part: _Columns) -> tuple[float, float]:
    low, high = part.low[np.isfinite(part.low)], part.high[np.isfinite(part.high)]
    return (float(low.min()), float(high.max())) if low.size and high.size else (np.inf, -np.inf)


def _extremes(which: np.ufunc, values: Array, starts: Any) -> Array:
    """Extreme values of the samples from each start to the next one, for each line."""
    return np.stack([which.reduceat(np.ascontiguousarray(line), starts) for line in values.T], axis=1)


def _finite(line: Array, digits: int) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in np.round(line, digits).tolist()]

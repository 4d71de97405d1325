"""A track as the page is told it: no more columns than a screen has, each with the least and the largest value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.viewer.timeline_track import COLORS, Chart, Limit, Track

MOST: Final = 1500  # columns
MOST_MARKS: Final = 300
_NEAR: Final = 0.6  # of the values' spread: a limit within this of them is drawn, one farther away is told
_BORDER: Final = 0.05  # of the spread, above and below


class Columns(NamedTuple):
    """Samples, or groups of them.

    Attributes:
        time: When each begins [s], shape (C,).
        low: Least value of each line in it, shape (C, k); NaN where there is none.
        high: Largest value.
    """

    time: Array
    low: Array
    high: Array


def columns(time: Array, values: Array, most: int = MOST) -> Columns:
    """As few columns as that of samples (N,) with values (N, k), of as many samples each, or one less."""
    if time.size <= most:
        return Columns(time, values, values)
    starts = (np.arange(most) * time.size) // most
    return Columns(time[starts], _extremes(np.fmin, values, starts), _extremes(np.fmax, values, starts))


def told(
    tracks: Sequence[tuple[str, Track]], chart: int, duration: float, window: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Tracks with their names, as the page takes them.

    Args:
        tracks: The tracks; the first one's charts can be chosen.
        chart: Which of them is shown.
        duration: Of all of them [s].
        window: From when to when they are looked at [s]; None for the whole.
    """
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
            _told(name, track, shown, part, near, first=k == 0)
            for k, ((name, track), shown, part) in enumerate(zip(tracks, charts, parts, strict=True))
        ],
    }


def _columns(track: Track, chart: Chart, start: float, end: float) -> Columns:
    rows = track.within(start, end)
    return columns(track.time[rows], chart.values(rows))


def _matching(track: Track, wanted: Chart, chart: int) -> Chart:
    """The chart of a track that another one's is to be seen beside: of that title, or else in that place."""
    same = [each for each in track.charts if each.title == wanted.title]
    return same[0] if same else track.charts[chart if chart < len(track.charts) else 0]


def _told(
    name: str, track: Track, chart: Chart, part: Columns, near: Sequence[Limit], *, first: bool
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
        "low": [_known(line, digits) for line in part.low.T],
        "high": None if part.high is part.low else [_known(line, digits) for line in part.high.T],
        "limits": [[limit.value, limit.name, limit.upper] for limit in chart.limits if limit in near],
        "far": ", ".join(far) if first else "",
        "spans": [[span.start, span.end, span.why] for span in track.spans],
        "marks": [[mark.time, mark.text, mark.bad] for mark in _shown(track)],
        "paths": [[path, f"rgb{color}"] for path, color in track.paths],
    }


def _shown(track: Track) -> list[Any]:
    """What happened; of too much what is bad, and of the rest the last."""
    bad = [mark for mark in track.marks if mark.bad][-MOST_MARKS:]
    rest = [mark for mark in track.marks if not mark.bad]
    return sorted(bad + rest[len(rest) - (MOST_MARKS - len(bad)) :] if len(track.marks) > MOST_MARKS else track.marks)


def _range(parts: Sequence[Columns], charts: Sequence[Chart]) -> tuple[float, float, list[Limit]]:
    """Lowest and highest value of the axis, and the limits that lie on it."""
    ends = [_ends(part) for part in parts]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    if low > high:
        low, high = 0.0, 1.0
    spread = max(high - low, 1e-6 * max(abs(high), 1.0))
    limits = [limit for chart in charts for limit in chart.limits]
    near = [limit for limit in limits if low - _NEAR * spread <= limit.value <= high + _NEAR * spread]
    low, high = min([low, *(limit.value for limit in near)]), max([high, *(limit.value for limit in near)])
    return low - _BORDER * spread, high + _BORDER * spread, near


def _ends(part: Columns) -> tuple[float, float]:
    low, high = part.low[np.isfinite(part.low)], part.high[np.isfinite(part.high)]
    return (float(low.min()), float(high.max())) if low.size and high.size else (np.inf, -np.inf)


def _extremes(which: np.ufunc, values: Array, starts: Any) -> Array:
    """Of the samples from each start to the next, line by line."""
    return np.stack([which.reduceat(np.ascontiguousarray(line), starts) for line in values.T], axis=1)


def _known(line: Array, digits: int) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in np.round(line, digits).tolist()]

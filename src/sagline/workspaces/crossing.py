"""Sign changes of a function of positions, along many lines at the same time."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, Indices
from sagline.workspaces.grid import Level, level_values

TRIAL = 3  # number of steps of regula falsi, in which the width of a bracket must decrease to an eighth
ITERATIONS = 100  # largest number of steps; bisection at a jump needs about 45, a continuous function 5 to 8


class Brackets(NamedTuple):
    """Two positions on each of N rays, between which a function changes its sign.

    Attributes:
        inner: Position inside [m], shape (N, 3).
        outer: Position outside [m].
        at_inner: Function at `inner`, shape (N,).
        at_outer: Function at `outer`.
        found: True if the function changes its sign within the limit, shape (N,).
    """

    inner: Array
    outer: Array
    at_inner: Array
    at_outer: Array
    found: NDArray[np.bool_]

    @property
    def k(self) -> Indices:
        """Indices of the rays with a sign change."""
        return np.flatnonzero(self.found)


def brackets(
    level: Level, points: Array, outward: Array, at_points: Array, step: Array, outer_limit: Array, inner_limit: Array
) -> Brackets:
    """Search along rays from `points` (N, 3) [m], outward from inside points, otherwise inward. Each step triples."""
    is_inside = at_points >= 0.0
    limit = np.where(is_inside, outer_limit, inner_limit)
    away = np.where(is_inside, 1.0, -1.0)[:, None] * outward
    near, at_near, at_far = points.copy(), at_points.copy(), np.full(len(points), np.nan)
    distance, far = np.minimum(step, limit), points.copy()
    k = np.flatnonzero(limit > 0.0)
    found = np.zeros(len(points), dtype=np.bool_)
    while len(k):
        far[k] = points[k] + distance[k, None] * away[k]
        at_far[k] = level_values(level, far[k])
        found[k] = (at_far[k] >= 0.0) != is_inside[k]
        k = k[~found[k] & (distance[k] < limit[k])]
        near[k], at_near[k] = far[k], at_far[k]
        distance[k] = np.minimum(3.0 * distance[k], limit[k])
    inner, outer = np.where(is_inside[:, None], (near, far), (far, near))
    at_inner, at_outer = np.where(is_inside, (at_near, at_far), (at_far, at_near))
    return Brackets(inner, outer, at_inner, at_outer, found)


def crossings(
    level: Level,
    inner: Array,
    outer: Array,
    at_inner: Array,
    at_outer: Array,
    *,
    precision: float = 1e-10,
    narrow: float = 1e-12,
) -> Array:
    """As `crossings_of`, with one function for all V lines."""

    def values(_: Indices, positions: Array) -> Array:
        return level_values(level, positions)

    return crossings_of(values, inner, outer, at_inner, at_outer, precision=precision, narrow=narrow)


def crossings_of(
    values: Callable[[Indices, Array], Array],
    inner: Array,
    outer: Array,
    at_inner: Array,
    at_outer: Array,
    *,
    precision: float = 1e-10,
    narrow: float = 1e-12,
) -> Array:
    """Inside shares (V,) of V lines, by regula falsi. The weight of an end is reduced while the end does not move.

    `values` has two arguments, indices of lines and one position on each line, and returns the function of each line. A
    bracket is bisected if an end value is infinite. It is bisected several times if regula falsi is slower than
    bisection, for example at jumps. `precision` is relative to the smaller end value, `narrow` to the length of the
    line. The weights follow Anderson & Björck 1973; the Illinois method would have weights of 1/2.
    """
    low, high = np.zeros(len(inner)), np.ones(len(inner))
    at_low, at_high = at_inner.copy(), at_outer.copy()
    small = np.minimum(at_low, -at_high)
    small = np.where(np.isinf(small), 0.0, precision * small)
    low_stays, high_stays = np.zeros((2, len(inner)), dtype=np.bool_)
    schedule = _BisectionSchedule(len(inner))
    k = np.flatnonzero(at_low > small)
    for _ in range(ITERATIONS):
        if not len(k):
            break
        with np.errstate(invalid="ignore"):
            share = at_low[k] / (at_low[k] - at_high[k])
        halved = schedule.due(k) | np.isinf(at_low[k]) | np.isinf(at_high[k])
        share = low[k] + np.where(halved, 0.5, share) * (high[k] - low[k])
        found = values(k, inner[k] + share[:, None] * (outer[k] - inner[k]))
        is_inside = found >= 0.0
        with np.errstate(invalid="ignore", divide="ignore"):
            weight = 1.0 - found / np.where(is_inside, at_low[k], at_high[k])
        weight = np.where(weight > 0.0, weight, 0.5)
        at_low[k] = np.where(is_inside, found, np.where(low_stays[k], weight * at_low[k], at_low[k]))
        at_high[k] = np.where(~is_inside, found, np.where(high_stays[k], weight * at_high[k], at_high[k]))
        low[k], high[k] = np.where(is_inside, share, low[k]), np.where(is_inside, high[k], share)
        low_stays[k], high_stays[k] = ~is_inside & ~halved, is_inside & ~halved
        schedule.update(k, halved, high[k] - low[k])
        hit = np.abs(found) <= small[k]
        low[k[hit]] = share[hit]
        k = k[~hit & (high[k] - low[k] > narrow)]
    return low


class _BisectionSchedule:
    """Number of bisection steps of each bracket; it doubles after each trial in which regula falsi was slow."""

    def __init__(self, count: int) -> None:
        self._width = np.ones(count)  # width of the bracket at the start of a trial
        self._steps, self._due = np.zeros((2, count), dtype=np.int64)
        self._next = np.ones(count, dtype=np.int64)

    def due(self, k: Indices) -> NDArray[np.bool_]:
        """True for each bracket of `k` whose next step is a bisection."""
        return np.asarray(self._due[k] > 0)

    def update(self, k: Indices, halved: NDArray[np.bool_], width: Array) -> None:
        """Update the counters of the brackets `k` after a step."""
        self._due[k] = np.maximum(self._due[k] - halved, 0)
        self._steps[k] = np.where(halved, 0, self._steps[k] + 1)
        over = self._steps[k] == TRIAL
        slow = k[over & (width > self._width[k] * 0.5**TRIAL)]
        self._due[slow] = self._next[slow]
        self._next[slow] *= 2
        self._steps[k[over]] = 0
        self._width[k] = np.where(over | halved, width, self._width[k])


def distance_to_box(points: Array, directions: Array, low: Array, high: Array) -> Array:
    """Distances (N,) [m] from `points` (3,) or (N, 3) in a box to its surface, along unit `directions` (N, 3)."""
    walls = np.where(directions > 0.0, high - points, low - points)
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths: Array = np.where(directions != 0.0, walls / directions, np.inf).min(axis=1)
    return lengths.clip(0.0)

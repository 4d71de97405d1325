"""Where a function of positions changes its sign along many lines at once."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.workspaces.grid import Level, evaluate

ROUNDS = 100  # a jump takes some 45, by halving; what is continuous ends after 5 to 8


def crossings(
    level: Level,
    inner: Array,
    outer: Array,
    at_inner: Array,
    at_outer: Array,
    *,
    precision: float = 1e-11,
    narrow: float = 1e-12,
) -> Array:
    """Where each of V lines leaves the inside, by regula falsi that weighs an end less that stays (Illinois).

    All lines that are not done are evaluated together, once a round. The bracket of a line is halved where an end is
    infinite, and where regula falsi has not kept up with halving, as at jumps.

    Args:
        level: The function.
        inner: One end of each line, inside [m], shape (V, 3).
        outer: The other end, outside [m], shape (V, 3).
        at_inner: The function there, >= 0, shape (V,).
        at_outer: The same at the other ends, < 0.
        precision: Largest value that is taken for zero, of the difference between the ends.
        narrow: Share of a line to which a jump is found.

    Returns:
        Share of each line that is inside, from 0 to 1, shape (V,): at a jump, the last that is known to be.
    """
    low, high = np.zeros(len(inner)), np.ones(len(inner))
    at_low, at_high = at_inner.copy(), at_outer.copy()
    small = precision * (np.where(np.isinf(at_low), 0.0, at_low) - np.where(np.isinf(at_high), 0.0, at_high))
    low_stays, high_stays = np.zeros((2, len(inner)), dtype=np.bool_)
    open_lines = np.flatnonzero(at_low > small)
    for done in range(ROUNDS):
        if not len(open_lines):
            break
        k = open_lines
        share = low[k] + _step(at_low[k], at_high[k], high[k] - low[k], done) * (high[k] - low[k])
        found = evaluate(level, inner[k] + share[:, None] * (outer[k] - inner[k]))
        is_inside = found >= 0.0
        at_low[k] = np.where(is_inside, found, np.where(low_stays[k], 0.5 * at_low[k], at_low[k]))
        at_high[k] = np.where(~is_inside, found, np.where(high_stays[k], 0.5 * at_high[k], at_high[k]))
        low[k], high[k] = np.where(is_inside, share, low[k]), np.where(is_inside, high[k], share)
        low_stays[k], high_stays[k] = ~is_inside, is_inside
        hit = np.abs(found) <= small[k]
        low[k[hit]] = share[hit]
        open_lines = k[~hit & (high[k] - low[k] > narrow)]
    return low


def _step(at_low: Array, at_high: Array, width: Array, done: int) -> Array:
    """Share of each bracket at which to look next."""
    with np.errstate(invalid="ignore"):
        share = at_low / (at_low - at_high)
    halve = np.isinf(at_low) | np.isinf(at_high) | (width > 4.0 * 0.5**done)
    steps: Array = np.where(halve, 0.5, share)
    return steps

"""A short way through places: the nearest next, then crossings undone."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arrays import Array, Indices

PASSES: Final = 50  # over all pairs of legs; a tour of a hundred places takes a handful
_ROUNDING: Final = 1e-9  # of the largest distance


def short_tour(places: Array) -> Indices:
    """An order in which all places are visited once, on a short way that need not come back.

    Args:
        places: Shape (N, d), N >= 1.

    Returns:
        Indices of the places in that order, shape (N,).

    Source:
        Croes 1958, "A method for solving traveling-salesman problems" (2-opt).
    """
    count = len(places)
    apart = np.zeros((count + 1, count + 1))  # the last is nowhere: the way begins and ends there at no cost
    apart[:count, :count] = np.linalg.norm(places[:, None] - places[None], axis=-1)
    order = np.concatenate(([count], _nearest_next(apart[:count, :count]), [count]))
    for _ in range(PASSES):
        if not _uncrossed(order, apart, _ROUNDING * apart.max()):
            break
    found: Indices = order[1:-1]
    return found


def length_of(places: Array, order: Indices) -> float:
    """How long a tour is, in the unit of the places.

    Args:
        places: Shape (N, d).
        order: Indices, shape (N,).
    """
    return float(np.linalg.norm(np.diff(places[order], axis=0), axis=-1).sum())


def _nearest_next(apart: Array) -> Indices:
    """From the farthest place on, always to the nearest one."""
    order = np.empty(len(apart), dtype=np.int64)
    left = np.ones(len(apart), dtype=np.bool_)
    here = int(np.argmax(apart.sum(axis=1)))
    for k in range(len(apart)):
        order[k] = here
        left[here] = False
        here = int(np.argmin(np.where(left, apart[here], np.inf)))
    return order


def _uncrossed(order: Indices, apart: Array, floor: float) -> bool:
    """Turn around every stretch that makes the way shorter so, in place; whether there was one."""
    changed = False
    for i in range(len(order) - 2):
        before, first, lasts, after = order[i], order[i + 1], order[i + 1 : -1], order[i + 2 :]
        saved = apart[before, first] + apart[lasts, after] - apart[before, lasts] - apart[first, after]
        best = int(np.argmax(saved))
        if saved[best] > floor:
            order[i + 1 : i + 2 + best] = order[i + 1 : i + 2 + best][::-1].copy()
            changed = True
    return changed

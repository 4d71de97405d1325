"""Checks of indices along the first axis of a batch of poses, cables or equilibria."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagline.core.arguments import brief, integer
from sagline.core.errors import NoBatchError, NoSuchEntryError


def part_of(index: Any, shape: tuple[int, ...], single: str) -> Any:
    """Checked index along the first axis of a batch: an integer, a slice, or an array of integers or booleans.

    shape: shape of the batch, () for a single entry; single: name of a single entry in the message.
    """
    if not shape:
        raise NoBatchError("index", brief(index), "none", f"A {single} cannot be indexed; use it directly.")
    if isinstance(index, slice):
        return _sliced(index, shape[0])
    number = integer(index)
    if number is not None:
        if -shape[0] <= number < shape[0]:
            return number
        raise _no_entry(index, shape[0])
    chosen = np.asarray(index) if isinstance(index, list | np.ndarray) else None
    if chosen is None or chosen.ndim != 1 or not _names_entries(chosen, shape[0]):
        raise _no_entry(index, shape[0])
    return chosen if chosen.size else chosen.astype(np.int64)  # numpy converts an empty list to an array of floats


def batch_length(shape: tuple[int, ...], single: str) -> int:
    """Number of entries along the first axis of a batch of shape `shape`; single: name of an entry in the message."""
    if not shape:
        raise NoBatchError("this", f"a {single}", "a batch", f"A {single} has no length; use it directly.")
    return shape[0]


def _sliced(index: slice, size: int) -> slice:
    try:
        index.indices(size)
    except (TypeError, ValueError):
        raise _no_entry(index, size) from None
    return index


def _names_entries(chosen: NDArray[Any], size: int) -> bool:
    if chosen.dtype == np.bool_:
        return len(chosen) == size
    if chosen.size == 0:
        return True
    return bool(chosen.dtype.kind in "iu" and int(chosen.min()) >= -size and int(chosen.max()) < size)


def _no_entry(index: object, size: int) -> NoSuchEntryError:
    allowed = f"{-size} to {size - 1}, a slice, or an array of such numbers or of {size} booleans"
    if size == 0:
        allowed = "a slice, because the batch is empty"
    return NoSuchEntryError("index", brief(index), allowed, f"The batch has {size}; indices start at 0.")


def true_runs(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    """First index and end of each run of True in `flags`, in order, shape (k, 2)."""
    return np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8))).reshape(-1, 2)


def evenly_spaced(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices 0 to `count` - 1, at nearly equal steps, with the first and the last index."""
    places = np.linspace(0, max(count - 1, 0), min(count, most))
    return np.unique(places.round().astype(np.int64))

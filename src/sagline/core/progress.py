"""Division of long calculations into blocks, between which Ctrl-C is handled and progress is reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

from sagline.core.arrays import Array

# function that is called after each block with the number of finished rows and the number of all rows
Progress: TypeAlias = Callable[[int, int], None]


def blocks(count: int, size: int, progress: Progress | None = None) -> Iterator[slice]:
    """Slices that divide `count` rows into blocks of at most `size` rows; progress is called after each block."""
    for first in range(0, count, size):
        part = slice(first, min(first + size, count))
        yield part
        if progress is not None:
            progress(part.stop, count)


def rows_of(array: Array, part: slice) -> Array:
    """Rows `part` of `array`. An array with a single row is for all entries, and is returned unchanged."""
    return array if len(array) == 1 else array[part]

"""Long work in blocks, between which an interrupt is handled and progress is reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

from sagline.core.arrays import Array

Progress: TypeAlias = Callable[[int, int], None]  # called after each block: how many are done, of how many


def blocks(count: int, size: int, progress: Progress | None = None) -> Iterator[slice]:
    """Slices of at most `size` of `count` rows; progress is reported after each."""
    for first in range(0, count, size):
        part = slice(first, min(first + size, count))
        yield part
        if progress is not None:
            progress(part.stop, count)


def rows_of(array: Array, part: slice) -> Array:
    """A block of an array with one row for all or one row each."""
    return array if len(array) == 1 else array[part]

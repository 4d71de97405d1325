"""The memory that kernels work in: kernels allocate nothing, which spares them counting references to it.

It comes from Python as one flat array of numbers and one of counters, from which a kernel carves its blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.kernels.jit import glue


class Memory(NamedTuple):
    """Memory of a kernel."""

    numbers: Array  # flat
    counters: Indices  # flat


def memory_for(cables: int) -> tuple[Array, Indices]:
    """Memory for whatever a kernel does with one pose of so many cables; a kernel that wants more raises ValueError."""
    return np.empty(12 * cables * cables + 320 * cables + 400), np.empty(10 * cables + 40, dtype=np.int64)


@glue
def block(numbers: Array, at: int, rows: int, columns: int) -> tuple[Array, int]:
    """A block (rows, columns) of flat memory from a place on, and the place that follows it."""
    return numbers[at : at + rows * columns].reshape((rows, columns)), at + rows * columns


@glue
def counters(memory: Memory, at: int, count: int) -> tuple[Indices, int]:
    """So many counters from a place on, and the place that follows them."""
    return memory.counters[at : at + count].reshape((count,)), at + count  # which tells when there are too few

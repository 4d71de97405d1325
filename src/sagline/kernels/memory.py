"""Work memory of kernels. Kernels do not allocate memory themselves, which avoids reference counting.

Python passes one flat array of numbers and one flat array of counters. `block`, `vector` and `counters` cut named
arrays from these two arrays, one after the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.kernels.jit import glue


class Memory(NamedTuple):
    """Memory of a kernel, or the part of this memory that is not used yet."""

    numbers: Array  # flat array of numbers
    counters: Indices  # flat array of counters


def memory_for(cables: int) -> tuple[Array, Indices]:
    """Work arrays of a kernel for one pose with `cables` cables. A kernel that needs more memory raises ValueError."""
    return np.empty(12 * cables * cables + 320 * cables + 400), np.empty(10 * cables + 40, dtype=np.int64)


@glue
def block(memory: Memory, rows: int, columns: int) -> tuple[Array, Memory]:
    """A block (rows, columns), and the remaining memory."""
    size = rows * columns
    return memory.numbers[:size].reshape((rows, columns)), Memory(memory.numbers[size:], memory.counters)


@glue
def vector(memory: Memory, size: int) -> tuple[Array, Memory]:
    """A vector (size,), and the remaining memory."""
    return memory.numbers[:size].reshape((size,)), Memory(memory.numbers[size:], memory.counters)


@glue
def counters(memory: Memory, count: int) -> tuple[Indices, Memory]:
    """Array of counters (count,), and the remaining memory. If too few counters remain, `reshape` raises an error."""
    return memory.counters[:count].reshape((count,)), Memory(memory.numbers, memory.counters[count:])

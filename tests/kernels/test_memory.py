"""Memory: blocks are adjacent, the size is sufficient, and too little memory is reported."""

from __future__ import annotations

import numpy as np
import pytest

from sagline.core.arrays import Array, Indices
from sagline.kernels.cable.terms import new_cables
from sagline.kernels.codes import LOWEST_MAXIMUM, LOWEST_SUM
from sagline.kernels.memory import Memory, block, memory_for
from sagline.kernels.statics import new_balance
from sagline.kernels.tension.nearest import new_reference_point
from sagline.kernels.tension.polygon import new_work_arrays
from tests.kernels.compiled import from_python, memory

take_block = from_python(block)
room_for_cables = from_python(new_cables)
room_for_balance = from_python(new_balance)
room_for_nearness = from_python(new_reference_point)
room_otherwise = from_python(new_work_arrays)


def parts_of(words: object) -> list[Array]:
    """All arrays of nested NamedTuples, memory that is left over not counted."""
    if isinstance(words, np.ndarray):
        return [words]
    if isinstance(words, Memory | bool):
        return []
    assert isinstance(words, tuple)
    return [part for word in words for part in parts_of(word)]


@pytest.mark.parametrize("method", [LOWEST_SUM, LOWEST_MAXIMUM])
@pytest.mark.parametrize(("m", "n"), [(2, 1), (4, 2), (6, 6), (8, 6), (24, 6)])
def test_blocks_do_not_overlap_and_are_all_inside(m: int, n: int, method: int) -> None:
    numbers, counters = memory_for(m)
    cables, rest = room_for_cables(Memory(numbers, counters), m, True)
    balance, rest = room_for_balance(rest, m, n)
    near, rest = room_for_nearness(rest, np.zeros(m), m - n)
    room = room_otherwise(method, rest, m, m - n)
    parts = parts_of((cables, balance, near[1:], room))  # the tensions before come from Python
    for value, part in enumerate(parts):
        part[...] = value
    for value, part in enumerate(parts):
        assert (part == value).all()
    used = sum(part.size for part in parts if part.dtype == np.float64)
    assert used == numbers.size - room.rest.numbers.size
    assert sum(part.size for part in parts if part.dtype == np.int64) == counters.size - room.rest.counters.size
    room.rest.numbers[:], room.rest.counters[:] = -1.0, -1
    for value, part in enumerate(parts):
        assert (part == value).all()
    shapes: dict[str, tuple[Array | Indices, tuple[int, ...]]] = {
        "matrix": (balance.matrix, (n, m)),
        "null": (balance.null, (m - n, m)),
        "q": (balance.q, (m + 1, m)),
        "bounds": (balance.bounds, (3, m)),
        "labels": (room.labels, (2 * m + 6,)),
        "held": (near.held.labels, (m - n + 2,)),
        "basis": (room.basis.inverse, (m - n + (method == LOWEST_MAXIMUM),) * 2),
    }
    for name, (array, shape) in shapes.items():
        assert array.shape == shape, name


def test_a_block_and_the_memory_that_is_left() -> None:
    whole = Memory(np.arange(20.0), np.arange(3))
    rows, rest = take_block(whole, 2, 4)
    np.testing.assert_array_equal(rows, np.arange(8.0).reshape(2, 4))
    np.testing.assert_array_equal(rest.numbers, np.arange(8.0, 20.0))
    np.testing.assert_array_equal(rest.counters, np.arange(3))
    with pytest.raises(ValueError, match="total size"):
        take_block(rest, 2, 7)


def test_too_little_memory_is_told() -> None:
    with pytest.raises(ValueError, match="total size"):
        room_for_cables(memory(26 * 8 - 1, 100), 8, False)
    with pytest.raises(ValueError, match="total size"):
        room_for_balance(memory(300, 100), 8, 6)
    with pytest.raises(ValueError, match="total size"):
        room_for_nearness(memory(1000, 3), np.zeros(8), 2)
    for counters in (1 + 22 - 1, 1 + 22 + 2):
        with pytest.raises(ValueError, match="total size"):
            room_otherwise(LOWEST_SUM, memory(1000, counters), 8, 2)

"""What a control loop gives and gets: plain numbers and memory of its own, looked at within some ten nanoseconds."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sagline.arguments import brief
from sagline.arrays import Array, exactly
from sagline.errors import InvalidValueError

ARRAY: Final = np.ndarray  # a name of a module's own is found quicker than that of another
FLOAT: Final = np.dtype(np.float64)


def plain(given: Any, item: str, unit: str, count: int) -> Any:
    """Numbers as a list or tuple, which `struct` takes: arrays and lists unchecked, everything else checked.

    Args:
        given: What the caller gave.
        item: The name a message uses.
        unit: Its unit, for the message.
        count: How many numbers there must be.

    Returns:
        A list, or the caller's tuple or list.

    Raises:
        InvalidValueError: If what is given is none of these, and no such numbers.
    """
    kind = given.__class__
    if kind is ARRAY and given.size == count:
        return given.tolist()
    return given if kind is tuple or kind is list else exactly(given, item, unit, (count,)).tolist()


def give(values: Array, out: Any, item: str) -> None:
    """Write an answer to a caller's memory.

    Args:
        values: The answer, shape (k,).
        out: The caller's array.
        item: The name a message uses.

    Raises:
        InvalidValueError: If it is no writable array of float64 of that shape.
    """
    try:
        if (out.dtype is FLOAT or out.dtype == FLOAT) and out.size == values.size:
            out[:] = values
            return
    except (AttributeError, IndexError, TypeError, ValueError):  # no array, of another shape, or write-locked
        pass
    allowed = f"a writable array of float64 of shape ({values.size},)"
    raise InvalidValueError(item, brief(out), allowed, f"Give np.empty({values.size}).")

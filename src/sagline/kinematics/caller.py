"""Fast copies of a control loop's numbers into and out of work arrays, checked within some ten nanoseconds.

A view of memory takes an array of its own kind and size and no other, which costs less than numpy takes to copy one.
"""

from __future__ import annotations

from array import array
from typing import Any, Final

import numpy as np

from sagline.core.arguments import brief
from sagline.core.arrays import Array, exactly
from sagline.core.errors import InvalidValueError

ARRAY: Final = np.ndarray  # a name of a module's own is found quicker than that of another
FLOAT: Final = np.dtype(np.float64)
WHOLE: Final = slice(None)


def copy_in(memory: Any, given: Any, item: str, unit: str) -> None:
    """Write a caller's numbers into memory of ours; the solver checks that they are finite.

    memory: a `memoryview` of float64 numbers, shape (k,).
    """
    try:
        if given.__class__ is ARRAY:
            memory[WHOLE] = given
            return
        if isinstance(given, list | tuple):
            memory[WHOLE] = array("d", given)
            return
    except (TypeError, ValueError, NotImplementedError, OverflowError):
        pass  # of another kind or shape: integers and the like are accepted, others refused with a reason
    memory[WHOLE] = exactly(given, item, unit, (len(memory),))


def copy_out(values: Array, out: Any, item: str) -> None:
    """Write an answer to a caller's memory.

    values: the answer, shape (k,).
    """
    try:
        if out.dtype is FLOAT or out.dtype == FLOAT:
            out[WHOLE] = values
            return
    except (AttributeError, IndexError, TypeError, ValueError):  # no array, of another shape, or write-locked
        pass
    allowed = f"a writable array of float64 of shape ({values.size},)"
    raise InvalidValueError(item, brief(out), allowed, f"Give np.empty({values.size}).")

"""Fast copies between the arrays of a control loop and work arrays, with checks that take tens of nanoseconds.

A memoryview accepts only an array of equal type and size. This check is faster than a numpy copy.
"""

from __future__ import annotations

from array import array
from typing import Any, Final

import numpy as np

from sagline.core.arguments import brief
from sagline.core.arrays import Array, exactly
from sagline.core.errors import InvalidValueError

ARRAY: Final = np.ndarray  # a module-level name is faster than an attribute of another module
FLOAT: Final = np.dtype(np.float64)
WHOLE: Final = slice(None)


def copy_in(memory: Any, given: Any, item: str, unit: str) -> None:
    """Copy a caller's numbers into a work array. The solver checks that the numbers are finite.

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
        # the numbers have another type or shape: integers and similar types are converted; other values raise an error
        pass
    memory[WHOLE] = exactly(given, item, unit, (len(memory),))


def copy_out(values: Array, out: Any, item: str) -> None:
    """Copy a result into a caller's array.

    values: the result, shape (k,).
    """
    try:
        if out.dtype is FLOAT or out.dtype == FLOAT:
            out[WHOLE] = values
            return
    # the target is not an array, has another shape, or is write-locked
    except (AttributeError, IndexError, TypeError, ValueError):
        pass
    allowed = f"a writable array of float64 of shape ({values.size},)"
    raise InvalidValueError(item, brief(out), allowed, f"Give np.empty({values.size}).")

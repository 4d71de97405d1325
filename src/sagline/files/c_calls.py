"""Arguments of kernels in exported programs: arrays and numbers of nested tuples, and the owners of the arrays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

AnyArray = NDArray[Any]


def leaves(value: Any) -> Iterator[Any]:
    """Arrays and numbers of nested tuples, in order. None is omitted, because None is not an argument in C."""
    if isinstance(value, tuple):
        for each in value:
            yield from leaves(each)
    elif value is not None:
        yield value


def owner(array: AnyArray) -> AnyArray:
    """The array that owns the memory of a view."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array

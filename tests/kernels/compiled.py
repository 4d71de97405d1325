"""Inner kernels as Python can call them, and room for them to work in."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, cast

import numba
import numpy as np

from sagline.kernels.memory import Memory


def from_python(inner: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel, formula or piece of glue that Python can call, which by itself would crash.

    Its caller is compiled anew in every run of the tests. Names are spelled out because glue cannot take *arguments.
    """
    names = ", ".join(inspect.signature(cast("Any", inner).py_func).parameters)
    caller = eval(f"lambda {names}: _inner({names})", {"_inner": inner})
    return cast("Callable[..., Any]", numba.njit(error_model="numpy")(caller))


def memory(numbers: int = 2000, counters: int = 200) -> Memory:
    """Plenty, filled with what must never be read before it is written."""
    return Memory(np.full(numbers, np.nan), np.full(counters, -(10**9), dtype=np.int64))

"""Inner kernels that Python can call, compiled by numba, and work arrays for them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast

import numba
import numpy as np

from sagline.kernels.memory import Memory
from sagline.kernels.sources import folder_of
from sagline.kernels.with_numba import kept

F = TypeVar("F", bound=Callable[..., Any])


def compiled(caller: F, module: str = "tests") -> F:
    """A function that calls kernels; its machine code is kept on disk until one of the kernels is edited.

    Args:
        caller: The function.
        module: Module of the only kernel it calls; all kernels if it is another module.
    """
    return kept(cast("F", numba.njit(error_model="numpy")(caller)), folder_of(module) / "callers")


@cache
def from_python(inner: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel, formula or piece of glue that Python can call, which by itself would crash.

    Names are spelled out because glue cannot take *arguments.
    """
    kernel = cast("Any", inspect.unwrap(inner))
    names, name = ", ".join(inspect.signature(kernel).parameters), f"call_{kernel.__name__}"
    code = compile(f"def {name}({names}): return _inner({names})", kernel.__code__.co_filename, "exec")
    space: dict[str, Any] = {"_inner": inner, "__name__": kernel.__module__}
    exec(code, space)
    return compiled(cast("Callable[..., Any]", space[name]), kernel.__module__)


def memory(numbers: int = 2000, counters: int = 200) -> Memory:
    """Large work arrays with values that must not be read before they are written."""
    return Memory(np.full(numbers, np.nan), np.full(counters, -(10**9), dtype=np.int64))

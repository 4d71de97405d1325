"""Kernels that only kernels call, callable from Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def from_python(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a caller around a kernel, when it is first called."""
    caller: Callable[..., Any] = numba.njit(error_model="numpy")(lambda *args: kernel(*args))
    return caller

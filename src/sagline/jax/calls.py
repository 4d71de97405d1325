"""Calls of the compiled kernels through the foreign function interface of XLA."""

from __future__ import annotations

from functools import cache
from typing import Any, Final, NamedTuple

import jax
import numpy as np

from sagline.core.errors import InvalidValueError
from sagline.kernels.jit import VARIABLE, backend, compiled_library

TARGET: Final = "sagline"
LETTERS: Final = {"float64": "D", "int64": "L", "int8": "B"}


class Work(NamedTuple):
    """Work array of a kernel."""

    shape: tuple[int, ...]
    dtype: Any


@cache
def register() -> None:
    """Make the compiled kernels known to JAX. Refuse other back ends."""
    if backend() != "c":
        step = "Build the library of compiled kernels with `make env`, or install a wheel."
        raise InvalidValueError(VARIABLE, backend(), "c for sagline.jax", step)
    jax.ffi.register_ffi_target(TARGET, jax.ffi.pycapsule(compiled_library().xla), platform="cpu")


def call_kernel(entry: str, *arguments: Any) -> list[Any]:
    """Results of a kernel. Its arguments are numbers, None, arrays, work arrays and results, in tuples."""
    operands: list[Any] = []
    results: list[Any] = []
    numbers: list[float] = []
    sizes: list[int] = []
    plan: list[str] = []

    def form(value: Any) -> str:
        """Format of an argument, as the library declares it."""
        if isinstance(value, tuple) and not isinstance(value, Work):
            return f"({''.join(map(form, value))})"
        if value is None:
            return "N"
        if isinstance(value, bool | int | float):
            numbers.append(float(value))
            return "?" if isinstance(value, bool) else "i" if isinstance(value, int) else "f"
        if isinstance(value, Work):
            sizes.extend(value.shape)
        else:
            (results if isinstance(value, jax.ShapeDtypeStruct) else operands).append(value)
        plan.append("s" if isinstance(value, Work) else "r" if isinstance(value, jax.ShapeDtypeStruct) else "a")
        return f"{LETTERS[np.dtype(value.dtype).name]}{len(value.shape)}"

    text = form(arguments)
    call = jax.ffi.ffi_call(TARGET, results, vmap_method="expand_dims")
    found: list[Any] = call(
        *operands,
        entry=entry,
        format=text,
        plan="".join(plan),
        sizes=np.array(sizes, dtype=np.int64),
        numbers=np.array(numbers, dtype=np.float64),
    )
    return found


def result_of(*shape: int, dtype: Any = np.float64) -> Any:
    """Result of a kernel."""
    return jax.ShapeDtypeStruct(shape, dtype)

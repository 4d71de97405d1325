"""Calls of the compiled kernels through the foreign function interface of XLA."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Final

import jax
import numpy as np

from sagline.core.errors import InvalidValueError
from sagline.kernels.jit import VARIABLE, backend, compiled_library
from sagline.kinematics.differentiable import ResultArray as ResultArray
from sagline.kinematics.differentiable import Work

TARGET: Final = "sagline"
LETTERS: Final = {"float64": "D", "int64": "L", "int8": "B"}


@cache
def register() -> None:
    """Make the compiled kernels known to JAX. Refuse other back ends."""
    if backend() != "c":
        step = "Build the library of compiled kernels with `make env`, or install a wheel."
        raise InvalidValueError(VARIABLE, backend(), "c for sagline.jax", step)
    jax.ffi.register_ffi_target(TARGET, jax.ffi.pycapsule(compiled_library().xla), platform="cpu")


def ffi_call(entry: Callable[..., object], *arguments: Any) -> list[Any]:
    """Outputs of a kernel. Its arguments are numbers, None, arrays, and new arrays for work and output, in tuples."""
    operands: list[Any] = []
    results: list[Any] = []
    numbers: list[float] = []
    sizes: list[int] = []
    plan: list[str] = []

    def form(value: Any) -> str:
        """Format of an argument, as the library declares it."""
        if isinstance(value, tuple) and not isinstance(value, Work | ResultArray):
            return f"({''.join(map(form, value))})"
        if value is None:
            return "N"
        if isinstance(value, bool | int | float):
            numbers.append(float(value))
            return "?" if isinstance(value, bool) else "i" if isinstance(value, int) else "f"
        if isinstance(value, Work):
            sizes.extend(value.shape)
        elif isinstance(value, ResultArray):
            results.append(jax.ShapeDtypeStruct(*value))
        else:
            operands.append(value)
        plan.append("s" if isinstance(value, Work) else "r" if isinstance(value, ResultArray) else "a")
        return f"{LETTERS[np.dtype(value.dtype).name]}{len(value.shape)}"

    text = form(arguments)
    call = jax.ffi.ffi_call(TARGET, results, vmap_method="expand_dims")
    found: list[Any] = call(
        *operands,
        entry=entry.__name__,
        format=text,
        plan="".join(plan),
        sizes=np.array(sizes, dtype=np.int64),
        numbers=np.array(numbers, dtype=np.float64),
    )
    return found

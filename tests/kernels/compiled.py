"""Inner kernels as Python can call them, and room for them to work in."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from sagline.kernels.memory import Memory

F = TypeVar("F", bound=Callable[..., Any])


class Caller(JITCodeLibrary):
    """Machine code of a caller: it calls kernels where they are.

    numba would link all that they are made of into it, and optimize all of it once more: half of its time.
    """

    def add_linking_library(self, library: Any) -> None:
        """Link what is numba's own, which is nowhere else; a kernel is only made ready."""
        library._ensure_finalized()
        module = library._shared_module or library._final_module
        if not any("sagline" in function.name for function in module.functions if not function.is_declaration):
            cast("Any", super()).add_linking_library(library)


class CompilerOfCallers(Compiler):
    """As numba compiles everything, but for where the machine code goes."""

    def define_pipelines(self) -> Any:
        """The usual steps."""
        self.state.library = cast("Any", Caller)(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return cast("Any", super()).define_pipelines()


def compiled(caller: F) -> F:
    """A function that calls kernels, compiled anew in every run of the tests."""
    return cast("F", numba.njit(error_model="numpy", pipeline_class=CompilerOfCallers)(caller))


def from_python(inner: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel, formula or piece of glue that Python can call, which by itself would crash.

    Names are spelled out because glue cannot take *arguments.
    """
    names = ", ".join(inspect.signature(cast("Any", inner).py_func).parameters)
    return compiled(cast("Callable[..., Any]", eval(f"lambda {names}: _inner({names})", {"_inner": inner})))


def memory(numbers: int = 2000, counters: int = 200) -> Memory:
    """Plenty, filled with what must never be read before it is written."""
    return Memory(np.full(numbers, np.nan), np.full(counters, -(10**9), dtype=np.int64))

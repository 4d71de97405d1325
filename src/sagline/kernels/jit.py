"""Decorators of kernels, and the back end that runs them: compiled C, numba, or plain Python.

`SAGLINE_BACKEND` selects the back end; the default is the first available one. Results differ only by rounding.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache, partial, update_wrapper
from importlib import import_module
from importlib.util import find_spec
from typing import Final, TypeVar, cast

from sagline.core.errors import InvalidValueError
from sagline.kernels.library import Entry, Library, LibraryError
from sagline.kernels.sources import say_once

F = TypeVar("F", bound=Callable[..., object])

independent = range  # for loops whose passes have no effect on each other; the C compiler may combine several passes

VARIABLE: Final = "SAGLINE_BACKEND"
BACKENDS: Final = ("c", "numba", "python")
INSTALL: Final = "Install sagline again where a C compiler is available, or install numba."


@cache
def backend() -> str:
    """Back end of the kernels.

    Returns:
        "c" for the compiled library, "numba" for compilation at the first use, "python" for plain Python.

    Raises:
        InvalidValueError: If the environment variable SAGLINE_BACKEND has another value, or its back end is missing.

    Examples:
        >>> import sagline as sl
        >>> sl.backend() in ("c", "numba", "python")
        True
    """
    chosen = os.environ.get(VARIABLE, "")
    if chosen and chosen not in BACKENDS:
        raise InvalidValueError(VARIABLE, repr(chosen), "c, numba or python", "Correct the variable, or unset it.")
    reason, step = "", INSTALL
    if chosen in ("", "c"):
        try:
            compiled_library()
        except LibraryError as error:
            reason, step = f"{error}; ", "Run `make env` in the clone." if error.stale else INSTALL
            if chosen:
                raise InvalidValueError(
                    VARIABLE, "c", "another back end: numba or python", f"{error}. {step}"
                ) from error
        else:
            return "c"
    if chosen in ("", "numba"):
        if find_spec("numba") is not None:
            if not chosen:
                say_once(f"sagline: {reason}numba compiles the kernels at their first use. {step}")
            return "numba"
        if chosen:
            raise InvalidValueError(
                VARIABLE, "numba", "another back end: c or python", "Install numba, or unset the variable."
            )
    if not chosen:
        say_once(f"sagline: {reason}the kernels run as plain Python, which is about 500 times slower. {step}")
    return "python"


@cache
def compiled_library() -> Library:
    """The library of compiled kernels."""
    return Library.load()


def entry(function: F) -> F:
    """A kernel that Python calls, and that runs without Python's global lock."""
    if backend() == "c":
        found = compiled_library().entry(function.__name__, function.__module__)
        if found is not None:
            return cast("F", update_wrapper(found, function))
        from sagline.kernels.plain import plain

        say_once(f"sagline: the library has no entry {function.__name__}, which runs as plain Python")
        return plain(function)
    return _compiled(function, "entry")


def loaded_entry(name: str, module: str) -> object:
    """The entry `name` of `module`. The module is not imported if the library has the entry."""
    found = compiled_library().entry(name, module) if backend() == "c" else None
    return getattr(import_module(module), name) if found is None else found


def kernel(function: F) -> F:
    """A kernel that only other kernels call. Python cannot call such a kernel if numba compiles it."""
    return _compiled(function, "kernel")


def formula(function: F) -> F:
    """A kernel that the compiler copies into its callers, so that their loops vectorize."""
    return _compiled(function, "formula")


def glue(function: F) -> F:
    """A kernel that is copied into its callers before the compilation, so that its arguments cost no time."""
    return _compiled(function, "glue")


def _compiled(function: F, kind: str) -> F:
    """`function` prepared for the back end. Unchanged for the compiled library, which contains the kernels."""
    if backend() == "numba":
        from sagline.kernels.with_numba import compiled

        return compiled(function, kind)
    if backend() == "python":
        from sagline.kernels.plain import plain

        return plain(function)
    return function


def bound(function: Callable[..., object], *arguments: object, numbers: int = 0) -> Callable[..., object]:
    """An entry that keeps its arguments for many calls. Each call takes a microsecond less than a call of the entry."""
    # The contents of the arrays may change between calls. Each call supplies new values for the last `numbers`
    # arguments.
    if isinstance(function, Entry):
        return function.bind(arguments, numbers)
    fixed = arguments[: len(arguments) - numbers]
    if backend() == "numba":
        from sagline.kernels.with_numba import machine_code

        return partial(machine_code(function, arguments), *fixed)
    return partial(function, *fixed)

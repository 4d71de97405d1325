"""Kernels that numba compiles, and their machine code on disk. The digest in a file shows whether the file is damaged.

Each kernel has one file per set of argument types, written atomically. If a file is damaged, its kernel is compiled
again and the file is replaced. If the folder cannot be used, every process compiles the kernels again, and prints one
line about it to standard error.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
from numba.core import compiler, serialize

from sagline.kernels.sources import DIGEST, SUFFIX, folder_of, is_whole, say_once

F = TypeVar("F", bound=Callable[..., object])

_result: Any = compiler.CompileResult  # numba has no type annotations
_dumps: Any = serialize.dumps


class _KernelCache:
    """Machine code of one kernel on disk. numba's own cache is not used, because it does not check files."""

    def __init__(self, function: Callable[..., object], folder: Path, *, announced: bool = False) -> None:
        """Set the folder for a function, without reading or writing."""
        self._announced = announced
        self.cache_path = str(folder)
        self._folder, self._code = folder, function.__code__
        module = Path(self._code.co_filename).stem
        python = f"py{sys.version_info[0]}{sys.version_info[1]}"
        self._name = f"{module}.{function.__qualname__}-{self._code.co_firstlineno}.{python}"
        self._enabled = True

    def enable(self) -> None:
        """Allow reading and writing of files."""
        self._enabled = True

    def disable(self) -> None:
        """Stop reading and writing of files."""
        self._enabled = False

    def flush(self) -> None:
        """Remove the files of this kernel."""
        for file in self._folder.glob(f"{self._name}.*{SUFFIX}"):
            file.unlink(missing_ok=True)

    def load_overload(self, signature: object, target_context: Any) -> Any:
        """Machine code for the argument types `signature`. None if no usable file exists."""
        if not self._enabled:
            return None
        target_context.refresh()
        file = self._file(signature, target_context.codegen())
        try:
            content = file.read_bytes()
        except OSError:
            if self._announced:
                say_once(
                    f"sagline: numba compiles {self._code.co_name}, which takes some seconds; where a C compiler is "
                    "available, the installation of sagline builds all kernels"
                )
            return None  # the file does not exist or cannot be read; `save_overload` reports the cause
        if not is_whole(content):
            say_once(f"sagline: {file} is damaged; its kernel is compiled again")
            return None
        return _result._rebuild(target_context, *pickle.loads(content[DIGEST:]))

    def save_overload(self, signature: object, compiled: Any) -> None:
        """Write the machine code for the argument types `signature`. If writing fails, a line reports the cause."""
        if not self._enabled or compiled.lifted or compiled.library.has_dynamic_globals:
            return
        payload = _dumps(compiled._reduce())
        file = self._file(signature, compiled.codegen)
        unfinished = file.with_name(f"{file.name}.{uuid.uuid4().hex}")
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            try:
                unfinished.write_bytes(hashlib.sha256(payload).digest() + payload)
                os.replace(unfinished, file)
            except BaseException:
                unfinished.unlink(missing_ok=True)
                raise
        except OSError as error:
            say_once(
                f"sagline: compiled kernels cannot be kept in {self._folder.parent} ({error.strerror}), so each run "
                "compiles them; set NUMBA_CACHE_DIR to a writable folder"
            )

    def _file(self, signature: object, codegen: Any) -> Path:
        """File for the argument types `signature`, the processor, and the version of numba."""
        key = repr((numba.__version__, str(signature), codegen.magic_tuple(), self._code.co_code))
        return self._folder / f"{self._name}.{hashlib.sha256(key.encode()).hexdigest()[:16]}{SUFFIX}"


INNER: Final = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # this step takes a third of the compilation time
OPTIONS: Final[dict[str, dict[str, Any]]] = {
    "entry": {"nogil": True},
    "kernel": INNER,
    "formula": {**INNER, "forceinline": True},
    "glue": {"inline": "always"},
}


def compiled(function: F, kind: str) -> F:
    """A kernel whose machine code is kept on disk. A division by zero gives inf or NaN, as in NumPy."""
    # Kernels allocate no memory (`sagline.kernels.memory`). Reference counting (_nrt) is therefore off. With arrays in
    # NamedTuples, reference counting would take a quarter of the run time.
    every: dict[str, Any] = {"error_model": "numpy", "_nrt": False, **OPTIONS[kind]}
    return kept(cast("F", numba.njit(**every)(function)), folder_of(function.__module__), announced=kind == "entry")


def kept(dispatcher: F, folder: Path, *, announced: bool = False) -> F:
    """A compiled function whose machine code is kept in a folder. One line can announce the compilation."""
    numbas: Any = dispatcher
    numbas._cache = _KernelCache(numbas.py_func, folder, announced=announced)
    return dispatcher


def machine_code(function: Callable[..., object], arguments: tuple[object, ...]) -> Callable[..., object]:
    """Machine code of an entry for the types of `arguments`, compiled or read from disk."""
    # A call does not check the types of the arguments, which saves a microsecond for a dozen arrays. All arguments of a
    # call must have exactly the types of `arguments`.
    dispatcher: Any = function
    signature = tuple(cast("Any", numba.typeof)(argument) for argument in arguments)
    dispatcher.compile(signature)
    return cast("Callable[..., object]", dispatcher.get_overload(signature))

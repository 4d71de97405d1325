"""Compilation of kernels, and the folder of their machine code.

numba does not notice that a function called from another file was edited and would go on running stale machine code.
What a file's kernels become is therefore kept in a folder named by a hash of that file and of all that it imports.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit, typeof
from platformdirs import user_cache_path

from sagline.kernels.cache import SUFFIX, KernelCache

F = TypeVar("F", bound=Callable[..., object])

KERNELS = __name__.rpartition(".")[0]
SOURCES = Path(__file__).parent
# `from sagline.kernels.algebra import angle, cholesky`, names in parentheses too
IMPORT = re.compile(rf"^from {re.escape(KERNELS)}\.?([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


def base_folder() -> Path:
    """Folder of all compiled kernels: below NUMBA_CACHE_DIR if set, else below the user's cache folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return (Path(chosen) if chosen else user_cache_path("sagline")) / "kernels"


FOLDER = base_folder()


def sources_of(module: str, sources: Path) -> frozenset[Path]:
    """Source files on which a kernel's machine code depends, below the folder of the kernels."""
    waiting, found = {module}, set[Path]()
    while waiting:
        name = waiting.pop()
        file = sources.joinpath(*name.split(".")).with_suffix(".py")
        if file not in found and file.is_file():
            found.add(file)
            waiting.update(_imported(file.read_text(encoding="utf-8")))
    return frozenset(found)


@cache
def _imported(source: str) -> frozenset[str]:
    """Names of what a file imports of the kernels: modules, and what is in them, which is no file."""
    names = set()
    for match in IMPORT.finditer(source):
        package = match[1]
        names.add(package)
        names.update(f"{package}.{name}".lstrip(".") for name in re.findall(r"(\w+)(?: as \w+)?", match[2]))
    return frozenset(names)


def cache_folder(module: str, sources: Path = SOURCES) -> Path:
    """Folder of the machine code of a module's kernels."""
    digest = hashlib.sha256()
    # a kernel from elsewhere, a benchmark's, may call any
    for source in sorted(sources_of(module, sources) or sources.rglob("*.py")):
        digest.update(source.relative_to(sources).as_posix().encode() + b"\0" + source.read_bytes())
    return FOLDER / digest.hexdigest()[:16]


@cache
def folder_of(function_module: str) -> Path:
    """`cache_folder` of a function's module, which does not change while the program runs."""
    return cache_folder(function_module.removeprefix(f"{KERNELS}."))


def entry(function: F) -> F:
    """A kernel that Python calls: compiled on first call, kept on disk; it runs without Python's global lock."""
    return _compiled(function, nogil=True)


def kernel(function: F) -> F:
    """A kernel that only kernels call: it lacks what Python needs to call it, and would crash if it did."""
    return _compiled(function, **INNER)


def formula(function: F) -> F:
    """A kernel that the machine code of its callers contains, so that their loops over it vectorize."""
    return _compiled(function, forceinline=True, **INNER)


def glue(function: F) -> F:
    """A kernel that is inlined into its callers before compilation, so that passing arguments costs no time."""
    return _compiled(function, inline="always")


INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # a third of the time to compile


def _compiled(function: F, **options: Any) -> F:
    """Machine code is kept on disk; a division by zero gives inf or NaN as in NumPy.

    Kernels allocate nothing (`sagline.kernels.memory`), and so need no counting of references (_nrt), which would take
    a quarter of their time where arrays come in NamedTuples.
    """
    every: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
    return kept(cast("F", njit(**{**every, **options})(function)), folder_of(function.__module__))


def kept(compiled: F, folder: Path) -> F:
    """A compiled function whose machine code is kept in a folder."""
    dispatcher: Any = compiled
    if hasattr(dispatcher, "py_func"):  # not with NUMBA_DISABLE_JIT
        dispatcher._cache = KernelCache(dispatcher.py_func, folder)
    return compiled


def machine_code(compiled: Callable[..., object], arguments: tuple[object, ...]) -> Callable[..., object]:
    """An entry's machine code for arguments of these types, compiled or read from disk.

    Calling it saves the look at every argument's type, a microsecond for a dozen arrays: only arguments of these very
    types may go in.
    """
    dispatcher: Any = compiled
    signature = tuple(cast("Any", typeof)(argument) for argument in arguments)
    dispatcher.compile(signature)
    return cast("Callable[..., object]", dispatcher.get_overload(signature))


def is_compiled(function: Callable[..., object], versions: int = 1) -> bool:
    """True if the machine code of an entry is on disk, in at least so many versions for different types."""
    name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
    return sum(1 for _ in folder_of(function.__module__).glob(f"{name}-*{SUFFIX}")) >= versions

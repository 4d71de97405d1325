"""How a kernel is compiled, and where the machine code is kept.

numba does not notice that a function called from another file was edited and would go on
running stale machine code. The cache folder is therefore named by a hash of all kernel sources.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit, typeof
from platformdirs import user_cache_path

F = TypeVar("F", bound=Callable[..., object])


def cache_folder() -> Path:
    """Folder of the compiled kernels: below NUMBA_CACHE_DIR if set, else below the user's cache folder."""
    digest = hashlib.sha256()
    kernels = Path(__file__).parent
    for source in sorted(kernels.rglob("*.py")):
        digest.update(source.relative_to(kernels).as_posix().encode() + b"\0" + source.read_bytes())
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(chosen) if chosen else user_cache_path("sagline")
    return base / f"kernels-{digest.hexdigest()[:16]}"


FOLDER = cache_folder()


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
    """A kernel that becomes part of its callers before they are compiled: what it passes on costs nothing."""
    return _compiled(function, inline="always")


INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # a third of the time to compile


def _compiled(function: F, **options: Any) -> F:
    """Machine code is kept on disk; a division by zero gives inf or NaN as in NumPy.

    Kernels allocate nothing (`sagline.kernels.memory`), and so need no counting of references (_nrt), which would take
    a quarter of their time where arrays come in NamedTuples.
    """
    # numba reads its cache folder while it decorates: set for that moment only, other users of numba keep theirs.
    before = getattr(config, "CACHE_DIR")  # noqa: B009 - set by numba at run time, unknown to type checkers
    setattr(config, "CACHE_DIR", str(FOLDER))  # noqa: B010
    every: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}
    try:
        return cast("F", njit(**{**every, **options})(function))
    finally:
        setattr(config, "CACHE_DIR", before)  # noqa: B010


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
    """Whether the machine code of an entry is on disk, in at least so many versions for different types."""
    name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
    return sum(1 for _ in FOLDER.rglob(f"{name}-*.nbc")) >= versions

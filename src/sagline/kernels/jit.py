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

from numba import config, njit
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
    """A kernel that only kernels call."""
    return _compiled(function, **INNER)


def formula(function: F) -> F:
    """A kernel that the machine code of its callers contains, so that their loops over it vectorize."""
    return _compiled(function, forceinline=True, **INNER)


def glue(function: F) -> F:
    """A kernel that becomes part of its callers before they are compiled: what it passes on costs nothing."""
    return _compiled(function, inline="always")


INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # what Python would need, and takes time to compile


def _compiled(function: F, **options: Any) -> F:
    """Machine code is kept on disk; a division by zero gives inf or NaN as in NumPy."""
    # numba reads its cache folder while it decorates: set for that moment only, other users of numba keep theirs.
    before = getattr(config, "CACHE_DIR")  # noqa: B009 - set by numba at run time, unknown to type checkers
    setattr(config, "CACHE_DIR", str(FOLDER))  # noqa: B010
    try:
        return cast("F", njit(cache=True, error_model="numpy", **options)(function))
    finally:
        setattr(config, "CACHE_DIR", before)  # noqa: B010


def is_cold() -> bool:
    """Whether nothing is compiled yet, so that the first call will take a minute rather than a moment."""
    return not any(FOLDER.glob("**/*.nbi"))

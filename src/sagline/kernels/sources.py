"""Sources of the kernels, their digest, and the folder of the machine code from numba.

numba does not detect changes of functions in other files and would run stale machine code. The machine code of a file
is therefore in a folder whose name is a hash of this file and of all files that it imports.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

KERNELS = __name__.rpartition(".")[0]
SOURCES = Path(__file__).parent
BACK_ENDS = frozenset(SOURCES / f"{name}.py" for name in ("jit", "library", "plain", "sources", "with_numba"))
DIGEST = hashlib.sha256().digest_size  # number of bytes of the digest at the beginning of a file of machine code
SUFFIX = ".nbc"
# `from sagline.kernels.algebra import angle, cholesky`, also with names in parentheses
IMPORT = re.compile(rf"^from {re.escape(KERNELS)}\.?([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


def base_folder() -> Path:
    """Folder of all compiled kernels: below NUMBA_CACHE_DIR if set, else below the user's cache folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return (Path(chosen) if chosen else user_cache_path("sagline")) / "kernels"


FOLDER = base_folder()


def digest(folder: Path, sources: Iterable[Path]) -> str:
    """Digest of the files `sources` below `folder`: their names and contents."""
    found = hashlib.sha256()
    for source in sorted(sources):
        found.update(source.relative_to(folder).as_posix().encode() + b"\0" + source.read_bytes())
    return found.hexdigest()[:16]


@cache
def digest_of_kernels() -> str:
    """Digest of all kernels and of the module that loads their library. Other back ends do not change this digest."""
    return digest(SOURCES, set(SOURCES.rglob("*.py")) - BACK_ENDS | {SOURCES / "library.py"})


def is_whole(content: bytes) -> bool:
    """True if `content`, a file of machine code, begins with the digest of its other bytes."""
    return hashlib.sha256(content[DIGEST:]).digest() == content[:DIGEST]


def sources_of(module: str, sources: Path) -> frozenset[Path]:
    """Source files of kernels on which the machine code of `module` depends."""
    if not sources.joinpath(*module.split(".")).with_suffix(".py").is_file():
        # a kernel outside the folder, such as a benchmark, may call all kernels
        return frozenset(sources.rglob("*.py"))
    waiting, found = {module, "with_numba"}, set[Path]()
    while waiting:
        name = waiting.pop()
        file = sources.joinpath(*name.split(".")).with_suffix(".py")
        if file not in found and file.is_file():
            found.add(file)
            waiting.update(_imported(file.read_text(encoding="utf-8")))
    return frozenset(found)


@cache
def _imported(source: str) -> frozenset[str]:
    """Names that the file `source` imports from the kernels: modules, and names in modules."""
    names = set()
    for match in IMPORT.finditer(source):
        package = match[1]
        names.add(package)
        names.update(f"{package}.{name}".lstrip(".") for name in re.findall(r"(\w+)(?: as \w+)?", match[2]))
    return frozenset(names)


def cache_folder(module: str, sources: Path = SOURCES) -> Path:
    """Folder of the machine code of a module's kernels."""
    return FOLDER / digest(sources, sources_of(module, sources))


@cache
def folder_of(function_module: str) -> Path:
    """`cache_folder` of the module of a function, computed once per process."""
    return cache_folder(function_module.removeprefix(f"{KERNELS}."))


@cache
def say_once(line: str) -> None:
    """Write a line to standard error. Each line is written only once per process."""
    print(line, file=sys.stderr, flush=True)

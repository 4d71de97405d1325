"""Folders in which files are prepared; those of killed processes are removed by whoever writes there next."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX, SUFFIX = ".sagline-", ".part"
LOCK = "lock"  # held as long as the folder is in use: the system frees it, however the process ends
TRIES = 100


@contextmanager
def staging(folder: Path) -> Iterator[Path]:
    """A folder of its own inside a folder, to write to; it is gone when the block ends.

    What processes that were killed have left there is removed first.

    Args:
        folder: Where; its file system is that of the files to be, so that a file can be moved in one step.

    Yields:
        The new folder.

    Raises:
        OSError: If it cannot be created.
    """
    for left in folder.glob(f"{PREFIX}*{SUFFIX}"):
        _remove_if_left(left)
    place, lock = _new_place(folder)
    try:
        yield place
    finally:
        os.close(lock)
        shutil.rmtree(place, ignore_errors=True)


def _new_place(folder: Path) -> tuple[Path, int]:
    """A new folder and the lock that says that it is in use; one that another process takes for left is given up."""
    for _ in range(TRIES):
        place = Path(tempfile.mkdtemp(prefix=PREFIX, suffix=SUFFIX, dir=folder))
        try:
            lock = _opened(place)
        except FileNotFoundError:
            continue
        if is_taken(lock, if_unknown=True) and os.fstat(lock).st_nlink:
            return place, lock
        os.close(lock)
    raise TimeoutError(f"other processes remove what is written in {folder}")


def _remove_if_left(place: Path) -> None:
    """Remove a folder that nobody is using any more; one that cannot be removed stays."""
    with suppress(OSError):
        if place.is_symlink():
            return
        lock = _opened(place)
        if is_taken(lock, if_unknown=False):
            shutil.rmtree(place, ignore_errors=True)
        os.close(lock)


def _opened(place: Path) -> int:
    flags = os.O_RDWR | os.O_CREAT
    for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC"):  # neither a link nor a fifo planted there does harm
        flags |= getattr(os, name, 0)
    return os.open(place / LOCK, flags, 0o600)


def is_taken(lock: int, *, if_unknown: bool) -> bool:
    """Whether a lock could be taken: False where another process holds it.

    Args:
        lock: The open file.
        if_unknown: The answer where the file system, or Windows, knows no locks.
    """
    if sys.platform == "win32":
        return if_unknown
    import fcntl

    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return if_unknown
    return True

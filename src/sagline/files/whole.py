"""Files that are written whole or not at all, and never over what is no file.

A name that is written to is free or a regular file's. Folders, devices, pipes and sockets are refused, and so are
links: what a link leads to is never replaced by way of its name, and the link is not replaced either. Links among the
folders above are followed. A file that is replaced keeps its permissions; other names of the same file (hard links)
keep what was there before.
"""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from sagline.core.errors import FileError
from sagline.files.kinds import kind_of
from sagline.files.staging import SUFFIX, staging

_finished: ContextVar[list[Path] | None] = ContextVar("finished", default=None)


@contextmanager
def written_whole(file: os.PathLike[str] | str, size: int = 0) -> Iterator[Path]:
    """A place to write to that becomes the file only when the block ends well.

    The block writes to a new file beside the real one. When it ends, that file is flushed to the disk and takes the
    real one's name in one step; when it fails or is interrupted, it is removed and whatever was there before stays.

    Args:
        file: The file to be.
        size: Bytes it will have or more; that they fit is found out before the block begins.

    Yields:
        Path of the file to write; it exists and is empty.

    Raises:
        FileError: If the name is taken by something that is no regular file, the folder is missing or cannot be
            written, or the disk is full.
    """
    target = check_file(file)
    with written_together(target.parent, [target.name], size) as (partial,):
        yield partial


@contextmanager
def written_together(folder: os.PathLike[str] | str, names: Sequence[str], size: int = 0) -> Iterator[tuple[Path, ...]]:
    """Places to write to that become files of one folder together, only when the block ends well.

    Args:
        folder: The folder; it exists.
        names: Names of the files to be.
        size: Bytes that they will have or more.

    Yields:
        Path of each file to write; they exist and are empty.

    Raises:
        FileError: As for `written_whole`; then none of them has been written.
    """
    targets = [check_file(Path(folder) / name) for name in names]
    try:
        with staging(Path(folder)) as place:
            parts = tuple(place / f"{k}{SUFFIX}" for k in range(len(targets)))
            for part in parts:
                part.touch()
            _find_room(place / "room", size)
            yield parts
            for part, target in zip(parts, targets, strict=True):
                _complete(part, target)
            old, new = [str(part) for part in parts], [str(target) for target in targets]
            list(map(os.replace, old, new))  # all of it runs in C: Ctrl-C does not get between two names
    except OSError as error:
        target = _blamed(error, targets)
        raise FileError(target, f"cannot be written ({_reason(error)})", _next_step(target)) from error
    finished = _finished.get()
    if finished is not None:
        finished.extend(targets)


def write_text(file: os.PathLike[str] | str, text: str) -> None:
    """Write a text in UTF-8, whole or not at all.

    Args:
        file: The file; one that exists is replaced.
        text: What is to stand in it.

    Raises:
        FileError: If the file cannot be written, or the text holds half a character; what was there before is
            untouched.
    """
    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        found = f"U+{ord(text[error.start]):04X} in {text[max(0, error.start - 20) : error.start]!r}…"
        step = "Correct the name or note it comes from."
        raise FileError(Path(file), f"cannot hold half a character ({found})", step) from None
    with written_whole(file) as partial:
        partial.write_bytes(content)


@contextmanager
def finished_files() -> Iterator[list[Path]]:
    """What gets finished while inside: what there is to name when something after it fails.

    Yields:
        The files written whole so far, in order; it grows.
    """
    files: list[Path] = []
    token = _finished.set(files)
    try:
        yield files
    finally:
        _finished.reset(token)


def check_file(file: os.PathLike[str] | str) -> Path:
    """Refuse a name that a file could not be written to, without touching it.

    Args:
        file: The file to be.

    Returns:
        Its path.

    Raises:
        FileError: If the name is taken by something other than a regular file that may be written, or is no name.
    """
    target = Path(file)
    try:
        mode = target.lstat().st_mode
    except FileNotFoundError:
        return target
    except (OSError, ValueError) as error:  # ValueError: a zero byte, half a character
        raise FileError(target, f"cannot be written ({_reason(error)})", _next_step(target)) from None
    if stat.S_ISLNK(mode):
        leads = os.readlink(target)
        raise FileError(target, f"is a link, to {leads}", "Name the file itself, or remove the link.")
    if kind := kind_of(mode):
        raise FileError(target, f"is {kind.text}", kind.next_step)
    if not os.access(target, os.W_OK):
        raise FileError(target, "is write-protected", "Change its permissions, or give another name.")
    return target


def check_files(folder: os.PathLike[str] | str, names: Iterable[str]) -> None:
    """Refuse files that could not be written to a folder, without touching anything.

    Args:
        folder: The folder; it need not exist.
        names: Names of the files to be.

    Raises:
        FileError: If the folder cannot be written to, or a name is taken by something that is no file.
    """
    check_folder(folder)
    for name in names:
        check_file(Path(folder) / name)


def check_folder(folder: os.PathLike[str] | str) -> None:
    """Refuse a folder that files could not be written to, without creating it.

    Args:
        folder: The folder; it need not exist.

    Raises:
        FileError: If it is no folder, or neither it nor the nearest folder above it can be written.
    """
    path = Path(folder).absolute()
    nearest = next(place for place in (path, *path.parents) if os.path.lexists(place))
    if not nearest.is_dir():
        raise FileError(path, f"cannot be written ({nearest} is a file, not a folder)", "Name another folder.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise FileError(path, f"cannot be written (no permission in {nearest})", "Name another folder.")
    for part in path.relative_to(nearest).parts:
        try:
            os.lstat(nearest / part)
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:  # a name that is too long, or holds a zero byte
            raise FileError(path, f"cannot be created ({_reason(error)})", "Name another folder.") from None


def made_folder(folder: os.PathLike[str] | str) -> Path:
    """The folder, created with everything above it where it is missing.

    Args:
        folder: The folder.

    Returns:
        Its path.

    Raises:
        FileError: If it cannot be created.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be created ({_reason(error)})", "Name another folder.") from None
    return path


def _find_room(file: Path, size: int) -> None:
    """Find out that the disk holds so many bytes: HDF5 crashes on a full one."""
    if size and hasattr(os, "posix_fallocate"):
        with file.open("wb") as handle:
            os.posix_fallocate(handle.fileno(), 0, size)
        file.unlink()


def _complete(part: Path, target: Path) -> None:
    """Give a file the permissions of the one it replaces, and have all of it on the disk."""
    if target.is_file():
        shutil.copymode(target, part)
    with part.open("rb+") as handle:
        os.fsync(handle.fileno())


def _blamed(error: OSError, targets: Sequence[Path]) -> Path:
    """The file that an error is about, by the name of its part; the first if it does not say."""
    name = Path(str(error.filename)).name.removesuffix(SUFFIX)
    return targets[int(name)] if name.isdecimal() and int(name) < len(targets) else targets[0]


def _reason(error: Exception) -> str:
    reason: str = getattr(error, "strerror", None) or str(error)  # HDF5 gives a text and no number
    return next(iter(reason.splitlines()), type(error).__name__)


def _next_step(target: Path) -> str:
    if not target.parent.is_dir():
        return f"Create the folder {target.parent} first, or name another."
    return "Check the permissions of its folder and the space on the disk, or name another folder."

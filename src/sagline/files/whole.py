"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sagline.errors import FileError


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
        FileError: If the folder is missing or cannot be written, or the disk is full.
    """
    target = Path(file)
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        if target.is_dir():
            raise FileError(target, "is a folder", "Give the name of a file in it.")
        _reserve(partial, size)
        yield partial
        _flush(partial)
        partial.replace(target)
    except OSError as error:
        raise FileError(target, f"cannot be written ({_reason(error)})", _next_step(target)) from error
    finally:
        if partial.is_file():
            partial.unlink()


def write_text(file: os.PathLike[str] | str, text: str) -> None:
    """Write a text in UTF-8, whole or not at all.

    Args:
        file: The file; one that exists is replaced.
        text: What is to stand in it.

    Raises:
        FileError: If the file cannot be written; what was there before is untouched.
    """
    with written_whole(file) as partial:
        partial.write_text(text, encoding="utf-8")


def check_folder(folder: os.PathLike[str] | str) -> None:
    """Refuse a folder that files could not be written to, without creating it.

    Args:
        folder: The folder; it need not exist.

    Raises:
        FileError: If it is no folder, or neither it nor the nearest folder above it can be written.
    """
    path = Path(folder).absolute()
    nearest = next(place for place in (path, *path.parents) if place.exists())
    if not nearest.is_dir():
        raise FileError(path, f"cannot be written ({nearest} is a file, not a folder)", "Name another folder.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise FileError(path, f"cannot be written (no permission in {nearest})", "Name another folder.")


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
    except OSError as error:
        raise FileError(path, f"cannot be created ({_reason(error)})", "Name another folder.") from None
    return path


def _reserve(file: Path, size: int) -> None:
    """Create an empty file, after the disk has shown that it holds so many bytes: HDF5 crashes on a full one."""
    with file.open("wb") as handle:
        if size and hasattr(os, "posix_fallocate"):
            os.posix_fallocate(handle.fileno(), 0, size)
            handle.truncate(0)


def _flush(file: Path) -> None:
    with file.open("rb+") as handle:
        os.fsync(handle.fileno())


def _reason(error: OSError) -> str:
    return error.strerror or str(error).splitlines()[0]  # HDF5 gives a text and no number


def _next_step(target: Path) -> str:
    if not target.parent.is_dir():
        return f"Create the folder {target.parent} first, or name another."
    return "Check the permissions of its folder and the space on the disk, or name another folder."

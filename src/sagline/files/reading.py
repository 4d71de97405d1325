"""Reading of regular files with limited size: bytes, or text in UTF-8."""

from __future__ import annotations

import codecs
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from sagline.core.errors import FileError, InvalidValueError

MEGABYTE: Final = 1_000_000
HDF_BEGIN: Final = b"\x89HDF\r\n\x1a\n"  # first bytes of every NetCDF-4 file
_IRREGULAR: Final = {
    stat.S_IFDIR: ("a folder", "Give the name of a file in it."),
    stat.S_IFCHR: ("a device, not a file", "Name a file."),
    stat.S_IFBLK: ("a device, not a file", "Name a file."),
    stat.S_IFIFO: ("a pipe, not a file", "Name a file."),
    stat.S_IFSOCK: ("a socket, not a file", "Name a file."),
}
_OTHER_TEXT: Final = {codecs.BOM_UTF16_LE: "UTF-16", codecs.BOM_UTF16_BE: "UTF-16"}


def check_regular(path: Path, mode: int) -> None:
    """Refuse a path that is not a regular file. `mode`: its mode from `os.stat`."""
    if not stat.S_ISREG(mode):
        kind, step = _IRREGULAR.get(stat.S_IFMT(mode), ("no file", "Name a file."))
        raise FileError(path, f"is {kind}", step)


@contextmanager
def value_errors(path: Path | str) -> Iterator[None]:
    """Add the name of the file `path` to errors of its values."""
    try:
        yield
    except InvalidValueError as error:
        raise FileError.of(path, error) from None


@contextmanager
def system_errors(path: Path) -> Iterator[None]:
    """Convert errors of the system for a file that must exist to a FileError."""
    try:
        yield
    except FileNotFoundError:
        raise FileError(path, "does not exist", "Check its name.") from None
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: Exception) -> FileError:
    """Create the FileError for a file that the system cannot read."""
    reason = getattr(error, "strerror", None) or error
    return FileError(path, f"cannot be read ({reason})", "Check its name and its permissions.")


def read_bytes(path: Path, limit: float) -> bytes:
    """Read a regular file of at most `limit` MB. Pipes and devices are not opened, because they may never end."""
    most = int(limit * MEGABYTE)
    try:
        check_regular(path, path.stat().st_mode)
        with path.open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte or a lone surrogate
        raise _unreadable(path, error) from None
    if data.startswith(HDF_BEGIN):
        step = "Give a robot, path or log here. To look at a plan or a simulation: sagline view ROBOT FILE."
        raise FileError(path, "is a NetCDF file, for example a plan or a workspace", step)
    if len(data) > most:
        size = max(path.stat().st_size, len(data)) / MEGABYTE
        reason = f"is too large: {size:.3g} MB; a file of this kind has at most {limit:g} MB"
        raise FileError(path, reason, "Check that this is the file you mean.")
    return data


def read_text(path: Path, limit: float) -> str:
    """Read the text of a UTF-8 file of at most `limit` MB, without its byte order mark."""
    data = read_bytes(path, limit)
    if other := _OTHER_TEXT.get(data[:2]):
        raise FileError(path, f"is {other} text, not UTF-8 text", "Save it again as UTF-8.")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        step = "Check that this is the file you mean, or save it as UTF-8."
        raise error_at_line(path, f"is not UTF-8 text (line {line})", step) from None
    if "\0" in text:
        raise FileError(path, "is not text: it contains zero bytes", "Check that this is the file you mean.")
    return text


def error_at_line(path: Path | str, reason: str, next_step: str) -> FileError:
    """Create a FileError. If the reason contains a line number, the item of the error is this line."""
    line = re.search(r"\bline \d+", reason)
    return FileError(path, reason, next_step, item=line and line[0])

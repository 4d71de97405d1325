"""A digest at the end of a file, over all that stands before it: whether it is as it was written.

Formats that state their own length, HDF5 among them, do not mind what follows. A digest over the bytes is checked
before anything in them is believed: a library that reads a damaged file may ask for any amount of memory, and time.
"""

from __future__ import annotations

from enum import Enum
from hashlib import sha256
from pathlib import Path
from typing import BinaryIO

_HEAD, _TAIL = b"\nsagline sha256 ", b"\n"
_LENGTH = len(_HEAD) + sha256().digest_size * 2 + len(_TAIL)
_BLOCK = 1 << 20  # bytes read at once


class Seal(Enum):
    """What the end of a file says about the rest."""

    WHOLE = "the file is as it was written"
    BROKEN = "something in it has changed since it was written"
    MISSING = "it carries no digest"


def seal(file: Path) -> None:
    """Put the digest of a file at its end.

    Args:
        file: The file.

    Raises:
        OSError: If it cannot be read or written.
    """
    with file.open("rb+") as handle:
        handle.write(_line(handle, file.stat().st_size))


def seal_of(file: Path) -> Seal:
    """What the end of a file says about the rest.

    Args:
        file: The file.

    Returns:
        Whether its digest is there, and right.

    Raises:
        OSError: If it cannot be read.
    """
    with file.open("rb") as handle:
        before = max(0, file.stat().st_size - _LENGTH)
        handle.seek(before)
        found = handle.read()
        if not (found.startswith(_HEAD) and found.endswith(_TAIL)):
            return Seal.MISSING
        handle.seek(0)
        return Seal.WHOLE if found == _line(handle, before) else Seal.BROKEN


def _line(handle: BinaryIO, size: int) -> bytes:
    """The last line of a file whose content is read from here; the place behind it is where to write the line."""
    found = sha256()
    while size > 0 and (block := handle.read(min(_BLOCK, size))):
        found.update(block)
        size -= len(block)
    return _HEAD + found.hexdigest().encode() + _TAIL
